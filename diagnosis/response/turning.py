"""Whether the body turns as a wheel's reading says, or as it would turn without that wheel's deviation.

A machine that turns by its wheels yaws by the difference of its sides. Where a wheel deviates from what its command or its peers say,
the measured yaw rate follows the reading if the wheel really turns so (its drive), and does not if the reading is wrong (its sensor).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.identification import beyond
from diagnosis.response.jumps import falls_dead
from diagnosis.response.machine import Judged
from diagnosis.response.mirrored import turns_made
from diagnosis.response.spells import Spell
from replay.faults import FaultMode
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]

_LEAST_BLOCKS = 60  # of sound turning that the share of the wheels' difference is found in
_AROUND = 4  # blocks around the spell in which its ends may be
_FITS = 0.3  # misfit of the yaw rate, by its own size: more is a machine that turns by something else
_ALIKE_BLOCKS = 8.0  # of the noise: its blocks are no independent ones
_MOST_ERROR = 0.15
_SURE = 2.5  # standard errors
_MIDDLE = 0.5
_PAIR = 2  # wheels, of which each turns the body alone
_LIES = -0.5, 1.6  # what a share may be at all
_OPPOSITE = (
    0.5  # of the difference of two sides' deviations: a smaller sum is a turn, of one wheel's fault they are alike
)
_TOO = 0.5  # of the deviation beside the yaw rate that a wheel has beside its command: then both say that it is wrong
_EITHER_WAY, _TOGETHER = 0.3, 0.5  # of a turn as the machine is built, and correlation: less tells no direction
_LEAST_SPELL, _BETTER = 6, 0.5  # blocks; of the misfit of any wheel's gain, that a fault of the yaw rate leaves


class Turning(NamedTuple):
    """How the body is turned by its wheels: the yaw rate and the side of each wheel.

    Attributes
    ----------
    yaw : Array, shape (b,)
        Measured yaw rate [rad/s].
    sides : Mapping[str, float]
        1 for wheels of the right, -1 for those of the left; of a machine that steers, those of the axle that it does not steer.
    """

    yaw: Array
    sides: Mapping[str, float]


def turning_of(judged: Mapping[str, Judged], geometry: Geometry | None, yaw: Array | None) -> Turning | None:
    """The body as it is turned by its wheels; None where no yaw rate is known, or a side has no wheel.

    `yaw` of shape (blocks,) [rad/s].
    """
    sides = None if yaw is None else _sides(judged, geometry) or _unsteered(judged, geometry)
    return None if yaw is None or sides is None else Turning(yaw, sides)


def _sides(judged: Mapping[str, Judged], geometry: Geometry | None) -> dict[str, float] | None:
    """1 for wheels of the right, -1 for those of the left; None where a side has no wheel, or one is steered."""
    if geometry is None:
        return None
    fixed = {w: p for w in judged if (p := geometry.wheels.get(w)) is not None and p.axle == "fixed" and p.y != 0.0}
    if len(fixed) < len(judged) or len({p.y > 0.0 for p in fixed.values()}) < 2:
        return None
    return {w: -1.0 if p.y > 0.0 else 1.0 for w, p in fixed.items()}


def _unsteered(judged: Mapping[str, Judged], geometry: Geometry | None) -> dict[str, float] | None:
    """The same of the wheels that no steering turns, whose difference makes the yaw rate whatever the others do; None where that is no single pair."""
    if geometry is None:
        return None
    fixed = {w: j for w, j in judged.items() if (p := geometry.wheels.get(w)) is not None and p.axle == "fixed"}
    return _sides(fixed, geometry) if len(fixed) == _PAIR else None


def track_of(judged: Mapping[str, Judged], geometry: Geometry | None) -> float | None:
    """Between the middle of the right wheels and that of the left ones [m]; None where a wheel is steered, or a side has none."""
    sides = _sides(judged, geometry)
    if sides is None or geometry is None:
        return None
    right, left = (float(np.mean([geometry.wheels[w].y for w, s in sides.items() if s == one])) for one in (1.0, -1.0))
    return left - right


def unasked_turn(
    wheel: str, spell: Spell, judged: Mapping[str, Judged], geometry: Geometry | None, yaw: Array | None
) -> bool:
    """Whether a deviation is a turn of the machine of which the log has neither a command nor a measurement: the other side makes it, too, the other way.

    Parameters
    ----------
    wheel : str
        The wheel.
    spell : Spell
        Of it.
    judged : Mapping[str, Judged]
        All wheels.
    geometry : Geometry or None
        Says which wheels are on one side.
    yaw : Array or None, shape (n,)
        Measured yaw rate [rad/s].
    """
    if yaw is not None or spell.mode in (FaultMode.STUCK, FaultMode.NOISY) or not _told_no_turn(judged):
        return False
    sides = _sides(judged, geometry)
    if sides is None:
        return False
    part = slice(spell.start, spell.stop)
    off = {w: _off(j)[part] for w, j in judged.items()}
    near, far = (
        np.mean([off[w] for w in sides if (sides[w] == sides[wheel]) is same], axis=0) for same in (True, False)
    )
    known = np.isfinite(near) & np.isfinite(far)
    both, apart = (float(np.sum(x[known] ** 2)) for x in (near + far, near - far))
    return bool(known.any()) and both < _OPPOSITE**2 * apart


def _off(one: Judged) -> Array:
    """A wheel's speed less what its command makes of it [m/s], NaN where that says nothing, shape (b,)."""
    b = one.wheel.blocks
    known = np.isfinite(b.low) & np.isfinite(b.high)
    return b.mean - np.where(known, 0.5 * (np.where(known, b.low, 0.0) + np.where(known, b.high, 0.0)), np.nan)


