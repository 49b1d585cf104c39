"""Speed per opening of each wheel beside the other wheels', and the limits that an all-clear sets to it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import alone, lowest_passed

_LAG_S = 0.15  # of a valve and its drive
_SETTLED_S, _SETTLED = 0.6, 0.03  # a command that has changed by less than this [m/s] over this time
USUAL_TOP = 0.36  # m/s, of the machine for which speeds here are
MOVING = 0.08  # m/s, for such a machine
_LEAST_CELLS = 0.5  # of a window
_USUAL_S = 3.0  # of one way, from which on there is a usual one
_LEAST_WINDOWS, _PART = 8, 0.2  # before and after a change, at least
_GROWS = 40  # windows, for what grows
_ALIKE = 0.5  # of the limit: where half of the wheels deviate by more, openings tell little of speeds
#: Of the power of a speed, what its opening explains: on tuning machines 0.91 and more of a healthy valve's and 0.69 and less of a
#: torque's, and 0.56 and more of valves with wide dead bands.
_SURELY, _FOLLOWS = 0.8, 0.45
_CHANGED = 0.88  # a change counts by its limit in windows, not over the mission
#: A deviation counts from this on, whatever the other wheels do [ln]: tyres hide most of a valve's loss, which is all that
#: shows of it where neither side is measured twice.
_LEAST_SEEN, _LEAST_SEEN_TWICE = 0.06, 0.1
#: The same where both sides are measured twice, in windows and of a change: what is left to be seen is what lies behind the drive.
_LEAST_BEHIND, _LEAST_CHANGED_BEHIND = 0.288, 0.16
_LEAST_LASTING = 0.13  # the same over the mission, of what is measured twice on either side
#: A deviation counts from so many times the largest of the other wheels' on, a change likewise.
_ALONE, _CHANGED_ALONE = 3.0, 2.2
OTHERS = 2
#: Limits of speed per opening below and above the other wheels', in windows and over the mission, as multiples of the loss
#: that counts, by whether opening and speed are measured twice. What measurements judge need not be judged by its likeness to
#: others as strictly, but what lies behind a drive neither of them judges; what reads too much is in no row of the tables, so that
#: nothing else would tell it.
RESPONSE = {
    (False, False): ((0.75, 0.65), (0.9, 0.7)),
    (True, False): ((1.4, 1.15), (1.25, 0.95)),
    (False, True): ((1.15, 1.0), (1.4, 1.2)),
    (True, True): ((1.4, 1.15), (2.0, 1.4)),
}


class Usual(NamedTuple):
    """By how much a wheel's usual speed per opening is below and above the other wheels'; None where it is not known.

    `least` and `most` are the lower and the higher one of forward and reverse, signed [ln], `ways` both.
    """

    below: float | None = None
    above: float | None = None
    least: float | None = None
    most: float | None = None
    ways: tuple[float | None, float | None] = (None, None)


class Responses(NamedTuple):
    """ln of speed per opening over that of the other wheels.

    Attributes
    ----------
    windows : Array, shape (windows, wheels)
        Against the wheel's usual one.
    beside : Array, shape (windows, wheels)
        As they are.
    usual : list[Usual]
        The usual ones.
    weight : Array, shape (cells, wheels)
        Speed that counts in a window, 0 where none does [m/s].
    ahead : NDArray[np.bool_], shape (windows, wheels)
        Windows whose usual one is that of driving forward.
    changes, grown : list[float | None]
        By how much each wheel's usual one changes in the mission at most, and over half of it at its usual pace; None where it is not
        known.
    """

    windows: Array
    beside: Array
    usual: list[Usual]
    weight: Array
    ahead: NDArray[np.bool_]
    changes: list[float | None]
    grown: list[float | None]


def responses_of(
    cells: Cells, speed: Array, opening: Array, reference: Array, moving: float = MOVING, *, over_time: bool = True
) -> Responses:
    """Speed per opening beside the other wheels', arrays (cells, wheels).

    Only where a command (without one: the wheel) has settled beyond `moving` [m/s, for a machine of `USUAL_TOP`]; forward and reverse
    have usual ones of their own. Without `over_time` it is not asked how they change in the mission: `changes` and `grown` are None.
    """
    frame = cells.frame
    scale = cells.machine.max_speed / USUAL_TOP
    known = np.isfinite(reference)
    motion = np.where(known, reference, speed)
    back = max(1, round(_SETTLED_S / cells.dt))
    before = np.concatenate([np.full((min(back, len(motion)), motion.shape[1]), np.nan), motion[:-back]])
    with np.errstate(invalid="ignore"):
        settled = (np.abs(motion) > moving * scale) & (np.abs(motion - before) < _SETTLED * scale)
    settled &= np.isfinite(speed) & np.isfinite(opening)
    passed = lowest_passed(opening, cells.dt, _LAG_S)
    moved, opened = (frame.sums(np.where(settled, np.abs(x), 0.0)) for x in (speed, passed))
    enough = frame.sums(settled.astype(np.float64)) >= _LEAST_CELLS * min(frame.length, frame.cells)
    ratio = np.where(enough, moved / np.maximum(opened, 1e-3 * frame.length), np.nan)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        log = np.log(np.maximum(ratio, 1e-3) / others_at(ratio))
    ahead = frame.mean(np.sign(np.nan_to_num(motion))) >= 0.0
    off = np.full(log.shape, np.nan)
    lasting: list[Usual] = []
    changes: list[float | None] = []
    grown: list[float | None] = []
    for i, wheel in enumerate(cells.machine.wheels):
        ways_apart = [ahead[:, i], ~ahead[:, i]]
        own = np.where(cells.explained(wheel), np.nan, log[:, i])  # a stated fault is not what is usual
        if np.count_nonzero(np.isfinite(own)) < _LEAST_WINDOWS:  # it is nearly all that there is
            own = log[:, i]
        usual: list[float] = []
        ways: list[float | None] = []
        for way in ways_apart:
            here = way & np.isfinite(own)
            lasts = np.count_nonzero(here) * frame.hop * cells.dt >= _USUAL_S
            ways.append(float(np.median(own[here])) if lasts else None)
        for k, middle in enumerate(ways):
            here = ways_apart[k] & np.isfinite(own)
            usual += [] if middle is None else [middle]
            if here.any():  # what is too short to be usual is held to the other way's usual one: it may be all fault
                either = [x for x in (middle, ways[1 - k]) if x is not None]
                expected = either[0] if either else float(np.median(own[here]))
                off[ways_apart[k], i] = log[ways_apart[k], i] - expected
        asked = over_time and bool(usual)
        changes.append(largest_change(own, ways_apart) if asked else None)
        grown.append(growth(own, ways_apart) if asked else None)
        lasting.append(
            Usual(max(0.0, -min(usual)), max(0.0, *usual), min(usual), max(usual), (ways[0], ways[1]))
            if usual
            else Usual()
        )
    return Responses(off, log, lasting, np.where(settled, np.abs(speed), 0.0), ahead, changes, grown)


def largest_change(log: Array, ways: Sequence[NDArray[np.bool_]]) -> float:
    """Largest difference between the medians before and after any moment, of each of some sorts of windows alone [ln]; shape (windows,).

    A loss that lasts about half of the mission is half of what is usual.
    """
    largest = 0.0
    for way in ways:
        x = log[way & np.isfinite(log)]
        least = max(_LEAST_WINDOWS, round(_PART * x.size))
        for k in range(least, x.size - least + 1, max(1, x.size // 40)):
            largest = max(largest, abs(_median(x[:k]) - _median(x[k:])))
    return float(largest)


def growth(log: Array, ways: Sequence[NDArray[np.bool_]]) -> float:
    """Change over half of the mission at the median pace between windows a third to two thirds apart, of each sort alone [ln]; shape (windows,).

    By as much halves differ of what grows all the time; what merely comes and goes has no pace, and is not in the way.
    """
    largest = 0.0
    for way in ways:
        at = np.flatnonzero(way & np.isfinite(log))
        n = at.size
        if n < _GROWS:
            continue
        apart = [(at[:-k], at[k:]) for k in range(n // 3, 2 * n // 3 + 1, max(1, n // 24))]
        pace = _median(np.concatenate([(log[b] - log[a]) / (b - a) for a, b in apart]))
        largest = max(largest, 0.5 * abs(pace) * float(at[-1] - at[0]))
    return largest


def _median(x: Array) -> float:
    """Median of finite values; `np.median` looks for NaN and axes first, which takes most of its time here."""
    half = x.size // 2
    if x.size % 2:
        return float(np.partition(x, half)[half])
    low, high = np.partition(x, [half - 1, half])[half - 1 : half + 1]
    return float((low + high) / 2.0)


class Limits(NamedTuple):
    """Limits of a wheel's speed per opening [ln]: in windows below and above, of a change, of one that grows, and over the mission."""

    below: float
    above: float
    changed: float
    grown: float
    lasting_below: float
    lasting_above: float


