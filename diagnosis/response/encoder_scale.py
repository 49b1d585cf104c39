"""An encoder that reads a share of its wheel's speed inside the loop that it closes: the reading stays at its command, and the wheel goes otherwise.

Neither command nor reading shows that; the yaw rate does. It leaves what the sides make of it by a share of the speed of one side, also
straight ahead, which neither a share of the yaw rate nor a constant of the gyro does. A path through these rivals says when. A tyre of
another size, a wheel that slips, and a machine that is pulled aside all the time look the same.
"""

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
_REFITS, _SAME = 3, 0.02  # of a gain, by what nothing is found wrong in
_FITS = 0.3  # misfit of the yaw rate, by its own size
_TURN, _SPEED = 0.12, 0.03  # of the yaw rate by the sides, and of the speed: what slip and load make of it
_CHANGE = 0.4  # of a change from block to block
_CAPPED = 16.0  # squared misfit of one block, in usual ones
_ALIKE = 8.0  # blocks whose misfits are one
_ENTER = 8.0  # log-odds of a change of state
_FACTORS = tuple(f for x in (1.12, 1.25, 1.43, 1.7, 2.0, 2.5) for f in (x, 1.0 / x))
_GAINS = (-1.0, 0.0, 0.3, 0.5, 0.7, 1.3, 1.7, 2.2)
_CONSTANTS = tuple(s * x for x in (0.1, 0.2, 0.35, 0.6, 1.0) for s in (1.0, -1.0))
_LEAST_FACTOR, _STATED = 1.15, 1.2  # what is told, and what is said to show: an estimate errs
_LEAST_S = 6.0  # of motion
_SURE, _TELLS = 5.0, 5.0  # log-odds against a fault of the gyro, and of the other side
_SOME = 0.15  # of the driving, in which nothing is scaled: less does not tell which of two sides is right
LENGTH_S = 20.0
_LARGEST = 3.0  # factor: one that shows from there on only is none
_OTHER = 2.5  # of two sides, as in `_FACTORS`


class Scaled(NamedTuple):
    """Blocks [start, stop) in which one side goes otherwise than it reads.

    Attributes
    ----------
    start, stop : int
        Blocks.
    side : float
        Of `Turning.sides`: the likelier one.
    factor, rival : float
        What its true speed is beside its reading [1]; the same of the other side, were it that one.
    told : bool
        Whether the other side is far less likely.
    """

    start: int
    stop: int
    side: float
    factor: float
    rival: float
    told: bool


class Sought(NamedTuple):
    """What was looked for: where it was found, and the smallest factor above 1 that would have shown for `LENGTH_S` [1]; infinite where none."""

    found: tuple[Scaled, ...] = ()
    smallest: float = np.inf


class _Sides(NamedTuple):
    """Mean speeds of both sides [m/s], yaw rate [rad/s], blocks that count; each of shape (b,)."""

    right: Array
    left: Array
    yaw: Array
    sound: Flags


class _Relation(NamedTuple):
    """Yaw rate by the difference of the sides: gain [1/m], constant, and misfit [rad/s] of shape (b,)."""

    gain: float
    constant: float
    noise: Array


def scaled_sides(
    judged: Mapping[str, Judged], faults: Mapping[str, Sequence[Spell]], turning: Turning | None, block_s: float
) -> Sought:
    """Times in which one side goes otherwise than it reads, by the yaw rate.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    faults : Mapping[str, Sequence[Spell]]
        What is known of the wheels, or may be the ground: these times are left out.
    turning : Turning or None
        How the body is turned.
    block_s : float
        Length of a block [s].
    """
    if turning is None:
        return Sought()
    sides = _sides(judged, faults, turning)
    relations = list(_relations(sides))
    if not relations:
        return Sought()
    noise = np.median([about.noise for about in relations], axis=0)  # one for all: that of a smaller gain is smaller
    ways = [_settled(sides, about._replace(noise=noise)) for about in relations]
    about, path, _ = max(ways, key=lambda x: x[2])
    moves = sides.sound & (np.maximum(np.abs(sides.right), np.abs(sides.left)) > 0.0)
    whole = np.count_nonzero(moves & (path == 0)) < _SOME * np.count_nonzero(moves)
    found = tuple(x for s in _spans(path) if (x := _scaled(sides, about, s, block_s)) is not None)
    if whole:  # the relation is as well that of the other side
        found = tuple(x._replace(rival=1.0 / x.factor, told=False) for x in found)
    wheels = max(sum(s == side for s in turning.sides.values()) for side in (1.0, -1.0))
    return Sought(found, _smallest(sides, about, block_s, wheels))


