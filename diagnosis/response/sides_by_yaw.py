"""The relation between a yaw rate and the speeds of the two sides of a machine, as it is in all of a mission or a sound part of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.response.spells import Spell
from diagnosis.response.turning import Turning

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_OFF, _AROUND = 5.0, 4  # usual misfits beside the command; blocks around a wheel's fault: these are left out
_LEAST_BLOCKS = 60  # that turn
_STANDS = 12  # blocks at rest that show the constant of the gyro
_PARTS = 4  # of the mission: in one of them at least it may be sound
_KEPT, _ROUNDS = 0.6, 4
_FITS = 0.3  # misfit of the yaw rate, by its own size
_TURN, _SPEED = 0.12, 0.03  # of the yaw rate by the sides, and of the speed: what slip and load make of it
_CHANGE = 0.4  # of a change from block to block
_OTHER = 2.5  # of two sides, as in `_FACTORS`


class Sides(NamedTuple):
    """Mean speeds of both sides [m/s], yaw rate [rad/s], blocks that count; each of shape (b,)."""

    right: Array
    left: Array
    yaw: Array
    sound: Flags


class Relation(NamedTuple):
    """Yaw rate by the difference of the sides: gain [1/m], constant, and misfit [rad/s] of shape (b,)."""

    gain: float
    constant: float
    noise: Array


def sides_of(judged: Mapping[str, Judged], faults: Mapping[str, Sequence[Spell]], turning: Turning) -> Sides:
    """Both sides and the yaw rate, without what is far off its command and what is around known faults of the wheels."""
    right, left = (
        np.mean([j.wheel.blocks.mean for w, j in judged.items() if turning.sides[w] == side], axis=0)
        for side in (1.0, -1.0)
    )
    sound = np.isfinite(right) & np.isfinite(left) & np.isfinite(turning.yaw)
    for w, j in judged.items():
        b = j.wheel.blocks
        with np.errstate(invalid="ignore"):
            sound &= ~(np.abs(b.mean - np.clip(b.mean, b.low, b.high)) > _OFF * b.noise)
        for s in faults[w]:
            sound[max(0, s.start - _AROUND) : s.stop + _AROUND] = False
    return Sides(np.nan_to_num(right), np.nan_to_num(left), np.nan_to_num(turning.yaw), sound)


def relations_of(sides: Sides) -> Iterable[Relation]:
    """How the yaw rate may belong to the sides: as in all of the mission, or as in a part of it that is sound."""
    apart, turns = sides.right - sides.left, np.abs(sides.right - sides.left)
    rest = rest_of(sides)
    usual = float(np.quantile(turns[sides.sound], 0.9)) if sides.sound.any() else 0.0
    moved = np.flatnonzero(sides.sound & (turns > 0.2 * usual))
    if moved.size < _LEAST_BLOCKS:
        return
    n = apart.size
    ends = [0, *(int(x) for x in np.quantile(moved, np.arange(1, _PARTS) / _PARTS)), n]
    spans = [(0, n), *pairwise(ends), (0, ends[_PARTS // 2]), (ends[_PARTS // 2], n)]
    for first, last in spans:
        inside: Flags = np.zeros(n, np.bool_)
        inside[first:last] = True
        found = relation_in(sides, inside & sides.sound, rest)
        if found is not None:
            yield found
    yield from _two_gains(sides, rest)


def rest_of(sides: Sides) -> float | None:
    """Constant of the gyro as the machine at rest shows it [rad/s]; None where it hardly rests."""
    still = sides.sound & (sides.right == 0.0) & (sides.left == 0.0)
    return float(np.median(sides.yaw[still])) if np.count_nonzero(still) >= _STANDS else None


def _two_gains(sides: Sides, rest: float | None) -> Iterable[Relation]:
    """The relation were one side scaled all through, of either side; none where they are alike."""
    table = np.column_stack([sides.right, -sides.left, np.full(sides.yaw.size, rest is None, np.float64)])
    kept, off = sides.sound.copy(), np.abs(sides.yaw)
    weights: Array = np.zeros(3)
    for _ in range(_ROUNDS):
        weights = np.asarray(np.linalg.lstsq(table[kept], (sides.yaw - (rest or 0.0))[kept], rcond=None)[0])
        off = np.abs(sides.yaw - (rest or 0.0) - table @ weights)
        kept = sides.sound & (off <= np.quantile(off[sides.sound], _KEPT))
    by_right, by_left, constant = (float(x) for x in weights)
    if by_right * by_left <= 0.0 or not 1.0 / _OTHER < by_left / by_right < _OTHER:
        return
    usual = 1.48 * float(np.quantile(off[sides.sound], 0.5 * _KEPT))
    for gain in (by_right, by_left):
        if usual <= _FITS * float(np.std((table @ weights)[sides.sound])):
            yield Relation(gain, (rest or 0.0) + constant, _noise(sides, gain, usual))


def _noise(sides: Sides, gain: float, usual: float) -> Array:
    """Misfit of each block, with what turning, speed and changes make of it [rad/s], shape (b,)."""
    apart = sides.right - sides.left
    change = np.abs(np.gradient(apart)) + 0.3 * np.abs(np.gradient(0.5 * (sides.right + sides.left)))
    speed = np.maximum(np.abs(sides.right), np.abs(sides.left))
    return np.asarray(np.hypot(usual, abs(gain) * (_TURN * np.abs(apart) + _SPEED * speed + _CHANGE * change)))


def relation_in(sides: Sides, use: Flags, rest: float | None) -> Relation | None:
    """The relation in some blocks, of shape (b,), by most of them; `rest`: the constant [rad/s], where the machine at rest shows it."""
    apart = sides.right - sides.left
    if np.count_nonzero(use) < _LEAST_BLOCKS // 2 or not np.ptp(apart[use]) > 0.0:
        return None
    kept, gain, constant = use.copy(), 0.0, rest or 0.0
    off = np.abs(sides.yaw)
    for _ in range(_ROUNDS):
        if rest is None:
            gain, constant = (float(x) for x in np.polyfit(apart[kept], sides.yaw[kept], 1))
        else:
            power = float(apart[kept] @ apart[kept])
            gain = float(apart[kept] @ (sides.yaw - rest)[kept]) / power if power > 0.0 else 0.0
        off = np.abs(sides.yaw - constant - gain * apart)
        kept = use & (off <= np.quantile(off[use], _KEPT))
    usual = 1.48 * float(np.quantile(off[use], 0.5 * _KEPT))
    if gain == 0.0 or usual > _FITS * abs(gain) * float(np.std(apart[use])):
        return None
    return Relation(gain, constant, _noise(sides, gain, usual))
