"""Which of two wheels without commands is at fault where they differ: the one whose readings leap when it begins and when it ends.

Beside one another two channels only show that one of them is wrong. What makes them part within a reading is the one that changes in it;
where neither does, as likely the one as the other.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.response.spells import Spell

Array = NDArray[np.float64]

_AROUND_S = 0.8  # around the beginning and the end of a spell
_FREEDOM = 3.0  # of Student's t, of what readings change by
_USUAL, _SCALE = 0.9, 1.64  # quantile of those changes, and how many standard deviations it is
_PARTS = 0.5  # of the whole difference, that a leap makes at least
_SURE = 3.5  # largest logarithm of the odds by both ends
_LEAST = 20


def by_leaps(judged: Mapping[str, Judged], mates: Mapping[str, tuple[str, ...]]) -> dict[str, Judged]:
    """Wheels whose spells of a scale know how much of them is their own, where only one other wheel, of the same side, contradicts them.

    Where a command is known it says more; where the yaw rate decides it already, the leaps add to it.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    mates : Mapping[str, tuple[str, ...]]
        The others of each one's side.
    """
    out = {}
    for w, j in judged.items():
        out[w] = j
        if len(mates[w]) != 1 or j.response.answered or j.speed is None:
            continue
        other = judged[mates[w][0]]
        if other.response.answered:
            continue
        out[w] = j._replace(spells=[_shared(s, j, other) for s in j.spells])
    return out


def anothers(spell: Spell, one: Judged, rival: Spell, other: Judged) -> bool | None:
    """Whether a spell of one wheel is rather the other one's, by how much of it is its own; None where that is open or commands say it."""
    if one.response.answered or other.response.answered or abs(spell.mine - rival.mine) < 0.2:
        return None
    return rival.mine > spell.mine


def _shared(spell: Spell, one: Judged, other: Judged) -> Spell:
    """A spell with the share of its probability that is its own: `Spell.mine` 0 where both are as likely, 1 where it is surely its."""
    if spell.own or not spell.unspecific:
        return spell
    width = int(one.wheel.blocks.start[1])
    odds = sum(_odds(at * width, one, other) for at in (spell.start, spell.stop))
    before = float(np.clip(spell.mine, 0.01, 0.99))
    odds = float(np.clip(odds, -_SURE, _SURE)) + np.log(before / (1.0 - before))
    return spell._replace(mine=max(0.0, 2.0 / (1.0 + float(np.exp(-odds))) - 1.0))


def _odds(at: int, one: Judged, other: Judged) -> float:
    """Logarithm of the odds that the first wheel made the two part around a step, rather than the second; 0 where it came slowly."""
    reach = round(_AROUND_S / one.wheel.dt)
    y, x = one.wheel.samples, other.wheel.samples
    use = np.flatnonzero((np.abs(y.step - at) <= reach) & np.isfinite(y.value))
    if use.size < 3 or x.step.size < _LEAST or y.step.size < _LEAST:
        return 0.0
    gain = _gain(one, other)
    # the last reading of the other one: both often stand in one message
    beside = gain * x.value[np.maximum(np.searchsorted(x.step, y.step[use], side="right") - 1, 0)]
    mine, its = np.diff(y.value[use]), np.diff(beside)
    apart = np.nan_to_num(mine - its)
    k = int(np.argmax(np.abs(apart)))
    if abs(apart[k]) < _PARTS * abs(np.nan_to_num(apart).sum()):
        return 0.0
    scale = max(_usual(one), gain * _usual(other), 1e-9)
    return _weight(its[k] / scale) - _weight(mine[k] / scale)


def _gain(one: Judged, other: Judged) -> float:
    """What one wheel usually reads of the other's speed [1]."""
    y, x = one.wheel.blocks.mean, other.wheel.blocks.mean
    use = np.isfinite(y) & np.isfinite(x) & (np.abs(x) > 0.1 * np.nanquantile(np.abs(x), 0.9)) & (y != 0.0)
    return float(np.median(y[use] / x[use])) if use.any() else 1.0


def _usual(one: Judged) -> float:
    """How much readings of a moving wheel change by [m/s], as a standard deviation."""
    size = np.abs(one.wheel.samples.change)
    size = size[np.isfinite(size) & (size > 0.0)]
    return float(np.quantile(size, _USUAL)) / _SCALE if size.size else 0.0


def _weight(z: float) -> float:
    """Log-likelihood of a change, in usual ones, 0 at best."""
    return -0.5 * (_FREEDOM + 1.0) * float(np.log1p(z * z / _FREEDOM))
