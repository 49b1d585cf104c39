"""What the ground makes of wheels that are right: tyres that slip in turns, and a side that drags the other one along.

A machine that steers by its sides yaws by a share of what they differ, and tyres slip: the share varies with speed, ground and turn. So a
yaw rate that fits the sides badly says nothing against a wheel as long as some share that this mission has shown explains it. What slip
cannot do is move a wheel against its own command, by the same factor, at every speed; nor turn a machine whose sides are equally fast.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.inputs import cells
from diagnosis.response.machine import Judged
from diagnosis.response.models import Blocks
from diagnosis.response.spells import Spell

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_TURNS = 0.1  # of the top speed, by which the sides differ in a turn
_WINDOW = 8  # blocks of one share
_LEAST_WINDOWS = 60  # of turning, outside of what is asked about
_AROUND = 4  # blocks around a spell in which its ends may be
_RARE = 0.02  # of the turning, on either side, in which the share is rarer than the ground that is looked at
_LESS, _MORE = 0.7, 1.1  # of the smallest and the largest usual share: ground that the mission has not shown
_NOISE = 3.0  # times the usual misfit beside a share
_EXPLAINED = 0.7  # of the blocks of a spell
_LEAST_SPELL = 4  # blocks
_OFTEN, _HARDER = 0.95, 1.2  # of the time in which sides differ, and times the drag that is exceeded in the rest of it
_HALF, _SPEEDS, _CONSTANT = (
    0.55,
    0.3,
    0.05,
)  # share; spread of the speeds, and misfit, by their size: the ground is never so even
_HALF_OF_IT = 0.5  # of the logarithm of a factor beside the other view, that the command has to show too
_EVEN, _VARIES = 0.15, 0.2  # misfit of a scale beside a yaw rate, and spread of the speeds it is seen at, by their size
_FIRST, _MOSTLY = (
    1.0,
    0.5,
)  # usual misfits beside the command, up to which, or in fewer blocks, nothing has to be explained


class Shares(NamedTuple):
    """Yaw rate by what the sides differ, as the mission shows it.

    Attributes
    ----------
    low, high : float
        Smallest and largest share that the ground makes [rad/m].
    noise : float
        Misfit beside these shares that the mission shows now and then, as where a body spins on when its sides no longer differ [rad/s].
    spins : bool
        Whether that is often more than noise.
    """

    low: float
    high: float
    noise: float
    spins: bool = False


def shares_of_turning(apart: Array, yaw: Array, sound: Flags) -> Shares | None:
    """What share of the sides' difference turns the body in most of a mission; None where it turns too little.

    Parameters
    ----------
    apart : Array, shape (b,)
        Speed of a wheel less that of the other side [m/s].
    yaw : Array, shape (b,)
        Measured yaw rate [rad/s].
    sound : Flags, shape (b,)
        Blocks that are looked at.
    """
    known = sound & np.isfinite(apart) & np.isfinite(yaw)
    if not known.any():
        return None
    turns = known & (np.abs(apart) > _TURNS * float(np.quantile(np.abs(apart[known]), 0.95)))
    share = np.divide(yaw, apart, out=np.full(apart.size, np.nan), where=turns)
    shown = _medians(share)
    use = np.isfinite(shown)
    if np.count_nonzero(use) < _LEAST_WINDOWS:
        return None
    middle = float(np.median(shown[use]))
    low, high = (float(np.quantile(shown[use] * np.sign(middle), q)) for q in (_RARE, 1.0 - _RARE))
    noise = 1.48 * float(np.median(np.abs(yaw - np.nan_to_num(shown, nan=middle) * apart)[known]))
    shares = Shares(np.sign(middle) * _LESS * max(low, 0.0), np.sign(middle) * _MORE * high, _NOISE * noise)
    beyond = _medians(np.where(known, _beyond(shares, apart, yaw), np.nan))
    beyond = beyond[np.isfinite(beyond)]
    often = _HARDER * float(np.quantile(beyond, _OFTEN)) if beyond.size else 0.0
    return shares._replace(noise=max(shares.noise, often), spins=often > shares.noise)


def _beyond(shares: Shares, apart: Array, yaw: Array) -> Array:
    """How far a yaw rate is beyond all shares [rad/s]."""
    ends = np.array([shares.low * apart, shares.high * apart])
    return np.asarray(np.abs(yaw - np.clip(yaw, ends.min(axis=0), ends.max(axis=0))))


def _medians(x: Array) -> Array:
    """Median over the window around each block, NaN where less than half of it is known; shape (b,)."""
    if x.size < _WINDOW:
        return np.full(x.size, np.nan)
    wide = np.concatenate([np.full(_WINDOW // 2, np.nan), x, np.full(_WINDOW - 1 - _WINDOW // 2, np.nan)])
    table = np.lib.stride_tricks.sliding_window_view(wide, _WINDOW)
    enough = np.count_nonzero(np.isfinite(table), axis=1) * 2 >= _WINDOW
    out = np.full(x.size, np.nan)
    out[enough] = np.nanmedian(table[enough], axis=1)
    return out


def by_slip(spell: Spell, wheel: str, judged: Mapping[str, Judged], yaw: Array | None) -> bool:
    """Whether tyres that slip explain a deviation from the other side and the yaw rate, and the wheel's own command says nothing of it.

    Parameters
    ----------
    spell : Spell
        Of `wheel`.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    yaw : Array or None, shape (b,)
        Measured yaw rate [rad/s].
    """
    one = judged[wheel]
    if yaw is None or one.across is None or one.speed is None or spell.own or not spell.unspecific:
        return False
    apart = one.wheel.blocks.mean - one.across
    outside = np.ones(apart.size, np.bool_)
    outside[max(0, spell.start - _AROUND) : spell.stop + _AROUND] = False
    shares = shares_of_turning(apart, yaw, outside)
    if shares is None:
        return False
    part = slice(spell.start, spell.stop)
    known = np.isfinite(apart[part]) & np.isfinite(yaw[part])
    if np.count_nonzero(known) < _LEAST_SPELL:
        return False
    off = _beyond(shares, apart[part], yaw[part])[known]
    slips, both = float(np.mean(off <= shares.noise)) >= _EXPLAINED, _both_say_so(one, part)
    if slips:
        return not both or dragged(part, wheel, judged)
    # what is no slip, and no deviation from the command, is a scale where it is the same one all along, and bodies do not spin on
    even = not shares.spins and _even(one.wheel.blocks.mean[part], one.speed[part])
    return one.response.answered and not both and not even


def _even(y: Array, x: Array) -> bool:
    """Whether a wheel reads one share of another view at several speeds."""
    known = np.isfinite(y) & np.isfinite(x)
    power = float(x[known] @ x[known])
    if power == 0.0:
        return False
    if np.std(x[known]) < _VARIES * np.sqrt(power / np.count_nonzero(known)):
        return False
    share = float(x[known] @ y[known]) / power
    return float(np.median(np.abs(y - share * x)[known])) < _EVEN * float(np.median(np.abs(y[known])))


def _both_say_so(one: Judged, part: slice) -> bool:
    """Whether command and other view both say that a wheel reads too much, or too little, and by like factors, as a scale of it would have it."""
    b = one.wheel.blocks
    if one.speed is None or not one.response.answered:
        return False
    logs = []
    for view in (0.5 * (b.low + b.high), one.speed):
        x, y = view[part], b.mean[part]
        known = np.isfinite(x) & np.isfinite(y)
        power = float(x[known] @ x[known])
        factor = float(x[known] @ y[known]) / power if power > 0.0 else 0.0
        if factor <= 0.0:
            return False
        logs.append(float(np.log(factor)))
    return logs[0] * logs[1] > 0.0 and abs(logs[0]) >= _HALF_OF_IT * abs(logs[1])


def by_drag(spell: Spell, wheel: str, judged: Mapping[str, Judged]) -> bool:
    """Whether the other side explains a deviation from the command, which nothing else contradicts, or the drive only does better than usual.

    Sides are coupled by the ground: it turns the body back, so that the slower side is pulled along and the faster one held. Each then reads
    something between what its command makes of it and what the other one does, as far as this mission has shown it. A drive that is
    nearer to its command than its usual limit lets it be has less of a load.

    Parameters
    ----------
    spell : Spell
        Of `wheel`.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    """
    one = judged[wheel]
    bare = one.speed is None and one.response.answered and not spell.own
    return bare and spell.unspecific and dragged(slice(spell.start, spell.stop), wheel, judged)


def dragged(part: slice, wheel: str, judged: Mapping[str, Judged], least: float = _MOSTLY) -> bool:
    """Whether a wheel is near its command, or drawn towards the other side, or nearer to what it is asked for than usual.

    Parameters
    ----------
    part : slice
        The blocks.
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    least : float
        Share of the blocks off the command from which on something has to be explained [1]; of those in which the wheel has to turn, for a
        share of nothing is nothing.
    """
    one = judged[wheel]
    if not one.response.answered:
        return True
    b = one.wheel.blocks
    asked = cells(one.data.asked, int(b.start[1]) if b.start.size > 1 else 1)[part]
    outside = np.ones(b.mean.size, np.bool_)
    outside[max(0, part.start - _AROUND) : part.stop + _AROUND] = False
    ends = [b.low[part], b.high[part], np.where(np.isfinite(asked), asked, b.low[part])]
    for other, j in judged.items():
        if other != wheel and j.wheel.blocks.mean.size == b.mean.size:
            most = max(_drag_of(b, j.wheel.blocks.mean, outside), _drag_of(j.wheel.blocks, b.mean, outside))
            near = np.clip(b.mean, b.low, b.high)
            ends.append(np.nan_to_num(near + min(_HARDER * most, 1.0) * (j.wheel.blocks.mean - near))[part])
    y, low, high = b.mean[part], np.min(ends, axis=0), np.max(ends, axis=0)
    astray = np.abs(y - np.clip(y, b.low[part], b.high[part])) > _FIRST * b.noise[part]
    shows = astray | (b.low[part] > _FIRST * b.noise[part]) | (b.high[part] < -_FIRST * b.noise[part])  # not at rest
    if not astray.any() or np.mean(astray[shows]) < least:
        return True
    left = np.abs(y - np.clip(y, low, high)) <= _FIRST * b.noise[part]
    return float(np.mean(left[astray])) >= _EXPLAINED and not _halved(y, b.low[part], b.high[part])


def _halved(y: Array, low: Array, high: Array) -> bool:
    """Whether a wheel reads about half of what its command makes of it, or less, and the same share at each of several speeds."""
    known = np.isfinite(y) & np.isfinite(low) & np.isfinite(high)
    y, low, high = y[known], low[known], high[known]
    made = 0.5 * (low + high)
    for _ in range(3):
        power = float(made @ made)
        share = float(y @ made) / power if power > 0.0 else 0.0
        if not 0.0 < share <= _HALF:
            return False
        made = np.clip(y / share, low, high)
    if np.std(made) < _SPEEDS * np.sqrt(np.mean(made**2)):
        return False
    return bool(np.median(np.abs(y - share * made)) < _CONSTANT * np.median(np.abs(y)))


def _drag_of(blocks: Blocks, other: Array, sound: Flags) -> float:
    """How far towards another side a wheel goes beside its command now and then, by what both differ [1]."""
    near = np.clip(blocks.mean, blocks.low, blocks.high)
    apart = np.where(sound, other - near, np.nan)
    known = np.isfinite(apart)
    if not known.any():
        return 0.0
    differ = known & (np.abs(apart) > _TURNS * float(np.nanquantile(np.abs(other), 0.95)))
    shown = _medians(np.divide(blocks.mean - near, apart, out=np.full(apart.size, np.nan), where=differ))
    use = np.isfinite(shown)
    return float(np.quantile(shown[use], _OFTEN)) if np.count_nonzero(use) >= _LEAST_WINDOWS else 0.0
