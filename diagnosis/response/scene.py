"""What is known of all drives of a machine before any spell is weighed: which answer, what else tells of the motion, each one's states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.answering import BODY_COMMANDS, MOVES, wheels_of
from diagnosis.response.beside import Bodies, same_side, turns_by_wheels, views
from diagnosis.response.body import BodySpeed
from diagnosis.response.channel import holds_of, samples_of
from diagnosis.response.common_cause import standing
from diagnosis.response.effort import idle_spans, own_pull, powered, shares_of
from diagnosis.response.holds import with_habits
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.joint_gain import Gain, scaled_channels, without_gains
from diagnosis.response.machine import Judged
from diagnosis.response.models import BLOCK_S, Beside
from diagnosis.response.pairs import by_leaps
from diagnosis.response.rivals import by_each_other
from diagnosis.response.shaken import shakes_on, shaking_of
from diagnosis.response.sideways import crossed, goes_sideways
from diagnosis.response.spells import spans_of
from diagnosis.response.states import judge
from diagnosis.response.usual_times import as_usual, shares_by_commands, shares_by_positions
from diagnosis.response.vibration import Unit, Vibration
from diagnosis.response.witness import Witness, witness_of
from replay.machine.config import Limits
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_PAIR = 2  # wheels, of which each moves one side of the machine


class Given(NamedTuple):
    """What a walk is given beside the drives: arguments of `diagnosis.response.assess.assess_response`."""

    geometry: Geometry | None
    yaw: Array | None
    limits: Limits
    dt: float
    speeds: tuple[BodySpeed, ...] = ()
    heading: Array | None = None
    unit: Unit | None = None

    @property
    def width(self) -> int:
        """Samples of a block."""
        return max(1, round(BLOCK_S / self.dt))

    @property
    def block_s(self) -> float:
        """Length of a block [s]."""
        return self.width * self.dt

    @property
    def moves(self) -> float:
        """Speed from which on a drive moves [m/s]."""
        return MOVES * self.limits.driving_speed


class Drives(NamedTuple):
    """All drives and those that can be judged.

    Attributes
    ----------
    data : Mapping[str, FollowerData]
        Channels by wheel, as they were read.
    scales : Mapping[str, float]
        Gains that were taken out of channels.
    left_out : Mapping[str, Flags], each of shape (n,)
        Where each stands with the machine.
    idle : list[tuple[int, int]]
        Samples in which all stand though they are told to move, and no sensor of the body saw it move.
    seen : list[tuple[int, int]]
        The same where one did.
    witness : Witness
        Sensors of the body.
    shaken : list[tuple[int, int]]
        Samples in which all stand from one reading to the next, or start so, while an inertial unit shakes on as in motion.
    shaking : Vibration or None
        How that unit shakes.
    found : dict[str, Judged]
        Those that answer enough to be judged.
    """

    data: Mapping[str, FollowerData]
    scales: Mapping[str, Gain]
    left_out: Mapping[str, Flags]
    idle: list[tuple[int, int]]
    seen: list[tuple[int, int]]
    witness: Witness
    shaken: list[tuple[int, int]]
    shaking: Vibration | None
    found: dict[str, Judged]

    @property
    def all(self) -> list[FollowerData]:
        """Channels of all drives."""
        return list(self.data.values())

    def still(self, spans: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
        """Those of some samples [start, stop) in which an inertial unit shows that the machine stands."""
        return [span for span in spans if self.shaking is not None and self.shaking.stands(*span)]


class Scene(NamedTuple):
    """What is known of the drives that are judged.

    Attributes
    ----------
    judged : dict[str, Judged]
        Each with the probabilities of its states and its spells.
    mates : dict[str, tuple[str, ...]]
        Other wheels of each one's side.
    bodies : Bodies
        What else tells how the machine moves.
    efforts : dict[str, Array], each of shape (b,)
        Efforts in blocks, of those that have any.
    idle_spans : Mapping[str, list[tuple[int, int]]]
        Blocks in which a drive pulls nothing while others pull.
    beside, by_motion : Mapping[str, Beside]
        Views of each wheel's speed by all other channels, and by those of the ground and the body alone.
    notes : tuple[str, ...]
        What was left out of the views, and why.
    sideways : bool
        Whether the machine also goes sideways.
    exchanged : bool
        Whether sides seem exchanged.
    """

    judged: dict[str, Judged]
    mates: dict[str, tuple[str, ...]]
    bodies: Bodies
    efforts: dict[str, Array]
    idle_spans: Mapping[str, list[tuple[int, int]]]
    beside: Mapping[str, Beside]
    by_motion: Mapping[str, Beside]
    notes: tuple[str, ...]
    sideways: bool
    exchanged: bool


def drives_of(data: Mapping[str, FollowerData], given: Given) -> Drives:
    """Which drives answer their commands, and where all of them stand; `data` by wheel."""
    dt, width, limits, geometry = given.dt, given.width, given.limits, given.geometry
    widths = cell_of(dt), width
    data = without_gains(data, scales := scaled_channels(data, dt))
    by_position = shares_by_positions(data, dt)
    data = {w: replace(d, joint_share=by_position.get(w)) for w, d in data.items()}
    left_out = standing(data, limits.driving_speed, dt)
    idle = spans_of(np.logical_or.reduce(list(left_out.values())))
    found = wheels_of(data, left_out, geometry, widths, limits, dt)
    if changed := shares_by_commands(found, width):
        data = {
            w: replace(d, share=changed.get(w, found[w].data.share if w in found else None)) for w, d in data.items()
        }
        found = wheels_of(data, left_out, geometry, widths, limits, dt)
    witness = witness_of(given.speeds, list(data.values()), width, limits, dt)
    seen = [span for span in idle if witness.saw(*span, width)]
    idle = [span for span in idle if span not in seen]
    unit = given.unit if idle or len(data) == 1 else None  # nothing else asks for it
    shaking = shaking_of(unit, list(data.values()), idle, dt)
    several = len(data) > 1  # of one the speed itself is wrong
    shaken = [
        span for span in idle if several and shaking is not None and shakes_on(span, list(data.values()), shaking, dt)
    ]
    idle = [span for span in idle if span not in shaken]
    return Drives(data, scales, left_out, idle, seen, witness, shaken, shaking, found)


def scene_of(drives: Drives, given: Given) -> Scene:
    """Hold every drive that answers to all others and to the body; `drives.found` is not empty."""
    data, found, left_out = drives.data, drives.found, drives.left_out
    dt, width, block_s, geometry = given.dt, given.width, given.block_s, given.geometry
    rest = {w: samples_of(d.y, d.fresh) for w, d in data.items() if w not in found}
    found = by_each_other(found, block_s, rest)
    holds = {w: holds_of(j.wheel.samples, given.moves, dt) for w, j in found.items()}
    lone = (
        len(data) == _PAIR and len(found) == _PAIR and turns_by_wheels(*(j.wheel.blocks.mean for j in found.values()))
    )
    found = {w: j._replace(wheel=j.wheel._replace(lone=lone)) for w, j in with_habits(found, holds).items()}
    means, turned_by = (
        {w: j.wheel.blocks.mean for w, j in found.items()},
        None if given.yaw is None else cells(given.yaw, width),
    )
    rollers = any(d.commands.shape[1] > BODY_COMMANDS for d in data.values())
    sideways = rollers or goes_sideways(means, geometry, block_s)
    exchanged = sideways and not rollers and crossed(means, geometry, turned_by)
    stretch = next(iter(data.values())).stretch if len(data) == 1 else None
    bodies = Bodies(given.speeds, turned_by, block_s, sideways, None if stretch is None else cells(stretch, width))
    efforts = {  # what stands with the machine pulls nothing, and one noise is by chance less than another
        w: cells(np.where(left_out[w], np.nan, j.data.effort), width)
        for w, j in found.items()
        if j.data.effort is not None and not sideways
    }
    mates = {w: tuple(o for o in found if o != w and same_side(w, o, geometry)) for w in found}
    efforts, none = powered(efforts)
    beside_it = {w: tuple(o for o in mates[w] if o in efforts) or tuple(o for o in found if o != w) for w in found}
    pulls, spans = shares_of(found, efforts, beside_it), idle_spans(efforts, found, beside_it, block_s)
    found = {
        w: j._replace(
            yaw=given.yaw, rolls=w in none, wheel=j.wheel._replace(pull=own_pull(j, efforts.get(w), pulls.get(w)))
        )
        for w, j in found.items()
    }
    names = {w: j.data.name for w, j in found.items()}
    usual = {w: as_usual(j.wheel.blocks.mean, j.data.share, width) for w, j in found.items()}
    beside, by_motion, left_notes = views(names, {w: j.wheel.blocks for w, j in found.items()}, geometry, bodies, usual)
    judged = by_leaps({w: judge(j, beside.get(w), dt, width) for w, j in found.items()}, mates)
    return Scene(judged, mates, bodies, efforts, spans, beside, by_motion, tuple(left_notes), sideways, exchanged)
