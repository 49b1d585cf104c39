"""Noise, rounding step and relative delay of channels, found from the mission itself.

No healthy window is assumed: every figure is a low quantile over many short windows, so that faults in part of the
mission leave it alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_WINDOW_S = 0.25


def rounding_step(values: Array) -> float:
    """Rounding step (LSB) of a channel; 0 where the values lie on no grid.

    Parameters
    ----------
    values : Array, shape (n,)
        New samples only; NaN are left out.
    """
    known = values[np.isfinite(values)][:200_000]
    steps = np.abs(np.diff(known))
    steps = steps[steps > 1e-12 * max(1.0, float(np.max(np.abs(known), initial=0.0)))]
    if steps.size < 20:
        return 0.0
    smallest = float(np.quantile(steps, 0.01))
    step = float(np.median(steps[steps < 1.5 * smallest]))
    multiple = steps / step
    step *= float(np.sum(multiple * np.round(multiple)) / max(float(np.sum(np.round(multiple) ** 2)), 1e-300))
    off = np.abs(steps / step - np.round(steps / step))
    small = steps < 50 * step
    return step if np.count_nonzero(small) >= 20 and float(np.mean(off[small] < 0.1)) > 0.97 else 0.0


def _windows(values: Array, length: int) -> Array:
    count = values.size // length
    return values[: count * length].reshape(count, length)


def white_noise(values: Array, dt: float) -> float:
    """Standard deviation of the white part of a sampled signal, from its second differences.

    Parameters
    ----------
    values : Array, shape (n,)
        Consecutive samples; windows with NaN or without change are left out.
    dt : float
        Distance of samples [s].

    Returns
    -------
    float
        The 40 % quantile over windows of 0.25 s (at least 12 samples); NaN where no window is usable.
    """
    second = values[2:] - 2 * values[1:-1] + values[:-2]
    blocks = _windows(second, max(12, round(_WINDOW_S / dt)))
    if not blocks.size:
        return float("nan")
    moving = np.mean(np.abs(blocks) > 0, axis=1) > 0.3
    rms = np.sqrt(np.mean(blocks**2, axis=1) / 6.0)
    rms = rms[moving & np.isfinite(rms)]
    return float(np.quantile(rms, 0.4)) if rms.size >= 3 else float("nan")


def slow_mismatch(residual: Array, use: NDArray[np.bool_], dt: float) -> float:
    """Root mean square of a residual in its quieter windows: what healthy parts look like.

    Parameters
    ----------
    residual : Array, shape (n,)
        y − x.
    use : NDArray[np.bool_], shape (n,)
        Samples that count.
    dt : float
        Step [s].

    Returns
    -------
    float
        The 30 % quantile over windows of 0.5 s with at least half of their samples; NaN where there is none.
    """
    length = max(10, round(0.5 / dt))
    kept = use & np.isfinite(residual)
    squares = _windows(np.where(kept, residual, 0.0) ** 2, length).sum(axis=1)
    counts = _windows(kept.astype(np.float64), length).sum(axis=1)
    good = counts >= length / 4
    return float(np.quantile(np.sqrt(squares[good] / counts[good]), 0.3)) if good.any() else float("nan")


def shifted(x: Array, lag: int) -> Array:
    """x delayed by `lag` steps (advanced where negative); NaN where nothing is known."""
    if lag == 0:
        return x
    out = np.full_like(x, np.nan)
    if lag > 0:
        out[lag:] = x[:-lag]
    else:
        out[:lag] = x[-lag:]
    return out


def relative_lag(y: Array, x: Array, use: NDArray[np.bool_], max_lag: int) -> int:
    """Delay of y against x in steps, by the smallest median |y(t) − x(t − lag)| where x changes.

    A change of lag must lower the median by 2 % to be believed.
    """
    rate = np.abs(np.diff(x, prepend=x[:1]))
    smooth = np.convolve(np.nan_to_num(rate), np.ones(9) / 9, mode="same")
    moving = use & np.isfinite(y) & np.isfinite(x)
    if np.count_nonzero(moving) < 100:
        return 0
    moving &= smooth >= np.quantile(smooth[moving], 0.7)
    places = np.flatnonzero(moving)
    places = places[(places >= max_lag) & (places < y.size - max_lag)]
    places = places[:: max(1, places.size // 20_000)]
    if places.size < 50:
        return 0
    misfits = np.array([np.nanmedian(np.abs(y[places] - x[places - lag])) for lag in range(-max_lag, max_lag + 1)])
    best = int(np.nanargmin(misfits)) - max_lag
    return best if misfits[best + max_lag] < 0.98 * misfits[max_lag] else 0
