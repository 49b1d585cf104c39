"""Largest, smallest, middle and mean value of sliding windows, in NumPy alone: importing `scipy.ndimage` takes longer than they do.

Long columns are worked on in parts that stay in the processor's cache; every sample goes through the same operations in the same
order as it would in one piece.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Beyond = Literal["constant", "edge", "symmetric"]

_PART = 1 << 14  # samples at a time
_WIDE = 4  # times the window, at least


def largest_within(x: Array, before: int, after: int, beyond: Beyond = "symmetric") -> Array:
    """Largest of the samples i − before … i + after, shape (n,), as `scipy.ndimage.maximum_filter1d` has it.

    Beyond the ends x goes on as its mirror image, or as `np.pad` has it. `x` of shape (n,), n > 0, without NaN.
    """
    return _extreme(x, before, after, np.maximum, beyond)


def smallest_within(x: Array, before: int, after: int, beyond: Beyond = "symmetric") -> Array:
    """Smallest of the samples i − before … i + after, shape (n,); see `largest_within`."""
    return _extreme(x, before, after, np.minimum, beyond)


def _extreme(x: Array, before: int, after: int, pick: np.ufunc, beyond: Beyond) -> Array:
    """Extremes of 1, 2, 4… samples are put together until two of them cover the window."""
    width = before + after + 1

    def extremes(best: Array, size: int) -> Array:
        length = 1
        while 2 * length <= width:
            best = pick(best[:-length], best[length:])
            length *= 2
        return np.asarray(pick(best[:size], best[width - length :]))

    return windowed(extremes, x, before, after, beyond)


def median_within(x: Array, reach: int) -> Array:
    """Median of the samples i − reach … i + reach, shape (n,), as `scipy.ndimage.median_filter` has it beside its nearest values.

    Of short windows; those of wide ones are slower than SciPy's. `x` of shape (n,), n > 0, without NaN.
    """
    width = 2 * reach + 1

    def medians(line: Array, _: int) -> Array:
        return np.asarray(np.partition(np.lib.stride_tricks.sliding_window_view(line, width), reach, axis=1)[:, reach])

    return windowed(medians, x, reach, reach, "edge")


def windowed(
    function: Callable[[Array, int], Array],
    x: NDArray[Any],
    before: int,
    after: int,
    beyond: Beyond = "constant",
) -> Array:
    """Apply a function of windows, part by part.

    Parameters
    ----------
    function : Callable
        Takes samples, shape (m + before + after,), and m; returns shape (m,), each of its own window alone.
    x : NDArray, shape (n,)
        All samples.
    before, after : int
        How far windows reach.
    beyond : str
        How x goes on beyond its ends, as `np.pad` has it.

    Returns
    -------
    Array, shape (n,)
        In the unit of what `function` returns.
    """
    found = (
        function(_beyond(x, start - before, stop + after, beyond), stop - start)
        for start, stop in _parts(x.size, before + after)
    )
    return _joined(found, x.size)


def mean_within(x: Array, width: int, beyond: Beyond = "constant") -> Array:
    """Mean of `width` samples around each one, shape (n,): `scipy.ndimage.uniform_filter1d` to the last digit.

    `x` of shape (n,), n > 0, finite, goes on beyond its ends as `np.pad` has it, with 0 unless told otherwise; of an even width one
    more sample lies before than after.
    """
    before = width // 2

    def means() -> Iterator[Array]:
        last = np.zeros(0, x.dtype)
        for start, stop in _parts(x.size, width):
            line = _beyond(x, max(start - 1, 0) - before, stop + width - before - 1, beyond)
            first = last if start else np.add.accumulate(line[:width])[-1:]
            sums = np.add.accumulate(np.concatenate([first, line[width:] - line[:-width]]))
            last = sums[-1:]
            yield (sums[1:] if start else sums) / width

    return _joined(means(), x.size)


def _parts(size: int, width: int) -> list[tuple[int, int]]:
    """Where parts begin and end, none of them shorter than windows of `width`."""
    part = max(_PART, _WIDE * width)
    starts = [k * part for k in range(max(1, size // part))]
    return list(zip(starts, [*starts[1:], size], strict=True))


def _beyond(x: NDArray[Any], start: int, stop: int, mode: Beyond = "constant") -> Array:
    """Samples start … stop − 1, also where these lie beyond the ends."""
    inside: Array = x[max(0, start) : stop]
    missing = max(0, -start), max(0, stop - x.size)
    return np.pad(inside, missing, mode=mode) if any(missing) else inside


def _joined(parts: Iterable[Array], size: int) -> Array:
    """Parts of a column, one after another; the only one as it is."""
    at, out = 0, np.empty(0)
    for part in parts:
        if part.size == size:
            return np.asarray(part)
        if not at:
            out = np.empty(size, part.dtype)
        out[at : at + part.size] = part
        at += part.size
    return out