def _told_no_turn(judged: Mapping[str, Judged]) -> bool:
    """Whether all wheels are told the same all the time."""
    first, *others = (j.data for j in judged.values())
    return first.commands.shape[1] == 1 and all(np.array_equal(first.asked, d.asked, equal_nan=True) for d in others)


def turns_with(wheel: str, spell: Spell, judged: Mapping[str, Judged], turning: Turning | None) -> bool | None:
    """Whether the body turns as the reading of a wheel says in a spell; None where that cannot be told.

    Parameters
    ----------
    wheel : str
        The wheel.
    spell : Spell
        Of it.
    judged : Mapping[str, Judged]
        All wheels.
    turning : Turning or None
        How the body is turned.
    """
    if turning is None or wheel not in turning.sides:
        return None
    one, part = judged[wheel], slice(spell.start, spell.stop)
    b = one.wheel.blocks
    width = int(b.start[1]) if b.start.size > 1 else 1
    if len(judged) > _PAIR and falls_dead(one.wheel.samples, spell.start * width, one.wheel.dt):
        return (
            None  # a loop that winds up behind a dead sensor turns the body, too, against the other wheels of its side
        )
    should = b.mean * np.nan if not one.response.answered else 0.5 * (b.low + b.high)
    should = should if one.speed is None else one.speed
    share = turning.sides[wheel] / sum(s == turning.sides[wheel] for s in turning.sides.values())
    apart = difference(judged, turning)
    sound = np.isfinite(apart) & np.isfinite(turning.yaw) & one.driving
    for j in judged.values():
        for s in j.spells:
            sound[max(0, s.start - _AROUND) : s.stop + _AROUND] = False
    sound[max(0, spell.start - _AROUND) : spell.stop + _AROUND] = False
    found = fitted(apart, turning.yaw, sound)
    if found is None:
        return None
    gain, offset, noise = found
    x = gain * share * (b.mean - should)[part]
    z = (turning.yaw - offset - gain * apart)[part] + x
    known = np.isfinite(x) & np.isfinite(z)
    power = float(x[known] @ x[known])
    if power == 0.0:
        return None
    told = float(x[known] @ z[known]) / power
    rest = float(np.sqrt(np.mean((z - told * x)[known] ** 2)))
    error = max(noise, rest) * np.sqrt(_ALIKE_BLOCKS / power)
    if error > _MOST_ERROR or not _LIES[0] < told < _LIES[1] or abs(told - _MIDDLE) < _SURE * error:
        return None
    return told > _MIDDLE


def difference(judged: Mapping[str, Judged], turning: Turning) -> Array:
    """Mean speed of the wheels of the right less that of the left [m/s], shape (b,)."""
    return np.asarray(
        sum(
            side / sum(s == side for s in turning.sides.values()) * judged[w].wheel.blocks.mean
            for w, side in turning.sides.items()
        )
    )


