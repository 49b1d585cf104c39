"""Drives that do something else than their commands while the measured motion of the body shows that their sensors are right.

A drive without power is dragged along, a weak one lags behind: either way its wheel turns as the ground passes under it, which the yaw
rate beside the wheels of the other side, or a sensor of the body, shows as well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.as_told import in_share, with_another
from diagnosis.response.beside import same_side
from diagnosis.response.body_limits import at_body_limit
from diagnosis.response.ground import dragged
from diagnosis.response.identification import Response, as_another
from diagnosis.response.inputs import cells
from diagnosis.response.jumps import falls_dead
from diagnosis.response.machine import Judged, unlike_others
from diagnosis.response.models import Beside, Blocks
from diagnosis.response.spells import spans_of
from diagnosis.results.assessment import Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import lasting
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_OUTSIDE, _MOST, _SHOWN = 40, 0.75, 0.08  # blocks; of them; of the top speed
_ASTRAY, _ASTRAY_S, _NEAR_S = 0.2, 1.0, 10.0  # of the top speed: all drives that far off, for so long, around a finding
_ASTRAY_SHARE = 0.1  # of a finding: less is what its own beginning and end do to the others
_MOVES = 0.05  # of the top speed
_BODY_COMMANDS = 2  # speed and yaw rate
_NOISIER = 3.0  # times the usual misfit of the other drives: more is no habit of one
_FAR, _OFF_OF_TOP = 3.0, 0.06  # usual misfits beside the command, and share of the top speed, that are no answer to it
_AGREES = 2.5  # usual misfits beside the other view
_CLOSER = (
    0.5  # of the misfit beside the command: so much less is that beside the other view, and that of the other wheels
)
_GAP_S, _LEAST_S = 0.75, 2.0
_GAP_BLOCKS, _TWICE = 3, 2  # blocks near its command that a time off it may have; times that are a habit
_MUCH_S = 0.4, 0.8, 1.6  # of the top speed, missing for as long
_DRAGGED = 4.0  # the same, where the other side holds it back, or drags it along, as it does elsewhere
_HABIT = 2.0  # times what other drives miss of their commands now and then: as much is a load, or the ground
_P = 0.8, 0.9, 0.95  # that the drive is at fault, by how much is missing
_ALONE_P = 0.6  # that a single drive is at fault, not its commands
_STANDS, _FULL = 0.1, 0.9  # of what the command makes it do
_PAIR = 2  # wheels, of which each turns the body alone
_ANSWER_S = 1.0  # within which a drive answers
_MOST_OF, _STAYS = (
    (0.1, 0.9),
    0.3,
)  # quantiles of a speed and of its command; of the change of the latter, that is none of the former
_STEADY = 0.25  # spread of a speed that does not follow its command, by its size


def by_peers(wheel: str, judged: Mapping[str, Judged], geometry: Geometry | None, cell: int) -> Blocks | None:
    """Blocks of a wheel with what is expected of it: by its own answer, or by another's where it makes nothing, or much less, of its commands.

    None where neither is known.

    Parameters
    ----------
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    geometry : Geometry or None
        Says which wheels are on one side.
    cell : int
        Steps of a cell.
    """
    one = judged[wheel]
    blocks, commands, answered = one.wheel.blocks, one.data.commands, one.response.answered
    others = {w: j for w, j in judged.items() if w != wheel and j.response.answered}
    if answered and wheel not in unlike_others(judged):
        if others:  # a fault of long makes its own misfit look usual
            usual = np.median([j.wheel.blocks.noise for j in others.values()], axis=0)
            blocks = blocks._replace(noise=np.minimum(blocks.noise, _NOISIER * usual))
        return blocks
    answer = as_a_peer(wheel, commands, {w: j.response for w, j in others.items()}, geometry, cell * one.wheel.dt)
    if answer is None or blocks.start.size < 2:
        return None
    at = np.minimum((blocks.start + int(blocks.start[1]) // 2) // cell, answer.low.size - 1)
    return blocks._replace(low=answer.low[at], high=answer.high[at], noise=answer.noise[at])


def as_a_peer(
    wheel: str, commands: Array, answers: Mapping[str, Response], geometry: Geometry | None, h: float
) -> Response | None:
    """What a wheel would make of its commands if it answered as another one does; None where that cannot be told.

    Parameters
    ----------
    wheel : str
        The wheel.
    commands : Array, shape (cells, k)
        As for `identify_response`.
    answers : Mapping[str, Response]
        Of other wheels.
    geometry : Geometry or None
        Says which wheels are on one side.
    h : float
        Length of a cell [s].
    """
    number = commands.shape[1]
    if not np.isfinite(commands).any() or number > _BODY_COMMANDS or (number == _BODY_COMMANDS and geometry is None):
        return None
    for other, response in answers.items():
        if response.weights.size == number:
            share = np.ones(number)
            if number == _BODY_COMMANDS:
                share[1] = 1.0 if same_side(wheel, other, geometry) else -1.0
            return as_another(response, commands, share, h)
    return None


def unanswered(
    wheel: str, judged: Mapping[str, Judged], known: tuple[Blocks | None, Beside | None], block_s: float
) -> list[Finding]:
    """Times in which a drive did not answer its command, by a sensor that the motion of the body confirms.

    A wheel of the same side confirms nothing: it is pulled along by the ground, and skids.

    Parameters
    ----------
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    known : tuple[Blocks or None, Beside or None]
        Its blocks with what is expected of it, and how the ground passes under it.
    block_s : float
        Length of a block [s].
    """
    one, (blocks, view) = judged[wheel], known
    if view is None or blocks is None or not view.speed.size:
        return []
    off = np.nan_to_num(_off(blocks))
    others = [np.nan_to_num(_off(j.wheel.blocks)) for w, j in judged.items() if w != wheel]
    beside = np.nan_to_num(np.abs(blocks.mean - view.speed), nan=np.inf)
    top = float(np.nanquantile(np.abs(np.r_[blocks.low, blocks.high]), 0.95))
    there = off > np.maximum(_FAR * blocks.noise, _OFF_OF_TOP * top)
    habit = _habit(there, off, [j.wheel.blocks for w, j in judged.items() if w != wheel], top)
    there &= (beside < _AGREES * np.nan_to_num(view.noise)) & (beside < _CLOSER * off)
    there &= np.logical_and.reduce([x < _CLOSER * off for x in others]) if others else True
    there &= off_asked(one, block_s) > _CLOSER * off
    there &= ~_eager(one, blocks)
    there &= ~with_another(one, [j for w, j in judged.items() if w != wheel], off, top)
    limit = at_body_limit(judged, block_s)
    there &= True if limit is None else ~limit
    # where all wheels stand the machine stands, and one of them is no worse than the others
    there &= np.nanmax([np.abs(np.nan_to_num(j.wheel.blocks.mean)) for j in judged.values()], axis=0) > _MOVES * top
    # where all of them do something else their commands are ignored, or held, and each may meet its own by chance
    all_off = np.logical_and.reduce([x > _ASTRAY * top for x in (off, *others)]) & bool(others)
    reach = round(_NEAR_S / block_s)
    least = _MUCH_S[one.alone]
    found = []
    for start, stop in spans_of(there, round(_GAP_S / block_s)):
        astray = np.count_nonzero(all_off[max(0, start - reach) : stop + reach])
        if astray * block_s >= _ASTRAY_S and astray > _ASTRAY_SHARE * (stop - start):
            continue
        if others and all(_held(j.wheel.blocks, slice(start, stop)) for j in judged.values()):
            continue
        much = float(np.sum(off[start:stop][there[start:stop]])) * block_s / top
        held = dragged(slice(start, stop), wheel, judged, 0.0)
        if much < (_DRAGGED if held else _HABIT) * habit * block_s:
            continue
        long = (stop - start) * block_s >= _LEAST_S and np.mean(there[start:stop]) > 0.5 and much > least
        if long and _proven(one, beside / top, slice(max(0, start - reach // 2), stop + reach // 2)):
            found.append(_finding(one, blocks, view, (start, stop), much, block_s, alike=len(judged) > _PAIR))
    return found


def _habit(astray: Flags, off: Array, others: Sequence[Blocks], top: float) -> float:
    """What other drives miss of their commands more than once, over the time that it is missing and by the top speed [blocks].

    Sides drag each other along, and turn each other back. Times in which the wheel itself misses more are left out: these are its doing.

    `astray`, `off` of shape (b,): where the wheel in question is off its command, and how far [m/s]; `top` in m/s.
    """
    own = [(a, b, float(np.sum(off[a:b]))) for a, b in spans_of(astray, _GAP_BLOCKS)]
    least = 0.0
    for blocks in others:
        away = np.nan_to_num(_off(blocks))
        spans = spans_of(away > np.maximum(_FAR * blocks.noise, _OFF_OF_TOP * top), _GAP_BLOCKS)
        missed = [(a, b, float(np.sum(away[a:b]))) for a, b in spans]
        alone = [m for a, b, m in missed if not any(c < b and a < d and much > m for c, d, much in own)]
        least = max([least, *sorted(alone)[-_TWICE:][:1]]) if len(alone) >= _TWICE else least
    return least / top


def _proven(one: Judged, apart: Array, around: slice) -> bool:
    """Whether the motion of the body shows the wheel's speed at other times, too: else it was found in the fault itself.

    `apart`, shape (b,), is the distance between the two by the top speed; `around` are the blocks of the fault and near it.
    """
    outside = one.driving & np.isfinite(apart)
    outside[around] = False
    return bool(np.count_nonzero(outside) >= _LEAST_OUTSIDE and np.quantile(apart[outside], _MOST) < _SHOWN)


def _held(blocks: Blocks, part: slice) -> bool:
    """Whether a speed stays where it is for most of a time in which its command changes: where all do, commands are held, or ignored."""
    y, low, high = (x[part] for x in (blocks.mean, blocks.low, blocks.high))
    known = np.isfinite(y) & np.isfinite(low) & np.isfinite(high)
    if not known.any():
        return False
    y, told = y[known], 0.5 * (low[known] + high[known])
    moved, asked = (float(np.ptp(np.quantile(x, _MOST_OF))) for x in (y, told))
    return bool(asked > _FAR * float(np.median(blocks.noise[part])) and moved < _STAYS * asked)


def _off(blocks: Blocks) -> Array:
    return np.abs(blocks.mean - np.clip(blocks.mean, blocks.low, blocks.high))


def off_asked(one: Judged, block_s: float) -> Array:
    """How far each block is from what is asked of the wheel [m/s], shape (b,), whatever the drive makes of it in most of the mission.

    `block_s` is the length of a block [s]; infinite where the distance is not known.
    """
    blocks = one.wheel.blocks
    asked = cells(one.data.asked, int(blocks.start[1]) if blocks.start.size > 1 else 1)
    back = round(_ANSWER_S / block_s)
    recent = [np.r_[np.full(k, np.nan), asked[: asked.size - k]] for k in range(back + 1)]
    low, high = (pick.reduce(recent) for pick in (np.fmin, np.fmax))
    return np.nan_to_num(np.abs(blocks.mean - np.clip(blocks.mean, low, high)), nan=np.inf)


def _eager(one: Judged, blocks: Blocks) -> Flags:
    """Blocks in which a drive is nearer to what it is asked for than its usual limit lets it be: it has less of a load."""
    asked = cells(one.data.asked, int(blocks.start[1]) if blocks.start.size > 1 else 1)
    low, high = np.fmin(blocks.low, asked), np.fmax(blocks.high, asked)
    return np.asarray((blocks.mean >= low) & (blocks.mean <= high))


_AT_ONCE = (
    "It fell to 0 from one reading to the next, as a dead sensor's does and that of a drive without power does not, yet the body moves as if the "
    "reading were right: which of both fails is open."
)


def _finding(
    one: Judged, blocks: Blocks, view: Beside, span: tuple[int, int], much: float, block_s: float, *, alike: bool
) -> Finding:
    """One finding in blocks `span`; `much`: what is missing over its time, by the top speed [s]; `alike`: more than two wheels."""
    start, stop = span
    part = slice(start, stop)
    width = int(blocks.start[1]) if blocks.start.size > 1 else 1
    y, asked = np.nan_to_num(blocks.mean[part]), 0.5 * (blocks.low[part] + blocks.high[part])
    power = float(asked @ asked)
    gain = float(y @ asked) / power if power > 0.0 else np.inf
    size = float(np.median(np.abs(y)))
    steady = float(np.std(y)) < _STEADY * size
    held = steady and np.ptp(np.quantile(asked, _MOST_OF)) > size and not in_share(y, asked, gain)
    mode = (
        FaultMode.NO_SIGNAL if abs(gain) < _STANDS and size < _STANDS * float(np.max(np.abs(asked)))
        else FaultMode.INEFFICIENT if _STANDS <= gain < _FULL and not held
        else FaultMode.STUCK if steady else FaultMode.OUTSIDE_TABLE
    )  # fmt: skip
    epsilon = {
        FaultMode.INEFFICIENT: Epsilon(1.0 - gain, max(0.9 - gain, 0.0), min(1.1 - gain, 1.0)),
        FaultMode.NO_SIGNAL: Epsilon(1.0, 1.0, 1.0),
        FaultMode.STUCK: Epsilon(1.0, 1.0, 1.0),
    }.get(mode)
    p = _ALONE_P if one.alone else _P[sum(much > least for least in _MUCH_S) - 1]
    texts: tuple[str, ...] = (
        f"{one.data.name} is {plain(round(size, 6), 2)} {{speed_unit}} (median) for {lasting((stop - start) * block_s, 1)}, where its command makes it "
        f"{plain(float(np.median(np.abs(asked))), 2)} {{speed_unit}} otherwise.",
        f"{view.compared} and the measured motion of the body show the same speed as the sensor, so that the sensor is right and the "
        "{valve} does not do what it is told.",
    )
    if one.alone:
        texts += (
            "With a single drive, one that does not answer and commands that are ignored cannot be distinguished.",
        )
    side, other = Side.ACTUATOR, 0.5 * (1.0 - p)
    if alike and mode is FaultMode.NO_SIGNAL and falls_dead(one.wheel.samples, start * width, one.wheel.dt):
        side, other, texts = Side.SENSOR_OR_ACTUATOR, 0.0, (texts[0], _AT_ONCE)
    hypotheses = (
        Hypothesis(side.value, mode.value, p),
        Hypothesis(Side.SENSOR.value, mode.value, other),
        Hypothesis("none", State.HEALTHY.value, 1.0 - p - other),
    )
    return Finding(
        start=start * width, stop=min(stop * width, one.data.y.size), side=side, mode=mode, probability=p,
        hypotheses=tuple(h for h in hypotheses if h.p > 0.0),
        epsilon=epsilon, sat=None, evidence=texts, tier=Tier.RESPONSE,
    )  # fmt: skip
