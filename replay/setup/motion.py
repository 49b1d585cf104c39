"""How each wheel's recorded speed follows the robot's: its scale, its side, and which way it counts, found in a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.signals.signal import Signal

Array = NDArray[np.float64]

_MOST = 4000  # samples of a fit
_LEAST = 50
_DELAYS_S = np.arange(0.0, 1.01, 0.05)
_TRIMMED = 0.2  # of the samples with the largest residuals are left out, twice: drives that were faulty for a time
_SOUND = 0.8  # share of the variance that a fit must explain
_MOVES = 0.02  # m/s or rad/s; standard deviation from which a motion counts


@dataclass(frozen=True)
class WheelMotion:
    """recorded = gain · (v − y·ω), with the robot's speed v and yaw rate ω.

    Attributes
    ----------
    gain : float
        Recorded unit per m/s; negative where the wheel counts backwards.
    y : float or None
        Distance to the left of the middle [m]; None where the robot never turned.
    explained : float
        Share of the variance that this explains [1].
    """

    gain: float
    y: float | None
    explained: float


def wheel_motion(wheel: Signal, speed: Signal, turn: Signal | None) -> WheelMotion | None:
    """Fit one wheel to the robot's motion by least trimmed squares; None where the log does not show it.

    Parameters
    ----------
    wheel : Signal
        Speed of the wheel in any unit.
    speed, turn : Signal
        The robot's speed [m/s] and yaw rate [rad/s], commanded or measured; None where there is no yaw rate.
    """
    step = max(1, len(wheel.stamps) // _MOST)
    at, y = wheel.stamps[::step], wheel.values[::step]
    best: tuple[float, Array] | None = None
    for delay in _DELAYS_S:
        moment = at - int(delay * 1e9)
        parts = [_held(speed, moment)] + ([] if turn is None else [_held(turn, moment)])
        known = np.isfinite(y) & np.logical_and.reduce([np.isfinite(p) for p in parts])
        if known.sum() < _LEAST or np.std(parts[0][known]) < _MOVES:
            continue
        use = np.array([np.std(p[known]) >= _MOVES for p in parts])
        x = np.column_stack([p[known] if ok else np.zeros(known.sum()) for p, ok in zip(parts, use, strict=True)])
        found = _trimmed(x, y[known])
        if best is None or found[0] > best[0]:
            best = found
    if best is None or best[0] < _SOUND or best[1][0] == 0:
        return None
    gain = float(best[1][0])
    side = float(-best[1][1] / gain) if turn is not None and best[1][1] != 0 else None
    return WheelMotion(gain, side, best[0])


def _held(signal: Signal, at: NDArray[np.int64]) -> Array:
    """Last value before each moment; NaN before the first."""
    index = np.searchsorted(signal.stamps, at, side="right") - 1
    return np.where(index >= 0, signal.values[np.maximum(index, 0)], np.nan)


def _trimmed(x: Array, y: Array) -> tuple[float, Array]:
    """Least squares without the samples that fit worst: share explained, and the coefficients."""
    kept = np.ones(len(y), np.bool_)
    for _ in range(3):
        coefficients = np.linalg.lstsq(x[kept], y[kept], rcond=None)[0]
        residual = np.abs(y - x @ coefficients)
        kept = residual <= np.quantile(residual, 1 - _TRIMMED)
    spread = float(np.sum(y[kept] ** 2))
    rest = float(np.sum(residual[kept] ** 2))
    return (1 - rest / spread if spread > 0 else 0.0), np.asarray(coefficients)


def backwards(wheels: Mapping[str, Signal], left: Sequence[str], right: Sequence[str], yaw: Signal | None) -> bool:
    """Whether the wheels of the right side count against those of the left, by their signs alone.

    Parameters
    ----------
    wheels : Mapping[str, Signal]
        Speeds by wheel.
    left, right : Sequence[str]
        Wheels of each side.
    yaw : Signal or None
        Measured yaw rate [rad/s]: a robot that turns on the spot has opposite sides too.
    """
    a, b = (np.concatenate([_sampled(wheels[w], wheels[left[0]].stamps) for w in side[:1]]) for side in (left, right))
    moving = np.isfinite(a) & np.isfinite(b) & (np.abs(a) > 0.2 * np.nanmax(np.abs(a), initial=0.0))
    if moving.sum() < 5 or np.mean(a[moving] * b[moving] < 0) < 0.8:
        return False
    if yaw is None:
        return True
    turned = np.abs(_sampled(yaw, wheels[left[0]].stamps))[moving]
    return bool(np.nanmedian(turned) < 0.2)


def _sampled(signal: Signal, at: NDArray[np.int64]) -> Array:
    return _held(signal, at)