def _sides(judged: Mapping[str, Judged], faults: Mapping[str, Sequence[Spell]], turning: Turning) -> _Sides:
    right, left = (
        np.mean([j.wheel.blocks.mean for w, j in judged.items() if turning.sides.get(w) == side], axis=0)
        for side in (1.0, -1.0)
    )
    sound = np.isfinite(right) & np.isfinite(left) & np.isfinite(turning.yaw)
    for w, j in judged.items():
        b = j.wheel.blocks
        with np.errstate(invalid="ignore"):
            sound &= ~(np.abs(b.mean - np.clip(b.mean, b.low, b.high)) > _OFF * b.noise)
        for s in faults[w]:
            sound[max(0, s.start - _AROUND) : s.stop + _AROUND] = False
    return _Sides(np.nan_to_num(right), np.nan_to_num(left), np.nan_to_num(turning.yaw), sound)


def _relations(sides: _Sides) -> Iterable[_Relation]:
    """How the yaw rate may belong to the sides: as in all of the mission, or as in a part of it that is sound."""
    apart, turns = sides.right - sides.left, np.abs(sides.right - sides.left)
    rest = _rest(sides)
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
        found = _relation(sides, inside & sides.sound, rest)
        if found is not None:
            yield found
    yield from _two_gains(sides, rest)


def _settled(sides: _Sides, about: _Relation) -> tuple[_Relation, NDArray[np.intp], float]:
    """A relation as it is where it calls nothing wrong, the path with it, and its log-likelihood: what is found off decides no gain."""
    path, score = _path(sides, about)
    for _ in range(_REFITS):
        again = _relation(sides, sides.sound & (path == 0), _rest(sides))
        if again is None or abs(again.gain / about.gain - 1.0) < _SAME:
            break
        about = again._replace(noise=about.noise)
        path, score = _path(sides, about)
    return about, path, score


def _rest(sides: _Sides) -> float | None:
    """Constant of the gyro as the machine at rest shows it [rad/s]; None where it hardly rests."""
    still = sides.sound & (sides.right == 0.0) & (sides.left == 0.0)
    return float(np.median(sides.yaw[still])) if np.count_nonzero(still) >= _STANDS else None


def _two_gains(sides: _Sides, rest: float | None) -> Iterable[_Relation]:
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
            yield _Relation(gain, (rest or 0.0) + constant, _noise(sides, gain, usual))


def _noise(sides: _Sides, gain: float, usual: float) -> Array:
    """Misfit of each block, with what turning, speed and changes make of it [rad/s], shape (b,)."""
    apart = sides.right - sides.left
    change = np.abs(np.gradient(apart)) + 0.3 * np.abs(np.gradient(0.5 * (sides.right + sides.left)))
    speed = np.maximum(np.abs(sides.right), np.abs(sides.left))
    return np.asarray(np.hypot(usual, abs(gain) * (_TURN * np.abs(apart) + _SPEED * speed + _CHANGE * change)))


def _relation(sides: _Sides, use: Flags, rest: float | None) -> _Relation | None:
    """The relation in some blocks, by most of them; `rest`: the constant, where the machine at rest shows it."""
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
    return _Relation(gain, constant, _noise(sides, gain, usual))


def _states(sides: _Sides, about: _Relation) -> Array:
    """Yaw rate in each state [rad/s]: sound, left and right by factor, gyro by gain and constant. Shape (b, states)."""
    g, apart = about.gain, sides.right - sides.left
    usual = float(np.quantile(np.abs(g * apart[sides.sound]), 0.9))
    columns = [g * apart]
    columns += [g * (sides.right - f * sides.left) for f in _FACTORS]
    columns += [g * (f * sides.right - sides.left) for f in _FACTORS]
    columns += [h * g * apart for h in _GAINS]
    columns += [g * apart + usual * k for k in _CONSTANTS]
    return np.asarray(about.constant + np.column_stack(columns))


def _scores(sides: _Sides, about: _Relation, yaw: Array) -> Array:
    """Log-likelihood of yaw rates, a share of that of independent blocks. Shape of `yaw`."""
    off = ((sides.yaw - yaw.T) / about.noise).T ** 2
    use = sides.sound if yaw.ndim == 1 else sides.sound[:, np.newaxis]
    return np.asarray(np.where(use, -0.5 * np.minimum(off, _CAPPED) / _ALIKE, 0.0))


