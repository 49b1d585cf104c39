"""Which spells along each drive's most probable states are a fault's: not another drive's, the ground's, a turn's or what follows from one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.asked import asked_of
from diagnosis.response.calm_holds import calm_hold
from diagnosis.response.common_cause import consequence, less_sure, stands_with_all, unwinds
from diagnosis.response.company import after_a_dispute, in_company
from diagnosis.response.drive_faults import DriveFaults
from diagnosis.response.ground import by_drag, by_slip
from diagnosis.response.joint import rolling
from diagnosis.response.late import late_neighbour
from diagnosis.response.models import BLOCK_S, Beside
from diagnosis.response.nearer import nearer_to_its_command
from diagnosis.response.ramps import only_a_ramp
from diagnosis.response.rivals import others_fault, told_and_doing_alike
from diagnosis.response.scene import Given, Scene
from diagnosis.response.spells import Spell, until_back, where_asked
from diagnosis.response.turning import Turning, turning_of, turns_other_way, turns_with, unasked_turn, wrong_yaw_rate
from diagnosis.response.uphill import lower_by_a_load

Flags = NDArray[np.bool_]
Spells = dict[str, list[Spell]]

_LEAST_S = 1.0


class Weighed(NamedTuple):
    """Spells by wheel.

    Attributes
    ----------
    kept : Spells
        Those that are a fault of the wheel.
    slips, turned : Spells
        Those that are slip, and those of a turn that nothing asked for.
    asked : dict[str, Flags], each of shape (b,)
        Blocks in which each wheel is asked to move.
    turning : Turning or None
        What each side's difference says beside the yaw rate.
    other_way : bool
        Whether the sides go apart the other way than the machine turns.
    by_motion : Mapping[str, Beside]
        Views of the wheels by the ground and the body; empty where the machine turns the other way, for then a yaw rate confirms no wheel.
    """

    kept: Spells
    slips: Spells
    turned: Spells
    asked: dict[str, Flags]
    turning: Turning | None
    other_way: bool
    by_motion: Mapping[str, Beside]


def weighed(scene: Scene, given: Given) -> Weighed:
    """Leave what another cause explains out of the spells of `scene.judged`."""
    judged, block_s = scene.judged, given.block_s
    turned = {
        w: [s for s in j.spells if unasked_turn(w, s, judged, given.geometry, given.yaw)] for w, j in judged.items()
    }
    slips = {w: [s for s in j.spells if by_slip(s, w, judged, scene.bodies.yaw)] for w, j in judged.items()}
    kept = {
        w: [
            less_sure(s, w, judged, block_s)
            for s in j.spells
            if not others_fault(s, w, judged)
            and not told_and_doing_alike(s, w, judged)
            and not consequence(s, w, judged)
            and not unwinds(s, w, judged, block_s)
            and not wrong_yaw_rate(s, j)
            and s not in slips[w]
            and s not in turned[w]
            and not by_drag(s, w, judged)
        ]
        for w, j in judged.items()
    }
    least = max(1, round(_LEAST_S / BLOCK_S))
    asked = {w: asked_of(j, given.limits) for w, j in judged.items()}
    bare = {w: j.posterior if j.speed is None else None for w, j in judged.items()}
    moves = {w: (x, rolling(x, judged[w].joint, given.moves)) for w, x in asked.items()}
    kept = {w: where_asked(spells, moves[w], least, bare[w]) for w, spells in kept.items()}
    kept = {w: until_back(spells, judged[w].wheel.blocks.dead, asked[w]) for w, spells in kept.items()}
    kept = {w: [s for s in spells if not stands_with_all(s, w, judged, asked)] for w, spells in kept.items()}
    turning = turning_of(judged, given.geometry, scene.bodies.yaw if not scene.sideways else None)
    kept = {w: [s._replace(turns=turns_with(w, s, judged, turning)) for s in spells] for w, spells in kept.items()}
    other_way = scene.exchanged or turns_other_way(judged, given.geometry, turning)
    return Weighed(kept, slips, turned, asked, turning, other_way, {} if other_way else scene.by_motion)


def settled(kept: Spells, drives: DriveFaults, scene: Scene, given: Given) -> tuple[Spells, Spells]:
    """Of the spells that are kept those that stay beside what is known of the drives, and those that are nobody's fault for sure."""
    judged, width = scene.judged, given.width
    kept = {
        w: [x for x in spells if not only_a_ramp(x, drives.unclear[w], judged[w], width)] for w, spells in kept.items()
    }
    nobodys = {
        w: [
            x
            for x in spells
            if lower_by_a_load(x, judged[w])
            or calm_hold(x, w, judged, given.moves)
            or nearer_to_its_command(x, w, judged, scene.mates[w], given.block_s)
            or in_company(x, w, judged)
            or after_a_dispute(x, w, judged, given.block_s)
        ]
        for w, spells in kept.items()
    }
    kept = {w: [x for x in spells if x not in nobodys[w]] for w, spells in kept.items()}
    return {
        w: [x for x in spells if not late_neighbour(x, w, drives.late, width)] for w, spells in kept.items()
    }, nobodys
