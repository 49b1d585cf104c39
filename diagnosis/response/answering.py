"""Wheels whose answer to their commands is found, or that others can stand for, with their readings in blocks; nothing is judged yet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.standstill import STILL
from diagnosis.response.channel import Samples, samples_of, without_holds
from diagnosis.response.drive import as_a_peer
from diagnosis.response.identification import Response, identify_response, without_command
from diagnosis.response.inputs import FollowerData, cells
from diagnosis.response.jumps import jumps_of
from diagnosis.response.machine import Judged
from diagnosis.response.mirrored import mirrored
from diagnosis.response.models import STATES, blocks_of
from diagnosis.response.wheel import Wheel
from replay.machine.config import Limits
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

MOVES = 0.4  # of the driving speed: enough to see whether a channel lives
_TURNS_S = 5.0
_MOSTLY = 0.5  # of that time
_LEAST_OTHERS = 2  # wheels that answer, beside one that does not
BODY_COMMANDS = 2  # speed and yaw rate


def wheels_of(
    data: Mapping[str, FollowerData],
    hidden: Mapping[str, Flags],
    geometry: Geometry | None,
    steps: tuple[int, int],
    limits: Limits,
    dt: float,
) -> dict[str, Judged]:
    """Wheels whose response could be found, with their blocks; nothing is judged yet.

    Parameters
    ----------
    data : Mapping[str, FollowerData]
        All drives, by wheel.
    hidden : Mapping[str, Flags], each of shape (n,)
        Steps of each that are not looked at.
    geometry : Geometry or None
        Says which wheels are on one side.
    steps : tuple[int, int]
        In a cell and in a block.
    limits : Limits
        ``driving_speed``.
    dt : float
        Step [s].
    """
    cell, _ = steps
    out: dict[str, Judged] = {}
    channels: dict[str, tuple[Samples, Response | None]] = {}
    shares: dict[str, Array | None] = {}
    for w, d in data.items():
        y = np.where(hidden[w], np.nan, d.y)
        samples = samples_of(y, d.fresh)
        y[samples.step[samples.wild]] = np.nan
        response, share = _response(y, samples, d, cell, limits, dt)
        channels[w], shares[w] = (samples, response), share
    answers = {w: found for w, (_, found) in channels.items() if found is not None}
    answers, doubts = mirrored(data, answers, geometry, cell, dt)
    several = len(answers) >= _LEAST_OTHERS
    for w, d in data.items():
        y, samples, found = d.y, channels[w][0], answers.get(w)
        # of two wheels the other one shows what a command makes; so do several of one that stands nearly always, as nothing else then does
        if found is None and (not several or _silent(d, limits, dt)):
            found = as_a_peer(w, d.commands, answers, geometry, cell * dt)
        # wheels of one body, that is: joints which are each commanded by themselves have nothing to do with each other
        of_a_body = d.commands.shape[1] >= BODY_COMMANDS or geometry is not None
        ignored = not answers and len(data) > 1 and of_a_body and _turns(y, limits, dt)
        if found is None and not several and not ignored and np.isfinite(d.commands).any():
            continue
        # a wheel that makes nothing of its command, alone or as all do, is judged by the others, and by its channel
        response = without_command(-(-y.size // cell)) if found is None else found
        others = tuple(o.y for k, o in data.items() if k != w)
        seen = np.where(hidden[w], np.nan, y), samples
        d = replace(d, share=shares[w])
        out[w] = in_blocks(d, response, seen, others, steps, limits, dt)._replace(odd=doubts.get(w, ""))
    return out


def in_blocks(
    data: FollowerData,
    response: Response,
    seen: tuple[Array, Samples],
    others: tuple[Array, ...],
    steps: tuple[int, int],
    limits: Limits,
    dt: float,
) -> Judged:
    """A wheel's readings in blocks, and when it drives; nothing is judged yet.

    Parameters
    ----------
    data : FollowerData
        The wheel.
    response : Response
        How it answers its command.
    seen : tuple[Array, Samples]
        Readings that are looked at, shape (n,) [m/s], and their samples.
    others : tuple[Array, ...], each of shape (n,)
        Readings of all other wheels [m/s].
    steps : tuple[int, int]
        In a cell and in a block.
    limits : Limits
        ``driving_speed``.
    dt : float
        Step [s].
    """
    (y, samples), (cell, width) = seen, steps
    if response.answered and samples.wild.any():
        samples = samples_of(y, data.fresh, response.reach(data.commands, cell, dt, y.size))
    blocks = blocks_of(samples, response, cell, width, y.size)
    moves = np.abs(np.nan_to_num(blocks.mean))
    if response.answered:
        moves = np.maximum(np.maximum(np.abs(blocks.low), np.abs(blocks.high)), moves)
    driving = moves > MOVES * limits.driving_speed
    jumps, calm = jumps_of(samples, blocks, width, dt)
    wheel = Wheel(data.name, samples, blocks, jumps, dt, "")
    start = np.zeros((0, STATES))
    return Judged(data, response, wheel, driving, start, [], None, calm, alone=not others, others=others)


def _silent(data: FollowerData, limits: Limits, dt: float) -> bool:
    """Whether a wheel reads nothing in most of the time in which it is told to go."""
    asked = np.isfinite(data.y) & (np.abs(np.nan_to_num(data.asked)) > limits.driving_speed)
    return bool(
        np.count_nonzero(asked) * dt >= _TURNS_S
        and np.mean(np.abs(data.y[asked]) <= STILL * limits.driving_speed) > _MOSTLY
    )


def _turns(y: Array, limits: Limits, dt: float) -> bool:
    """Whether a wheel turns for long enough to show how its channel reads."""
    return bool(np.count_nonzero(np.abs(np.nan_to_num(y)) > limits.driving_speed) * dt >= _TURNS_S)


def _response(
    y: Array, samples: Samples, data: FollowerData, cell: int, limits: Limits, dt: float
) -> tuple[Response | None, Array | None]:
    """Response of a drive, and the share of usual readings that it goes with; a speed that is held for long says nothing of it, unless hardly any other is left."""
    shares = [data.share] if data.share is not None or data.joint_share is None else [None, data.joint_share]
    found = [(_answer(y if s is None else y / s, samples, data, cell, limits, dt), s) for s in shares]
    known = [(r, s) for r, s in found if r is not None]
    if not known:
        return None, data.share
    return min(known, key=lambda x: _misfit(y if x[1] is None else y / x[1], x[0], cell))


def _answer(y: Array, samples: Samples, data: FollowerData, cell: int, limits: Limits, dt: float) -> Response | None:
    for source in (without_holds(y, samples, dt), y):
        found = identify_response(cells(source, cell), data.commands, cell * dt, limits.driving_speed)
        if found is not None:
            return found
    return None


def _misfit(y: Array, found: Response, cell: int) -> float:
    """Mean of what readings are off, beside what is expected [1]."""
    off = np.abs(cells(y, cell) - found.expected)
    known = np.isfinite(off)
    return float(np.mean(off[known]) / max(float(np.mean(np.abs(found.expected[known]))), 1e-12))
