"""Both sides of every drive by what was found, and where a side stays open: what is doubted, disputed, or would not have shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.calm_holds import either
from diagnosis.response.disputed import DISPUTED, HIDES, disputed_steps, doubted, unproved
from diagnosis.response.drive_faults import DriveFaults
from diagnosis.response.late import smallest_delay
from diagnosis.response.machine import lasting_losses, otherwise, unlike
from diagnosis.response.majority import by_majority
from diagnosis.response.motionless import motionless, not_moving
from diagnosis.response.power import powers_of, unshown
from diagnosis.response.rivals import held_back_together
from diagnosis.response.scene import Drives, Given, Scene
from diagnosis.response.sides import sides_of
from diagnosis.response.unlike import contradicting, unlike_in_motion
from diagnosis.response.weighed import Spells, Weighed
from diagnosis.results.assessment import Assessment, Finding, Reason
from diagnosis.results.said import Said

Flags = NDArray[np.bool_]
Parts = dict[str, tuple[Assessment, Assessment]]

_UNDIRECTED = (
    "{name} is never below 0, also where it is told to go backwards: it tells no direction and is read with that of its command, so that a "
    "{{wheel}} that turns the wrong way would not show."
)
_TURNED = (
    "The sides of the machine go apart as where it turns, of which the log has neither a command nor a measurement: log the commanded yaw "
    "rate (cmd.omega) or a measured one (imu.yaw_rate)."
)
_EXCHANGED = (
    "the sides, or those of one axle, go apart the other way than the machine turns: left and right may be exchanged, or the sign of one "
    "side, or of the yaw rate, is wrong"
)


class Sides(NamedTuple):
    """Both sides of every wheel, and what concerns the machine.

    Attributes
    ----------
    parts : Parts
        Sensor and drive of each wheel.
    astray : tuple[Said, ...]
        What is said where the machine goes elsewhere than it is told to.
    lasts : bool
        Whether that is worth a verdict.
    apart : tuple[str, ...]
        Wheels that read another share of the motion than the others, or nothing, all through.
    """

    parts: Parts
    astray: tuple[Said, ...]
    lasts: bool
    apart: tuple[str, ...]


def sides_of_all(
    spells: tuple[Spells, Spells], faults: DriveFaults, weighed: Weighed, scene: Scene, drives: Drives, given: Given
) -> Sides:
    """Both sides of every wheel; `spells` are those that are kept, and those that are nobody's for sure."""
    judged, width, (kept, nobodys) = scene.judged, given.width, spells
    together = held_back_together(judged)

    def both(w: str, late: Sequence[Finding]) -> tuple[Assessment, Assessment]:
        known, where = (faults.weak.get(w, []), late), (drives.left_out[w], together)
        return sides_of(judged[w], kept[w], known, where, given.limits, given.dt)

    parts: Parts = {w: both(w, faults.late[w]) for w in judged}
    for w, against in by_majority(judged, given.block_s, sideways=scene.sideways or weighed.other_way).items():
        told = [f for side in parts[w] for f in side.findings]
        more = [f for f in against if not any(f.start < g.stop and g.start < f.stop for g in told)]
        parts[w] = both(w, [*faults.late[w], *more]) if more else parts[w]
    for w, (sensor, drive) in parts.items():
        late = [slice(f.start, f.stop) for f in faults.unclear[w]]
        parts[w] = doubted(sensor, late + [slice(x.start * width, x.stop * width) for x in nobodys[w]]), drive
    if len(drives.data) == 1:
        parts = {w: (either(a, judged[w], given.moves), b) for w, (a, b) in parts.items()}
    astray, lasts = otherwise(judged, given.block_s, drives.witness.there)
    apart = unlike_in_motion(judged, scene.mates, sideways=scene.sideways, speeds=given.speeds)
    none_read = motionless(judged, given.limits.driving_speed, given.block_s)
    doubts = {w: Reason(j.odd) for w, j in judged.items() if j.odd and not any(side.findings for side in parts[w])}
    doubts |= {w: j.joint.unlike for w, j in judged.items() if j.joint is not None and j.joint.unlike}
    doubts |= apart | unlike(judged) | none_read
    if weighed.other_way:
        doubts = dict.fromkeys(judged, Reason(_EXCHANGED)) | doubts
    for w, why in doubts.items():
        parts[w] = doubted(parts[w][0], [slice(None)], why), parts[w][1]
    parts |= {w: not_moving(*parts[w], why) for w, why in none_read.items()}
    disputed = disputed_steps(judged, given.block_s)
    parts |= {w: (unproved(parts[w][0], one, DISPUTED), parts[w][1]) for w, one in disputed.items()}
    remarks = (*(x.text for x in astray), *scene.notes, *((_TURNED,) if any(weighed.turned.values()) else ()))
    parts = _with_powers(parts, remarks, weighed.asked, scene, given)
    return Sides(parts, astray, lasts, contradicting(apart, none_read))


def _with_powers(parts: Parts, remarks: Sequence[str], asked: Mapping[str, Flags], scene: Scene, given: Given) -> Parts:
    """Say of every sensor which deviations would have shown, and leave open where none would."""
    judged, block_s, out = scene.judged, given.block_s, dict[str, tuple[Assessment, Assessment]]()
    lasting = lasting_losses(judged)
    for w, (sensor, drive) in parts.items():
        j = judged[w]
        powers = powers_of(
            j.wheel.blocks, j.driving, asked[w], block_s, scene.beside.get(w), given.limits.clear_at, lasting[w]
        )
        hides = np.repeat(unshown(powers, j.driving.size, block_s), given.width)[: j.data.y.size]
        delay, lateness = smallest_delay(j, block_s)
        powers = powers._replace(rows=(*powers.rows, delay))
        signless = (_UNDIRECTED.format(name=j.data.name),) if j.data.undirected else ()
        left = unproved(sensor, hides, HIDES)
        out[w] = replace(left, powers=powers, notes=(*left.notes, lateness, *signless, *remarks)), drive
    return out
