"""The yaw rate by the difference of the sides as a mission's turns have it: gain and constant, and the sign that a gyro counts with.

Straight driving fits any gain: of a mission that hardly turns, a gyro that is frozen in its longest turn gives a compromise that explains neither. The gain is
hence sought in the turns as well, from the middle of what each of them says.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.turning import Turning, fitted

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_TURNS = 0.35  # of the usual difference of the sides
_LEAST_TURNS = 40  # blocks
_SCALE, _ROUNDS = 1.48, 8  # of a median misfit; of an estimate
_PART = 0.55  # of the turns, in which the gyro is sound
_BETTER = 0.7  # of the misfit in turns: a gain by them is another one
_FITS = 0.3  # of what the wheels make: what that gain may leave of most turns
_SURE = 0.15  # of what the wheels make, for a sign
_OTHER_SIGN = (
    "All through the mission the gyro (imu.yaw_rate) turns against the {wheels}, which follow their commands: it reads {share:.2f} × what their sides make of the "
    "turns: its sign, or its mounting, is wrong, or left and right are exchanged with the commands."
)


def usual_turns(apart: Array, yaw: Array, sound: Flags, part: float) -> tuple[float, float, float] | None:
    """Gain [1/m], constant [rad/s] and usual misfit [rad/s] of the yaw rate by the difference of the sides; None where the one does not make the other.

    Parameters
    ----------
    apart : Array, shape (b,)
        Mean speed of the right wheels less that of the left ones [m/s].
    yaw : Array, shape (b,)
        Measured yaw rate [rad/s].
    sound : Flags, shape (b,)
        Blocks that count.
    part : float
        Share of what is sound in which the gyro is as usual.
    """
    found = fitted(apart, yaw, sound, part)
    by_turns = _by_turns(apart, yaw, sound)
    if by_turns is None:
        return found
    use = sound & _turned(apart, sound)
    off = {k: _misfit(apart, yaw, use, f) for k, f in enumerate((found, by_turns)) if f is not None}
    if 0 in off and off[1] >= _BETTER * off[0]:
        return found
    return by_turns


def against_the_wheels(gain: float, noise: float, apart: Array, turning: Turning, across: float | None) -> str:
    """A sentence where the yaw rate has the other sign than the wheels' turns all through; empty else.

    Parameters
    ----------
    gain : float
        Of the yaw rate by the difference of the sides [1/m].
    noise : float
        Usual misfit [rad/s].
    apart : Array, shape (k,)
        That difference where the mission is sound [m/s].
    turning : Turning
        How the body is turned.
    across : float or None
        Between the sides [m]; None where it is not known.
    """
    usual = float(np.quantile(np.abs(gain * apart), 0.9)) if apart.size and turning.sides else 0.0
    if gain >= 0.0 or across is None or noise > _SURE * usual:
        return ""
    return _OTHER_SIGN.replace("{share:.2f}", f"{gain * across:.2f}".replace("-", "−"))


def _turned(apart: Array, sound: Flags) -> Flags:
    return np.abs(apart) > _TURNS * float(np.quantile(np.abs(apart[sound]), 0.9))


def _misfit(apart: Array, yaw: Array, use: Flags, found: tuple[float, float, float]) -> float:
    """What a gain and a constant leave of most turns, of what they make [1]."""
    gain, constant, _ = found
    left = np.abs(yaw - constant - gain * apart)[use]
    return float(np.quantile(left, _PART)) / max(float(np.median(np.abs(gain * apart[use]))), 1e-12)


def _by_turns(apart: Array, yaw: Array, sound: Flags) -> tuple[float, float, float] | None:
    """What `usual_turns` returns, by the turns alone; None where there are few, or most of them have another gain each."""
    if not sound.any():
        return None
    use = sound & _turned(apart, sound)
    straight = sound & ~use
    if np.count_nonzero(use) < _LEAST_TURNS or not straight.any():
        return None
    constant = float(np.median(yaw[straight]))
    gain = float(np.median((yaw[use] - constant) / apart[use]))
    for _ in range(_ROUNDS):
        constant = float(np.median((yaw - gain * apart)[straight]))
        off = np.abs(yaw - constant - gain * apart)
        kept = use & (off <= np.quantile(off[use], _PART))
        gain = float(apart[kept] @ (yaw[kept] - constant)) / max(float(apart[kept] @ apart[kept]), 1e-12)
    off = np.abs(yaw - constant - gain * apart)
    noise = _SCALE * float(np.quantile(off[sound], min(0.5, 0.625 * _PART)))
    nothing = abs(gain) * float(np.median(np.abs(apart[use]))) < 1e-9  # a yaw rate that is one value
    if nothing or _misfit(apart, yaw, use, (gain, constant, noise)) > _FITS:
        return None
    return gain, constant, noise
