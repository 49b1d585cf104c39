"""Medians and quantiles are NumPy's to the last bit, and taken in a fraction of its time."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from replay.arrays.quantiles import median_known, median_of, quantile_known, quantile_of

SHARES = (0.0, 0.001, 0.25, 0.35, 0.5, 0.7, 0.95, 0.999, 1.0)


def columns() -> list[np.ndarray]:
    """Columns short and long, with ties, infinities and NaN, of several types."""
    rng = np.random.default_rng(1)
    out: list[np.ndarray] = [rng.normal(size=n) for n in (1, 2, 3, 4, 5, 8, 17, 100, 257, 1000, 4097)]
    out += [np.round(x, 1) for x in out]
    for x in out[:22]:
        y = x.copy()
        y[rng.integers(0, len(y), 1 + len(y) // 4)] = np.nan
        out.append(y)
    out += [np.array([np.inf, 1.0, 2.0, -np.inf]), np.array([0.0, -0.0, 0.0, -0.0]), np.full(5, np.nan), np.empty(0)]
    out += [
        np.array([1e308, 1.7e308, 1.5e308, 1.6e308]),
        np.arange(7),
        np.array([2**62 + 1, 3, 2**62 + 5, 9]),
        np.arange(8) > 3,
    ]
    out += [rng.normal(size=50).astype(np.float32), rng.normal(size=(6, 5)), rng.normal(size=300)[::3]]
    return out


def same(ours: Any, theirs: Any) -> None:
    assert np.shape(ours) == np.shape(theirs)
    assert np.asarray(ours).dtype == np.asarray(theirs).dtype
    assert np.array_equal(ours, theirs, equal_nan=True), (ours, theirs)


@pytest.fixture(autouse=True)
def quiet() -> Any:
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield


def test_numbers_are_those_of_numpy() -> None:
    for x in columns():
        before = x.copy()
        same(median_of(x), np.median(x))
        same(median_known(x), np.nanmedian(x))
        if x.dtype == bool or not x.size:  # NumPy raises too
            continue
        for q in SHARES:
            same(quantile_of(x, q), np.quantile(x, q))
            same(quantile_known(x, q), np.nanquantile(x, q))
        same(quantile_of(x, (0.05, 0.5, 0.95)), np.quantile(x, (0.05, 0.5, 0.95)))
        same(quantile_known(x, np.array([0.9, 0.1])), np.nanquantile(x, np.array([0.9, 0.1])))
        assert np.array_equal(x, before, equal_nan=True)


def test_along_an_axis_too() -> None:
    rng = np.random.default_rng(2)
    for shape in ((1, 1), (2, 3), (475, 3), (77, 4), (3, 900), (40, 41)):
        x = rng.normal(size=shape)
        gaps = np.where(rng.random(shape) < 0.3, np.nan, x)
        gaps[0] = np.nan
        for axis in (0, 1):
            for values in (x, gaps):
                same(median_of(values, axis=axis), np.median(values, axis=axis))
                same(median_known(values, axis=axis), np.nanmedian(values, axis=axis))
                same(quantile_known(values, 0.4, axis=axis), np.nanquantile(values, 0.4, axis=axis))
                same(quantile_of(values, 0.4, axis=axis), np.quantile(values, 0.4, axis=axis))
                same(median_known(values, axis=axis, keepdims=True), np.nanmedian(values, axis=axis, keepdims=True))


def test_other_ways_are_numpys() -> None:
    x = np.random.default_rng(3).normal(size=30)
    same(quantile_of(x, 0.3, method="lower"), np.quantile(x, 0.3, method="lower"))
    same(median_of([3.0, 1.0, 2.0]), np.median([3.0, 1.0, 2.0]))
    with pytest.raises(ValueError, match="range"):
        quantile_of(x, 1.5)


@pytest.mark.parametrize("size", [40, 200_000])
def test_they_take_less_time(size: int) -> None:
    x = np.random.default_rng(4).normal(size=size)

    def least(call: Callable[[], object]) -> float:
        taken = []
        for _ in range(5):
            begin = time.process_time()
            for _ in range(2 if size > 1000 else 300):
                call()
            taken.append(time.process_time() - begin)
        return min(taken)

    assert least(lambda: median_of(x)) < 0.9 * least(lambda: np.median(x))
    assert least(lambda: quantile_of(x, 0.4)) < 0.9 * least(lambda: np.quantile(x, 0.4))
