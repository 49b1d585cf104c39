"""One wheel against all others: three and more that agree say what it should read, without a command, a gain or a fit.

Tyres that slip, a wheel that spins or one that a brake locks come and go with the ground; a sensor that is wrong jumps, or is off by the same share, or the same
speed, all along. Sides that differ in a turn agree on nothing, and say nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.findings import finding_of
from diagnosis.response.machine import Judged
from diagnosis.response.spells import Spell, spans_of
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_WITNESSES = 3
_AGREE = 0.08  # of their speed: so far apart are wheels that agree
_OFF, _BEYOND = 0.2, 3.0  # of their speed, and times what they are apart: what is further off contradicts them
_NEARLY = 0.5  # of that: what is so far off all along does not come and go
_MOVES = 0.1  # of the usual largest speed
_JOIN_S = 1.0
_JUMPED_S, _STEADY_S = 2.0, 5.0  # how long it must last where it jumps, or nothing is read, and else
_STEADY = 0.15  # of what it is off: by so much a steady share, or a steady offset, may scatter
_LASTING = 0.8  # of the driving: what lasts longer, and does not jump, may be another size or another unit as well
_JUMPED_P, _STEADY_P = 0.95, 0.7
_LEAST_STEADY = 8  # blocks
_DEAD = 0.85  # of the blocks, in which nothing but 0 is read
_AT_ONCE, _AROUND_S = 0.6, 0.5  # of what it is off, from one reading to the next; around an end


def by_majority(judged: Mapping[str, Judged], block_s: float, *, sideways: bool) -> dict[str, list[Finding]]:
    """Findings of wheels without a command that contradict three or more others which agree, by wheel; of all wheels.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    block_s : float
        Length of a block [s].
    sideways : bool
        Whether the machine also moves sideways, so that wheels are not alike.
    """
    out: dict[str, list[Finding]] = {w: [] for w in judged}
    if sideways or len(judged) <= _WITNESSES:
        return out
    means = {w: j.wheel.blocks.mean for w, j in judged.items()}
    for w, j in judged.items():
        if j.response.answered:
            continue
        speed, apart = agreed([means[o] for o in means if o != w])
        y = means[w]
        off = np.nan_to_num(np.abs(y - speed)) > np.nan_to_num(
            np.maximum(_OFF * np.abs(speed), _BEYOND * apart), nan=np.inf
        )
        known = np.isfinite(speed) & np.isfinite(y)
        spells = [_spell(a, b, y, speed) for a, b in spans_of(off, round(_JOIN_S / block_s))]
        near = np.abs(y - speed)[known] > _NEARLY * _OFF * np.abs(speed[known])
        lasts = np.count_nonzero(near) >= _LASTING * max(near.size, 1)
        kept = [
            s
            for s in spells
            if _shows(s, j, speed, block_s) and not (lasts and not (jumps(j, s, speed) or _dies(s, y)))
        ]
        names = " and ".join(o.data.name for k, o in judged.items() if k != w)
        wheel = j.wheel._replace(compared=names, own=False)
        sure = [s._replace(p=_JUMPED_P if jumps(j, s, speed) else _STEADY_P) for s in kept]
        out[w] = [f for s in sure if (f := finding_of(s, wheel, speed)) is not None]
    return out


def agreed(others: list[Array]) -> tuple[Array, Array]:
    """What wheels that agree say of the speed, and how far they are apart [m/s], each of shape (b,); NaN where they do not agree, or stand.

    `others` each of shape (b,) [m/s].
    """
    table = np.array(others)
    middle, apart = np.median(table, axis=0), np.ptp(table, axis=0)
    size = np.abs(middle)
    least = _MOVES * float(np.nanquantile(size, 0.9)) if np.isfinite(size).any() else np.inf
    alike = np.isfinite(middle) & (size > least) & (apart <= _AGREE * size)
    return np.where(alike, middle, np.nan), np.where(alike, apart, np.nan)


def _spell(first: int, stop: int, y: Array, speed: Array) -> Spell:
    known = np.isfinite(speed[first:stop]) & np.isfinite(y[first:stop])
    here, there = y[first:stop][known], speed[first:stop][known]
    share = float(here @ there) / max(float(there @ there), 1e-12)
    dead = bool(np.mean(here == 0.0) >= _DEAD)
    mode = FaultMode.NO_SIGNAL if dead else FaultMode.INEFFICIENT if 0.0 < share < 1.0 else FaultMode.OUTSIDE_TABLE
    return Spell(first, stop, mode, _STEADY_P)


def jumps(one: Judged, spell: Spell, speed: Array) -> bool:
    """Whether a wheel comes off what the others say, or back to it, from one reading to the next; `speed` of shape (b,) [m/s]."""
    samples, width = one.wheel.samples, int(one.wheel.blocks.start[1])
    part = slice(spell.start, spell.stop)
    off = np.abs(one.wheel.blocks.mean - speed)[part]
    least = _AT_ONCE * float(np.median(off[np.isfinite(off)]))
    change = np.abs(np.nan_to_num(samples.change))
    reach = _AROUND_S / one.wheel.dt
    return any(
        bool((change[np.abs(samples.step - at * width) <= reach] > least).any()) for at in (spell.start, spell.stop)
    )


def _dies(spell: Spell, y: Array) -> bool:
    """Whether a wheel reads nothing in a spell and something outside of it."""
    elsewhere = np.r_[y[: spell.start], y[spell.stop :]]
    return spell.mode is FaultMode.NO_SIGNAL and bool(np.any(np.nan_to_num(elsewhere) != 0.0))


def _shows(spell: Spell, one: Judged, speed: Array, block_s: float) -> bool:
    """Whether a spell is no slip: it jumps, or is off by one share or one speed all along."""
    length = (spell.stop - spell.start) * block_s
    if jumps(one, spell, speed) or spell.mode is FaultMode.NO_SIGNAL:
        return length >= _JUMPED_S
    part = slice(spell.start, spell.stop)
    known = np.isfinite(speed[part]) & np.isfinite(one.wheel.blocks.mean[part])
    y, x = one.wheel.blocks.mean[part][known], speed[part][known]
    if length < _STEADY_S or y.size < _LEAST_STEADY:
        return False
    least = _STEADY * float(np.median(np.abs(y - x)))
    return bool(min(np.std(y / x) * np.median(np.abs(x)), np.std(y - x)) < least)
