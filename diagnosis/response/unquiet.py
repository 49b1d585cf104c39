"""Sensors of which nothing healthy is said while their readings change from one to the next as those of no other wheel do.

Whatever else explains the mean of a speed says nothing of that: a model that found the noise in the mission, and a witness that fits on average, take it for
the channel's habit. Ground and motors shake wheels of one machine by like amounts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.disputed import unproved
from diagnosis.results.assessment import CODE, Assessment
from diagnosis.results.vocabulary import Tier
from replay.arrays.blocks import release
from replay.arrays.quantiles import quantile_known, quantile_of
from replay.arrays.sliding import median_within
from replay.faults import State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_BLOCK_S = 0.5
_AROUND = 4  # blocks to each side, of which the median counts
_LOUDER = 4.0  # times the other wheels': more than ground, speed and load make of it
_SHARE, _SLOW = 0.1, 0.3  # of the speed, or of that share of the usual one
_COARSE = 0.3  # of the noise: where hardly any change is smaller, readings go by steps of an encoder
_LEAST = 20  # blocks in motion
_SAID = "its readings change from one to the next by more than a tenth of the speed, and four times as much as those of the other {wheels}: noise, or a {wheel} that shakes alone"


class Roughness(NamedTuple):
    """A channel by blocks, each of shape (b,): mean size of its speed, and noise of one sample by second differences [m/s], the latter as the median around; NaN where unknown."""

    speed: Array
    noise: Array


def left_open(
    found: Mapping[str, Assessment], speeds: Mapping[str, tuple[Array, Flags]], dt: float
) -> dict[str, Assessment]:
    """Speed sensors by wheel, those that are rough beside the others not healthy at that time.

    Parameters
    ----------
    found : Mapping[str, Assessment]
        What was found of them.
    speeds : Mapping[str, tuple[Array, Flags]], each of shape (n,)
        Readings [m/s] of every wheel, and where they are new.
    dt : float
        Step [s].
    """
    judged = [w for w, a in found.items() if a.tier is not Tier.DIRECT and (a.states == CODE[State.HEALTHY]).any()]
    if len(speeds) < 2 or not judged:
        return dict(found)
    width = max(1, round(_BLOCK_S / dt))
    by_wheel = {}
    for w, (y, fresh) in speeds.items():
        by_wheel[w] = roughness(y, fresh, width)
        release(y, fresh)
    out = dict(found)
    for w in judged:
        if w not in by_wheel or _coarse(*speeds[w]):
            continue
        where = louder(by_wheel[w], [r for o, r in by_wheel.items() if o != w])
        if where.any():
            out[w] = unproved(found[w], np.repeat(where, width)[: found[w].states.size], _SAID)
    return out


def roughness(y: Array, fresh: Flags, width: int) -> Roughness:
    """A channel by blocks of `width` steps; `y` of shape (n,) [m/s], `fresh` where readings are new."""
    step = np.flatnonzero(fresh & np.isfinite(y))
    value = np.asarray(y[step], dtype=np.float64)
    white = np.zeros(value.size)
    if value.size > 2:
        white[1:-1] = (value[2:] - 2.0 * value[1:-1] + value[:-2]) / np.sqrt(6.0)
    number = -(-y.size // width)
    count = np.bincount(step // width, minlength=number)
    speed = np.bincount(step // width, weights=np.abs(value), minlength=number) / np.maximum(count, 1)
    noise = np.sqrt(np.bincount(step // width, weights=white**2, minlength=number) / np.maximum(count, 1))
    use = np.flatnonzero(count > 0)
    out = np.full((2, number), np.nan)
    if use.size:
        out[0, use] = speed[use]
        out[1, use] = median_within(noise[use], _AROUND) if use.size > 2 * _AROUND else noise[use]
    return Roughness(out[0], out[1])


def louder(own: Roughness, others: Sequence[Roughness]) -> Flags:
    """Blocks in which a channel is rough as no other one is that moves, shape (b,)."""
    table = np.array([np.where(_moves(r), r.noise, np.nan) for r in others])
    if not np.isfinite(table).any():
        return np.zeros(own.noise.size, np.bool_)
    known = np.isfinite(table).any(axis=0)
    most = np.full(own.noise.size, float(quantile_known(table, 0.9)))  # where all others stand, what they do else
    most[known] = np.nanmax(table[:, known], axis=0)
    usual = float(quantile_known(own.speed, 0.9)) if np.isfinite(own.speed).any() else np.inf
    least = _SHARE * np.maximum(own.speed, _SLOW * usual)
    loud = np.asarray(np.nan_to_num(own.noise) > np.maximum(_LOUDER * most, np.nan_to_num(least, nan=np.inf)))
    return loud if np.count_nonzero(loud) >= _LEAST else np.zeros_like(loud)


def _moves(r: Roughness) -> Flags:
    usual = float(quantile_known(r.speed, 0.9)) if np.isfinite(r.speed).any() else np.inf
    return np.asarray((np.nan_to_num(r.speed) > _SLOW * usual) & (np.nan_to_num(r.noise) > 0.0))


def _coarse(y: Array, fresh: Flags) -> bool:
    """Whether readings go by steps, so that what changes from one to the next is a habit of the encoder."""
    value = y[fresh & np.isfinite(y)]
    change = np.abs(np.diff(value))
    change = change[change > 0.0]
    return bool(change.size) and bool(quantile_of(change, 0.05) > _COARSE * np.sqrt(np.mean(np.diff(value) ** 2) / 2.0))
