"""An encoder that reads a share of its wheel's speed inside the loop that it closes: the reading stays at its command, and the wheel goes otherwise.

Neither command nor reading shows that; the yaw rate does. It leaves what the sides make of it by a share of the speed of one side, also
straight ahead, which neither a share of the yaw rate nor a constant of the gyro does. A path through these rivals says when. A tyre of
another size, a wheel that slips, and a machine that is pulled aside all the time look the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.response.sides_by_yaw import Relation, Sides, relation_in, relations_of, rest_of, sides_of
from diagnosis.response.spells import Spell
from diagnosis.response.turning import Turning

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_REFITS, _SAME = 3, 0.02  # of a gain, by what nothing is found wrong in
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
    sides = sides_of(judged, faults, turning)
    relations = list(relations_of(sides))
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


def _settled(sides: Sides, about: Relation) -> tuple[Relation, NDArray[np.intp], float]:
    """A relation as it is where it calls nothing wrong, the path with it, and its log-likelihood: what is found off decides no gain."""
    path, score = _path(sides, about)
    for _ in range(_REFITS):
        again = relation_in(sides, sides.sound & (path == 0), rest_of(sides))
        if again is None or abs(again.gain / about.gain - 1.0) < _SAME:
            break
        about = again._replace(noise=about.noise)
        path, score = _path(sides, about)
    return about, path, score


def _states(sides: Sides, about: Relation) -> Array:
    """Yaw rate in each state [rad/s]: sound, left and right by factor, gyro by gain and constant. Shape (b, states)."""
    g, apart = about.gain, sides.right - sides.left
    usual = float(np.quantile(np.abs(g * apart[sides.sound]), 0.9))
    columns = [g * apart]
    columns += [g * (sides.right - f * sides.left) for f in _FACTORS]
    columns += [g * (f * sides.right - sides.left) for f in _FACTORS]
    columns += [h * g * apart for h in _GAINS]
    columns += [g * apart + usual * k for k in _CONSTANTS]
    return np.asarray(about.constant + np.column_stack(columns))


def _scores(sides: Sides, about: Relation, yaw: Array) -> Array:
    """Log-likelihood of yaw rates, a share of that of independent blocks. Shape of `yaw`."""
    off = ((sides.yaw - yaw.T) / about.noise).T ** 2
    use = sides.sound if yaw.ndim == 1 else sides.sound[:, np.newaxis]
    return np.asarray(np.where(use, -0.5 * np.minimum(off, _CAPPED) / _ALIKE, 0.0))


def _path(sides: Sides, about: Relation) -> tuple[NDArray[np.intp], float]:
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


def _scaled(sides: Sides, about: Relation, span: tuple[int, int, float], block_s: float) -> Scaled | None:
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


def _smallest(sides: Sides, about: Relation, block_s: float, wheels: int) -> float:
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