def _path(sides: _Sides, about: _Relation) -> tuple[NDArray[np.intp], float]:
    """The most probable state of each block, shape (b,), and its log-likelihood."""
    score = _scores(sides, about, _states(sides, about))
    n, m = score.shape
    best, back = np.where(np.arange(m) > 0, -_ENTER, 0.0) + score[0], np.zeros((n, m), np.intp)
    for k in range(1, n):
        top = int(np.argmax(best))
        stay = best >= best[top] - _ENTER
        back[k] = np.where(stay, np.arange(m), top)
        best = np.where(stay, best, best[top] - _ENTER) + score[k]
    path = np.zeros(n, np.intp)
    path[-1] = int(np.argmax(best))
    for k in range(n - 1, 0, -1):
        path[k - 1] = back[k, path[k]]
    return path, float(best.max())


def _spans(path: NDArray[np.intp]) -> list[tuple[int, int, float]]:
    """Blocks [start, stop) with a factor on one side, and that side."""
    number = len(_FACTORS)
    kind = np.select([(path > 0) & (path <= number), (path > number) & (path <= 2 * number)], [-1.0, 1.0], 0.0)
    edges = np.flatnonzero(np.diff(np.r_[0.0, kind, 0.0]) != 0.0)
    return [(int(a), int(b), float(kind[a])) for a, b in pairwise(edges) if kind[a] != 0.0]


def _scaled(sides: _Sides, about: _Relation, span: tuple[int, int, float], block_s: float) -> Scaled | None:
    """A time as it is told; None where it is short, small, or as well a fault of the gyro."""
    start, stop, side = span
    inside: Flags = np.zeros(sides.yaw.size, np.bool_)
    inside[start:stop] = True
    part = sides._replace(sound=sides.sound & inside)
    own = {1.0: sides.right, -1.0: -sides.left}
    least = 0.1 * float(np.quantile(np.abs(own[side][sides.sound]), 0.9))
    if np.count_nonzero(part.sound & (np.abs(own[side]) > least)) * block_s < _LEAST_S:
        return None
    g, apart, c = about.gain, sides.right - sides.left, about.constant
    rest = sides.yaw - c - g * apart
    fits = {s: g * x * _by(rest, g * x, about.noise, part.sound) for s, x in own.items()}
    gyro = _of_the_gyro(rest, g * apart, about.noise, part.sound)
    likely = {s: float(_scores(part, about, c + g * apart + x).sum()) for s, x in fits.items()}
    rivals = max(float(_scores(part, about, c + g * apart + x).sum()) for x in (gyro, np.zeros(rest.size)))
    side = max(likely, key=lambda s: likely[s])
    factors = {s: 1.0 + _by(rest, g * x, about.noise, part.sound) for s, x in own.items()}
    size = max(factors[side], 1.0 / max(factors[side], 1e-9))
    if size < _LEAST_FACTOR or factors[side] <= 0.0 or likely[side] - rivals < _SURE:
        return None
    told = likely[side] - likely[-side] > _TELLS
    return Scaled(start, stop, side, factors[side], factors[-side], told)


def _of_the_gyro(y: Array, turn: Array, noise: Array, use: Flags) -> Array:
    """What a gain and a constant of the gyro together make of a deviation: scaled, shifted, dead, or frozen at a value. Shape of y."""
    table, weight = np.column_stack([turn, np.ones(turn.size)]), use / noise
    weights = np.linalg.lstsq(table * weight[:, np.newaxis], y * weight, rcond=None)[0]
    return np.asarray(table @ weights)


def _by(y: Array, x: Array, noise: Array, use: Flags) -> float:
    """Share of x in y, by least squares with the noise of each block."""
    w = np.where(use, 1.0 / noise**2, 0.0)
    power = float(np.sum(w * x * x))
    return float(np.sum(w * x * y)) / power if power > 0.0 else 0.0


def _smallest(sides: _Sides, about: _Relation, block_s: float, wheels: int) -> float:
    """Smallest factor above 1 of one of so many wheels of a side that shows in 95 of 100 places for `LENGTH_S` [1]."""
    number = max(1, round(LENGTH_S / block_s))
    sizes = []
    for x in (sides.right, sides.left):
        per = np.where(sides.sound, (about.gain * x / about.noise) ** 2, 0.0)
        total = np.convolve(per, np.ones(number), mode="valid") if per.size >= number else np.array([per.sum()])
        driven = np.convolve(np.abs(x) > 0.1 * np.quantile(np.abs(x), 0.9), np.ones(number), mode="valid")[: total.size]
        total = total[driven * block_s > _LEAST_S] if driven.size == total.size else total
        if total.size:
            sizes.append(float(np.quantile(2.0 * _ALIKE * (_ENTER + _SURE) / np.maximum(total, 1e-12), 0.95)))
    if not sizes:
        return np.inf
    factor = 1.0 + wheels * max(_STATED - 1.0, float(np.sqrt(max(sizes))))
    return factor if factor < _LARGEST else np.inf
