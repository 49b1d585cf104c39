"""How each wheel's recorded speed follows the robot's: its scale, its side, and which way it counts, found in a log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.signals.signal import Signal

Array = NDArray[np.float64]

_MOST = 6000  # samples of a fit
_STEP_S = 0.05
_LEAST = 50
_DELAYS_S = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7)
_LAGS_S = (0.0, 0.1, 0.3, 0.8)
_TRIMMED = 0.2  # of the samples with the largest residuals are left out, twice: drives that were faulty for a time
_SOUND = 0.8  # share of the variance that a fit must explain
_TURNS = 0.05  # rad/s; standard deviation of a yaw rate that turns show in
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


def wheel_motion(
    wheel: Signal, speed: Signal, turn: Signal | None, lateral: Signal | None = None
) -> WheelMotion | None:
    """Fit one wheel to the robot's motion by least trimmed squares; None where the log does not show it.

    The wheel may answer late and slowly: the delay and lag that explain it best are taken.

    Parameters
    ----------
    wheel : Signal
        Speed of the wheel in any unit.
    speed, turn : Signal
        The robot's speed [m/s] and yaw rate [rad/s], commanded or measured; None where there is no yaw rate.
    lateral : Signal or None
        Its speed to the left [m/s], which wheels with rollers follow.
    """
    if len(wheel.stamps) < _LEAST:
        return None
    step = max(int(np.median(np.diff(wheel.stamps))), int(_STEP_S * 1e9))
    at = np.arange(int(wheel.stamps[0]), int(wheel.stamps[-1]), step)[:_MOST]
    y = held(wheel, at)
    parts = np.column_stack([held(s, at) for s in (speed, turn, lateral) if s is not None])
    known = np.isfinite(y) & np.isfinite(parts).all(axis=1)
    if known.sum() < _LEAST or np.std(parts[known, 0]) < _MOVES:
        return None
    parts[~np.isfinite(parts)] = 0.0
    parts[:, np.std(parts[known], axis=0) < _MOVES] = 0.0
    best: tuple[float, Array] = (0.0, np.zeros(3))
    for lag in _LAGS_S:
        slow = _lagged(parts, 1 - np.exp(-step * 1e-9 / lag)) if lag else parts
        for delay in sorted({round(d * 1e9 / step) for d in _DELAYS_S}):
            use = known[delay:]
            if use.sum() < _LEAST:
                continue
            found = _trimmed(slow[: len(slow) - delay][use], y[delay:][use])
            best = max(best, found, key=lambda f: f[0])
    if best[0] < _SOUND or best[1][0] == 0:
        return None
    gain = float(best[1][0])
    side = float(-best[1][1] / gain) if turn is not None and best[1][1] != 0 else None
    return WheelMotion(gain, side, best[0])


def _lagged(x: Array, a: float) -> Array:
    """First-order lag y += a (x − y) of each column."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([a], [1.0, a - 1.0], x, axis=0, zi=(1 - a) * x[:1])[0])


def held(signal: Signal, at: NDArray[np.int64]) -> Array:
    """Last value before each moment; NaN before the first. `at` [ns] and the result of shape (k,)."""
    index = np.searchsorted(signal.stamps, at, side="right") - 1
    return np.where(index >= 0, signal.values[np.maximum(index, 0)], np.nan)


def correlation(one: Signal, other: Signal) -> float:
    """Correlation of a signal with another one [1], at the stamps of the former; 0 where either hardly changes, or is too short."""
    a, b = np.asarray(one.values, np.float64), held(other, one.stamps)
    known = np.isfinite(a) & np.isfinite(b)
    return _correlation(a[known], b[known]) if np.count_nonzero(known) >= _LEAST else 0.0


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


def backwards(left: Signal, right: Signal, yaw: Signal | None) -> tuple[str, bool]:
    """Which side counts backwards, where no command tells it, and whether that is sure.

    A robot turns left by what its right wheels run faster: the yaw rate goes with the difference of the two sides, or with
    their sum where one of them is mirrored, and its sign tells which. Without turns, sides that always run against each
    other tell that one is mirrored, but not which.

    Parameters
    ----------
    left, right : Signal
        Speed of a wheel of each side, in one unit.
    yaw : Signal or None
        Measured yaw rate [rad/s].

    Returns
    -------
    str
        ``left``, ``right``, or empty where neither does.
    bool
        Whether the side is known rather than supposed.
    """
    at = left.stamps
    a, b = left.values, held(right, at)
    turn = np.zeros(len(at)) if yaw is None else held(yaw, at)
    known = np.isfinite(a) & np.isfinite(b) & np.isfinite(turn)
    a, b, turn = a[known], b[known], turn[known]
    if len(a) < _LEAST:
        return "", False
    if np.std(turn) >= _TURNS:
        apart, same = _correlation(b - a, turn), _correlation(b + a, turn)
        if abs(same) > 0.7 and abs(same) > abs(apart) + 0.2:
            return ("left" if same > 0 else "right"), True
        return "", True
    moving = np.abs(a) > 0.2 * np.max(np.abs(a), initial=0.0)
    against = moving.sum() >= 5 and np.mean(a[moving] * b[moving] < 0) >= 0.8
    return ("right", False) if against and (yaw is None or np.median(np.abs(turn[moving])) < 0.2) else ("", False)


def _correlation(x: Array, y: Array) -> float:
    return float(np.corrcoef(x, y)[0, 1]) if np.std(x) > 0 and np.std(y) > 0 else 0.0
