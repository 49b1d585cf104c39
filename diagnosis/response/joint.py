"""A speed channel beside the position of the same joint: one encoder, two channels.

Both come from one encoder, so that they agree where it fails: what they agree on clears nothing. Where they differ one of the two
channels is wrong; which one, the command says, or the other view of the wheel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.models import Beside, Blocks
from diagnosis.response.spells import Spell, spans_of
from diagnosis.results.assessment import Lack, Reason
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_BLOCKS = 80
_SMOOTH_BLOCKS = 9
_SAME = 0.9, 1.1  # gain of a speed that is its position's slope
_SHARE = 0.02  # of the speed
_MOVES = 0.3  # of the usual speed
_GOES_ON = 0.3  # of the blocks of a silent spell
_APART, _LEAST_APART = 2.5, 6  # usual misfits, and blocks, from which on speed and position differ


class Joint(NamedTuple):
    """What the position says.

    Attributes
    ----------
    view : Beside
        The speed by the position; its blame is that of the speed channel.
    gain : float
        Speed channel over the position's slope in most of the mission [1].
    """

    view: Beside
    gain: float

    @property
    def unlike(self) -> Reason | None:
        """Why nothing is judged where the speed is another than the position's slope over the whole mission; None where it is not."""
        if _SAME[0] < self.gain < _SAME[1]:
            return None
        return Reason(
            f"over the whole mission it reads {self.gain:.2f} × the slope of its own joint's position: a wrong unit, a scaled or a "
            "wrongly mapped channel",
            Lack.UNIT,
        )


def joint_of(
    blocks: Blocks, rolled: Array, beside: Beside | None, name: str, usual_mean: Array | None = None
) -> Joint | None:
    """The position's view of a wheel; None where it hardly moves.

    Parameters
    ----------
    blocks : Blocks
        The wheel.
    rolled : Array, shape (b,)
        Speed by the position [m/s]; NaN where unknown.
    beside : Beside or None
        Another view, which tells channels apart where no command does.
    name : str
        Signal that `rolled` is.
    usual_mean : Array or None, shape (b,)
        Readings in which the gain is found [m/s]; None for those of `blocks`.
    """
    y = blocks.mean if usual_mean is None else usual_mean
    use = np.isfinite(y) & np.isfinite(rolled)
    usual = float(np.quantile(np.abs(rolled[use]), 0.9)) if use.any() else 0.0
    moving = use & (np.abs(rolled) > _MOVES * usual)
    if usual == 0.0 or np.count_nonzero(moving) < _LEAST_BLOCKS:
        return None
    gain = float(np.median(y[moving] / rolled[moving]))
    if not 0.01 < abs(gain) < 100.0:
        return None
    speed = gain * rolled
    change = np.abs(np.gradient(np.where(np.isfinite(speed), speed, 0.0)))
    floor = 1.5 * float(np.median(np.abs(y - speed)[use])) + 0.01 * abs(gain) * usual
    noise = floor + _SHARE * np.abs(speed) + 0.5 * change
    return Joint(
        Beside(speed, noise, _blame(blocks, speed, beside), np.zeros(y.size), f"the position of its joint ({name})"),
        gain,
    )


def cut(spells: Sequence[Spell], joint: Joint | None, blocks: Blocks) -> list[Spell]:
    """Spells of a scale, cut where the position begins and ceases to contradict them: a slip or load beside them is no sensor's.

    Parameters
    ----------
    spells : Sequence[Spell]
        Of the wheel.
    joint : Joint or None
        Its position.
    blocks : Blocks
        The wheel.
    """
    if joint is None:
        return list(spells)
    out: list[Spell] = []
    for s in spells:
        if s.mode is FaultMode.NO_SIGNAL:
            out.append(s._replace(own=_goes_on(s, joint)))
            continue
        spans = _parted(blocks, joint) if s.unspecific else []
        inside = [(max(a, s.start), min(b, s.stop)) for a, b in spans if a < s.stop and b > s.start]
        at = s.start
        for a, b in inside:
            out += [s._replace(start=at, stop=a, kin=True)] if a > at else []
            out.append(s._replace(start=a, stop=b, own=True))
            at = b
        out += [s._replace(start=at, kin=bool(inside))] if at < s.stop else []
    return out


def rolling(asked: Flags, joint: Joint | None, still: float) -> Flags:
    """Blocks in which motion is asked for, or the position of the joint goes on, shape (b,).

    Parameters
    ----------
    asked : Flags, shape (b,)
        Where motion is asked for.
    joint : Joint or None
        What the position says.
    still : float
        What counts as standstill [m/s].
    """
    return asked if joint is None else asked | (np.abs(np.nan_to_num(joint.view.speed)) > still)


def _goes_on(spell: Spell, joint: Joint) -> bool:
    """Whether the position moves on in a spell in which the speed is silent."""
    part = slice(spell.start, spell.stop)
    return bool(np.mean(np.abs(joint.view.speed[part]) > _APART * joint.view.noise[part]) > _GOES_ON)


def _parted(blocks: Blocks, joint: Joint) -> list[tuple[int, int]]:
    """Blocks [start, stop) in which speed and position differ, a moment of standstill in between included."""
    off = np.nan_to_num(np.abs(blocks.mean - joint.view.speed) / joint.view.noise) * (joint.view.blame > 0.5)
    return [(a, b) for a, b in spans_of(off > _APART, _SMOOTH_BLOCKS) if b - a >= _LEAST_APART]


def _blame(blocks: Blocks, speed: Array, beside: Beside | None) -> Array:
    """Share of a misfit that is the speed channel's: by which of the two is further off what is expected."""
    if np.isfinite(blocks.low).any():
        away = [np.abs(x - np.clip(x, blocks.low, blocks.high)) / blocks.noise for x in (blocks.mean, speed)]
    elif beside is not None:
        away = [np.abs(x - beside.speed) / beside.noise for x in (blocks.mean, speed)]
    else:
        return np.full(speed.size, 0.5)
    kernel = np.ones(_SMOOTH_BLOCKS) / _SMOOTH_BLOCKS
    own, other = (np.convolve(np.nan_to_num(np.minimum(a, 8.0)), kernel, mode="same") for a in away)
    return np.asarray(1.0 / (1.0 + np.exp(-4.0 * (own - other))))