def fitted(apart: Array, yaw: Array, sound: NDArray[np.bool_], part: float = 0.8) -> tuple[float, float, float] | None:
    """Yaw rate by the difference of the sides: gain, offset and usual misfit [rad/s], as they are in a part of what is sound.

    None where the one does not make the other. Arrays of shape (blocks,).
    """
    if np.count_nonzero(sound) < _LEAST_BLOCKS:
        return None
    columns, kept = np.column_stack([apart, np.ones(apart.size)]), sound.copy()
    weights: Array = np.zeros(2)
    for _ in range(5):
        weights = np.asarray(np.linalg.lstsq(columns[kept], yaw[kept], rcond=None)[0], dtype=np.float64)
        off = np.abs(yaw - columns @ weights)
        kept = sound & (off <= np.quantile(off[sound], part))
    noise = 1.48 * float(np.quantile(off[sound], min(0.5, 0.625 * part)))
    made = float(np.std(weights[0] * apart[sound]))
    if noise > _FITS * made or made == 0.0:  # a yaw rate that is one value has nothing of the wheels
        return None
    return float(weights[0]), float(weights[1]), noise


def turns_other_way(judged: Mapping[str, Judged], geometry: Geometry | None, turning: Turning | None) -> bool:
    """Whether the sides go apart the other way than the machine file has it, by the commanded turns and the yaw rate as far as each is known.

    Either of these alone may have the wrong sign: where they contradict each other nothing is said against the wheels.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    geometry : Geometry or None
        Says which wheels are on one side.
    turning : Turning or None
        How the body is turned.
    """
    answers = {w: j.response for w, j in judged.items() if j.response.answered}
    made = list(turns_made({w: j.data for w, j in judged.items()}, answers, geometry).values())
    told = float(np.median(made)) if made else 0.0
    signs = np.sign(told) if abs(told) > _EITHER_WAY else 0.0
    if turning is not None:
        apart = difference(judged, turning)
        known = np.isfinite(apart) & np.isfinite(turning.yaw)
        moves = np.count_nonzero(known) > 1 and min(np.ptp(x[known]) for x in (apart, turning.yaw)) > 0.0
        alike = float(np.corrcoef(apart[known], turning.yaw[known])[0, 1]) if moves else 0.0
        signs += np.sign(alike) if abs(alike) > _TOGETHER else 0.0
    return bool(signs < 0.0)


def wrong_yaw_rate(spell: Spell, one: Judged) -> bool:
    """Whether a deviation beside the other side and the yaw rate is the yaw rate's fault rather than a wheel's.

    A wheel that reads a share of its speed is off by a share of what it reads, whether the machine turns or not. A yaw rate that is dead,
    frozen, scaled or shifted puts the wheel off by a share of the difference of the sides and by a constant: a·(y − x) + b. So does a reading
    that is shifted, but that one is off its command, too.

    Parameters
    ----------
    spell : Spell
        Of the wheel.
    one : Judged
        The wheel.
    """
    if one.across is None or one.speed is None or spell.own or not spell.unspecific:
        return False
    part = slice(spell.start, spell.stop)
    y, x, view = one.wheel.blocks.mean[part], one.across[part], one.speed[part]
    known = np.isfinite(y) & np.isfinite(x) & np.isfinite(view)
    if np.count_nonzero(known) < _LEAST_SPELL:
        return False
    y, x, off = y[known], x[known], (y - view)[known]
    b = one.wheel.blocks
    beside_command = np.nan_to_num(beyond(b.mean, b.low, b.high)[part][known])
    if float(np.sum(beside_command**2)) > _TOO**2 * float(np.sum(off**2)):
        return False
    by_wheel = min(_rest(off, y[:, np.newaxis]), _rest(off, x[:, np.newaxis]))
    return bool(_rest(off, np.column_stack([y - x, np.ones(y.size)])) < _BETTER * by_wheel)


def _rest(off: Array, columns: Array) -> float:
    """Mean square that columns leave of a deviation, each of them taken as one degree of freedom."""
    left: Array = np.asarray(off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0], dtype=np.float64)
    return float(np.sum(left**2)) / max(off.size - int(columns.shape[1]), 1)