def measured_twice(cells: Cells) -> list[tuple[bool, bool]]:
    """Whether the opening, and the speed, of each wheel are measured twice."""
    command, opening, second = (
        [bool(np.isfinite(x).any()) for x in cells.wheels(leaf).T] for leaf in ("u", "u_applied", "v_true")
    )
    return [(a and u, x) for u, a, x in zip(command, opening, second, strict=True)]


def usual_limits(twice: tuple[bool, bool], clear_at: float) -> Limits:
    """Limits of a wheel whatever the other wheels do; `twice` as of `measured_twice`, `clear_at` the loss that counts [1]."""
    share = -float(np.log1p(-clear_at))
    (below, lasting_below), (above, lasting_above) = RESPONSE[twice]
    changed = lasting_below / _CHANGED
    return Limits(*(share * x for x in (below, above, changed, changed, lasting_below, lasting_above)))


def response_limits(
    responses: Responses, twice: Sequence[tuple[bool, bool]], clear_at: float, carried: Sequence[float] | None = None
) -> list[Limits]:
    """Limits of every wheel [ln], lower where the other wheels deviate by much less.

    Arguments as of `usual_limits`; `carried` is the share of its speed that the ground gives each wheel [1], none by default. What is usual of a
    wheel that is measured once may be below the others' by no more than the loss that counts leaves to be seen beside the ground, or above by
    no more than such an excess does.
    """
    return [
        limit
        if any(both)
        else limit._replace(
            lasting_below=min(limit.lasting_below, _seen(clear_at, held)),
            lasting_above=min(limit.lasting_above, float(np.log1p(clear_at * (1.0 - held)))),
        )
        for limit, both, held in zip(
            _beside_others(responses, twice, clear_at), twice, carried or [0.0] * len(twice), strict=True
        )
    ]


