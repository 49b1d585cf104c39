"""Noise, rounding step and relative delay of channels, found from the mission itself.

No healthy window is assumed: every figure is a low quantile over many short windows, so that faults in part of the
mission leave it alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.arrays.quantiles import median_of, quantile_of
from replay.arrays.sliding import mean_within, windowed
from replay.signals.resolution import rounding_step as rounding_step
from replay.signals.resolution import white_noise as white_noise
from replay.signals.resolution import windows as _windows

Array = NDArray[np.float64]

COARSE_STEP_S = 0.005  # slower logs do not fix the delay between a command and its measurement
_COARSE_SHARE = 0.3
_MOST_SHARE = 2.5  # of a reference that is white between its samples too it is 2: more is a fault
_GRID_PARTS, _GRID_SAMPLES, _GRID_SHARE = 20, 100, 0.4
_PLACES, _ALL, _SOME = 8000, slice(None), slice(None, None, 4)  # some are enough for a limit
_SOUND_SHARE = 0.25  # quantile of windows that stands for healthy ones
_QUIET_WINDOW_S, _QUIET_SHARE = 0.5, 0.4  # quantile of windows that stands for healthy ones
_FEWEST_PLACES = 50  # in which a delay can be compared
_HEALTHY_SHARE, _SOUND = 0.3, 10.0  # of the places; times their misfit


def moving_sum(x: NDArray[np.float64] | NDArray[np.bool_], width: int) -> Array:
    """Sum over a centred window of `width` samples, shape (n,); the window is cut at the ends, and to n.

    Sums of 1, 2, 4… samples are put together, so that an outlier reaches no sum beyond its window; counts need no such care.
    """
    width = min(width, x.size)
    if x.dtype == np.bool_:

        def counts(line: NDArray[Any], size: int) -> Array:
            upto = np.concatenate(([0], np.cumsum(line)))
            return np.asarray(upto[width : width + size] - upto[:size], dtype=np.float64)

        return windowed(counts, x, width // 2, max(0, width - 1) // 2)

    def sums_of(line: Array, size: int) -> Array:
        sums = np.asarray(line, dtype=np.float64)
        out, start, length = np.zeros(size), 0, 1
        while length <= width:
            if width & length:
                out += sums[start : start + size]
                start += length
            sums = sums[:-length] + sums[length:] if 2 * length <= width else sums
            length *= 2
        return out

    return windowed(sums_of, x, width // 2, max(0, width - 1) // 2)


def usual_rounding(values: Array) -> float:
    """Rounding step of a channel of which parts may be off their grid; 0 where most show none.

    A faulty channel's noise or loss of gain takes its values off the grid of the healthy ones.

    `values` of shape (n,); the step in their unit.
    """
    whole = rounding_step(values)
    if whole > 0.0 or values.size < _GRID_PARTS * _GRID_SAMPLES:
        return whole
    found = np.array([rounding_step(part) for part in np.array_split(values, _GRID_PARTS)])
    shown = found > 0.0
    return float(median_of(found[shown])) if np.mean(shown) > _GRID_SHARE else 0.0


def usual_distance(new: NDArray[np.bool_]) -> float:
    """Median distance of the first 20 000 new samples in steps. `new` of shape (n,)."""
    for size in (1 << 16, new.size):
        places = np.flatnonzero(new[:size])
        if places.size >= 20_000 or size == new.size:
            break
    return float(median_of(np.diff(places[:20_000])))


def quick_noise(residual: Array, dt: float) -> float:
    """Root mean square of what changes within half a second in a residual, in its median window; NaN where none.

    In the unit of `residual`, shape (n,); `dt` in s.
    """
    width = max(3, round(0.5 / dt))
    known = np.isfinite(residual)
    filled = np.where(known, residual, 0.0)
    count = moving_sum(known, width)
    mean = moving_sum(filled, width) / np.maximum(count, 1)
    return slow_mismatch(residual - mean, known & (count > 0.8 * width), dt, 0.5)


def slow_mismatch(residual: Array, use: NDArray[np.bool_], dt: float, quantile: float = 0.3) -> float:
    """Root mean square of a residual in its quieter windows: what healthy parts look like.

    Parameters
    ----------
    residual : Array, shape (n,)
        y − x.
    use : NDArray[np.bool_], shape (n,)
        Samples that count.
    dt : float
        Step [s].
    quantile : float
        Which window stands for healthy ones.

    Returns
    -------
    float
        The quantile over windows of 0.5 s with at least a quarter of their samples; NaN where there is none.
    """
    length = max(10, round(0.5 / dt))
    summed, counted = [np.zeros(0)], [np.zeros(0)]
    for part in blocks(residual.size, length):
        near = residual[part]
        kept = use[part] & np.isfinite(near)
        summed.append(_windows(np.where(kept, near, 0.0) ** 2, length).sum(axis=1))
        counted.append(_windows(kept.astype(np.float64), length).sum(axis=1))
    squares, counts = np.concatenate(summed), np.concatenate(counted)
    good = counts >= length / 4
    return float(quantile_of(np.sqrt(squares[good] / counts[good]), quantile)) if good.any() else float("nan")


def quiet_rms(x: Array, dt: float) -> float:
    """Root mean square of x in its quieter windows of half a second: healthy ones where less than half are faulty.

    NaN are left out; the result is NaN where no window is half full.

    `x` of shape (n,), `dt` in s; the result in the unit of x.
    """
    length = max(5, round(_QUIET_WINDOW_S / dt))
    windows = x[: x.size // length * length].reshape(-1, length)
    number = np.isfinite(windows).sum(axis=1)
    power = np.nansum(windows**2, axis=1) / np.maximum(number, 1)
    used = power[number >= length / 2]
    return float(np.sqrt(quantile_of(used, _QUIET_SHARE))) if used.size else float("nan")


def shifted(x: Array, lag: float) -> Array:
    """x delayed by `lag` steps (advanced where negative), interpolated between steps; NaN where nothing is known.

    Both of shape (n,), in one unit.
    """
    whole = int(np.floor(lag))
    part = lag - whole
    out = _moved(x, whole)
    return out if part < 1e-9 else (1 - part) * out + part * _moved(x, whole + 1)


def _moved(x: Array, lag: int) -> Array:
    if lag == 0:
        return x
    out = np.full_like(x, np.nan)
    if lag > 0:
        out[lag:] = x[:-lag]
    else:
        out[:lag] = x[-lag:]
    return out


def relative_lag(y: Array, x: Array, use: NDArray[np.bool_], least_lag: int, max_lag: int) -> float:
    """Delay of y against x in steps, to a tenth, by the smallest mean square of y(t) − x(t − lag) where x changes.

    What is ten times as large as the lower third counts no more than that, so that faults for half of the time leave the
    delay alone. It must lower the mean square by 2 % to be believed; a valve cannot answer before its command, so there
    `least_lag` is 0. A delay at which x is missing in nearly all of these places cannot be the one.

    `y`, `x` and `use` of shape (n,); lags in steps.
    """
    rate = np.abs(np.diff(x, prepend=x[:1]))
    smooth = moving_sum(np.nan_to_num(rate), 9) / 9
    moving = use & np.isfinite(y) & np.isfinite(x)
    if np.count_nonzero(moving) < 100:
        return 0.0
    moving &= smooth >= quantile_of(smooth[moving], 0.7)
    places = np.flatnonzero(moving)
    places = places[(places > max_lag) & (places < y.size - max_lag - 1)]
    places = places[:: max(1, places.size // _PLACES)]
    if places.size < _FEWEST_PLACES:
        return 0.0
    there, before = y[places], places - (max_lag + 1)

    def misfit(lag: float, some: slice = _ALL) -> Array:
        off = there[some] - x[max_lag + 1 - int(lag) :].take(before[some])
        return np.abs(off, out=off)

    def lower(lag: float) -> float:
        found = misfit(lag, _SOME)
        rank = round(_HEALTHY_SHARE * np.count_nonzero(found == found))  # NaN are sorted last
        least = float(np.partition(found, rank)[rank])
        return least if least == least else np.inf

    def mean_square(lag: float) -> float:
        found = misfit(lag)
        found = found[found == found]
        if found.size < _FEWEST_PLACES:  # x has gaps there
            return np.inf
        return float(np.mean(np.minimum(found, most) ** 2))

    steps = np.arange(max(least_lag, -max_lag), max_lag + 1, dtype=np.float64)
    most = _SOUND * min(lower(c) for c in steps) or np.inf
    misfits = np.array([mean_square(c) for c in steps])
    k, none = int(np.argmin(misfits)), int(np.flatnonzero(steps == max(0, least_lag))[0])
    if misfits[k] >= 0.98 * misfits[none]:
        k = none
    if not 0 < k < steps.size - 1 or not np.isfinite(misfits[k - 1 : k + 2]).all():
        return float(steps[k])
    # the tenth from a parabola: a mean of two samples would have less noise, and be preferred for that
    left, here, right = misfits[k - 1 : k + 2]
    bend = left - 2 * here + right
    part = 0.5 * (left - right) / bend if bend > 0.02 * here else 0.0
    return float(steps[k]) + round(float(np.clip(part, -0.5, 0.5)), 1)


def white_part(x: Array) -> Array:
    """What changes from sample to sample in x, from its second differences; smooth motion leaves none. Shape (n,)."""
    out = np.zeros(x.size)
    if x.size < 3:
        return out
    out[1:-1] = (x[2:] - 2 * x[1:-1] + x[:-2]) / np.sqrt(6.0)
    out[~np.isfinite(out)] = 0.0
    return out


def unresolved(
    residual: Array, x: Array, use: NDArray[np.bool_], noise: float, dt: float, known: float | None = None
) -> tuple[Array, float]:
    """What comes to y − x because a reference changes faster than the log's rate can resolve: a delay below a step decides.

    The share of the reference's white part that shows up in the residual is read off the mission: where that part is
    large, the lower quartile over windows of 0.3 s. It is near 0 where the delay is a whole number of steps.

    Parameters
    ----------
    residual, x : Array, shape (n,)
        y − x, and the reference.
    use : NDArray[np.bool_], shape (n,)
        Samples that count.
    noise : float
        Healthy noise of y − x.
    dt : float
        Step [s].
    known : float or None
        The share, where it is known from elsewhere.

    Returns
    -------
    power : Array, shape (n,)
        Variance that comes to the noise [unit²].
    share : float
        Share of the power of the white part that shows up; 0 where all is resolved.
    """
    kept = use & np.isfinite(residual) & np.isfinite(x)
    white = np.where(kept, white_part(x), 0.0)
    width = max(3, round(0.3 / dt))
    power = mean_within(white**2, width)
    lively = power > (3 * noise) ** 2
    share = _COARSE_SHARE if dt >= COARSE_STEP_S else 0.0
    if np.count_nonzero(lively) >= 10 * width:
        seen = mean_within(np.where(kept, residual, 0.0) ** 2, width)
        found = float(quantile_of(seen[lively] / power[lively], _SOUND_SHARE))
        share = max(share, found if found < _MOST_SHARE else 0.0)
    share = share if known is None else known
    if share <= 0.05:
        return np.zeros(x.size), 0.0
    return share * power, share
