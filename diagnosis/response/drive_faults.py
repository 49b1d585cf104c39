"""Faults of the drives themselves: without power, without an answer, running on or away, and late."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.beside import turns_by_wheels
from diagnosis.response.common_cause import without_consequences
from diagnosis.response.drive import by_peers, unanswered
from diagnosis.response.effort import idle_drives
from diagnosis.response.inputs import cell_of
from diagnosis.response.late import late_wheels, left_open
from diagnosis.response.machine import Judged
from diagnosis.response.models import Beside, Blocks
from diagnosis.response.runaway import runaways
from diagnosis.response.runs_on import running_on
from diagnosis.response.scene import Given, Scene
from diagnosis.response.usual_times import as_usual
from diagnosis.response.wound_up import after_a_fault
from diagnosis.results.assessment import Finding

Array = NDArray[np.float64]


class DriveFaults(NamedTuple):
    """Findings by wheel.

    Attributes
    ----------
    weak : dict[str, list[Finding]]
        What is known to be a drive's fault, each time once.
    late : dict[str, list[Finding]]
        Wheels that read or answer later than the others.
    unclear : dict[str, list[Finding]]
        Late ones of which it stays open whose they are.
    """

    weak: dict[str, list[Finding]]
    late: dict[str, list[Finding]]
    unclear: dict[str, list[Finding]]


def drive_faults(scene: Scene, by_motion: Mapping[str, Beside], given: Given) -> DriveFaults:
    """Faults of the drives of `scene.judged`; `by_motion` are their views by the ground and the body."""
    judged, efforts, block_s = scene.judged, scene.efforts, given.block_s
    like = {w: by_peers(w, judged, given.geometry, cell_of(given.dt)) for w in judged}
    away = runaways(judged, efforts, block_s)
    weak = {
        w: _drives(
            w,
            judged,
            (like[w], by_motion.get(w)),
            (scene.idle_spans.get(w, []), bool(scene.mates[w]) or not _turned_by(w, judged)),
            (efforts.get(w), away.get(w, [])),
            block_s,
        )
        for w in judged
        if not judged[w].data.unpowered
    }
    weak = {w: without_consequences(found, w, judged, given.width) for w, found in weak.items()}
    late = late_wheels(judged, block_s)
    unclear = left_open(late, judged)
    return DriveFaults(weak, {w: [f for f in found if f not in unclear[w]] for w, found in late.items()}, unclear)


def _turned_by(wheel: str, found: Mapping[str, Judged]) -> bool:
    """Whether a wheel and one of the others turn the machine by what they differ."""
    means = {w: j.wheel.blocks.mean for w, j in found.items()}
    return any(turns_by_wheels(means[wheel], means[o]) for o in means if o != wheel)


def _drives(
    wheel: str,
    judged: Mapping[str, Judged],
    known: tuple[Blocks | None, Beside | None],
    pull: tuple[list[tuple[int, int]], bool],
    effort: tuple[Array | None, list[Finding]],
    block_s: float,
) -> list[Finding]:
    """What is known to be a drive's fault, each time once.

    `known`: its blocks with what is expected of it, and how the ground moves; `pull`: blocks in which it pulls nothing, and whether it is dragged along then;
    `effort` in blocks, and times in which it pulls away.
    """
    idle = after_a_fault(idle_drives(judged[wheel], *pull, block_s), judged[wheel], effort[0], block_s)  # without power
    told, blocks, share = idle + effort[1], known[0], judged[wheel].data.share
    if blocks is not None and share is not None:  # at a share of its speed it keeps none that it is not told
        blocks = blocks._replace(mean=as_usual(blocks.mean, share, round(block_s / judged[wheel].wheel.dt)))
    for more in (unanswered(wheel, judged, known, block_s), running_on(wheel, judged, blocks, block_s)):
        told = told + [f for f in more if not any(f.start < g.stop and g.start < f.stop for g in told)]
    return told