def _seen(clear_at: float, carried: float) -> float:
    """By how much a wheel's speed falls by a loss of its valve while the ground gives it a share of it [ln]."""
    return -float(np.log1p(-clear_at * (1.0 - carried)))


def _beside_others(responses: Responses, twice: Sequence[tuple[bool, bool]], clear_at: float) -> list[Limits]:
    most = [[float(x) for x in largest(sign * responses.windows)] for sign in (-1.0, 1.0)]
    below = [usual.below for usual in responses.usual]
    out = []
    for i, both in enumerate(twice):
        limit = usual_limits(both, clear_at)
        seen = _LEAST_BEHIND if all(both) else _LEAST_SEEN_TWICE if any(both) else _LEAST_SEEN
        changed = _LEAST_CHANGED_BEHIND if all(both) else seen
        limit = limit._replace(
            below=alone(most[0], i, limit.below, seen, _ALONE),
            changed=alone(responses.changes, i, limit.changed, changed, _CHANGED_ALONE),
            grown=alone(responses.grown, i, limit.grown, changed, _CHANGED_ALONE),
        )
        if not all(both):
            limit = limit._replace(above=alone(most[1], i, limit.above, seen, _ALONE))
        if any(both):
            lasting = alone(below, i, limit.lasting_below, _LEAST_LASTING, _ALONE)
            limit = limit._replace(lasting_below=lasting)
        out.append(limit)
    return out


def largest(windows: Array) -> Array:
    """Largest value of each wheel; NaN where none is known. From shape (windows, wheels) to (wheels,)."""
    most = np.max(np.where(np.isfinite(windows), windows, -np.inf), axis=0, initial=-np.inf)
    return np.where(np.isfinite(most), np.maximum(most, 0.0), np.nan)


def speeds_follow_openings(cells: Cells) -> bool:
    """Whether any wheel's speed is a multiple of its opening, as a valve's is and a torque's is not."""
    return _explained(cells) > _FOLLOWS


def _explained(cells: Cells) -> float:
    """Share of the power of a wheel's speed that its opening explains, of the wheel of which it explains most [1]."""
    speed, command, opening = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied"))
    used = lowest_passed(np.where(np.isfinite(opening), opening, command), cells.dt, _LAG_S)
    explained = []
    for v, u in zip(speed.T, used.T, strict=True):
        moves = (
            np.isfinite(v) & np.isfinite(u) & (np.abs(np.nan_to_num(v)) > MOVING * cells.machine.max_speed / USUAL_TOP)
        )
        v, u = v[moves], u[moves]
        power = float(u @ u) * float(v @ v)
        explained.append(float(u @ v) ** 2 / power if power > 0.0 else 1.0)
    return max(explained, default=1.0)


def openings_tell(cells: Cells, responses: Responses) -> bool:
    """Whether an opening is a speed: it explains nearly all of it, or enough while most wheels stay near what is usual."""
    explained = _explained(cells)
    if explained > _SURELY:  # several faulty wheels make no torque of the openings
        return True
    limit = usual_limits((True, True), cells.machine.limits.clear_at).below
    most = largest(np.abs(responses.windows))
    known = np.sort(most[np.isfinite(most)])
    alike = not known.size or known[(known.size - 1) // 2] <= _ALIKE * limit
    return bool(alike and explained > _FOLLOWS)


def others_at(x: Array) -> Array:
    """Median of the other wheels at the same time, shape (windows, wheels)."""
    columns = range(x.shape[1])
    out = np.full(x.shape, np.nan)
    for i in columns:
        rest = x[:, [j for j in columns if j != i]]
        enough = np.isfinite(rest).sum(axis=1) >= min(OTHERS, rest.shape[1])
        out[enough, i] = np.nanmedian(rest[enough], axis=1)
    return out
