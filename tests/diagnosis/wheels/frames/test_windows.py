"""Window means against a loop, and missions in parts against missions at once."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.wheels.frames import windows
from diagnosis.wheels.frames.windows import LARGEST, MISSING, WINDOWS, bounded, cuts, frames_at, windowed

DT = 0.04


@pytest.mark.parametrize("n", [1, 7, 400])
def test_means_over_windows(n: int) -> None:
    x = np.random.default_rng(n).normal(size=(n, 2))
    at = frames_at(n, DT)
    for (low, high), got in zip(WINDOWS, windowed(x, at, DT), strict=True):
        for k, middle in enumerate(at):
            first = min(max(middle + round(low / DT), 0), n - 1)
            last = min(max(middle + round(high / DT), first + 1), n)
            assert_allclose(got[k], x[first:last].mean(axis=0), atol=1e-12)


def test_parts_give_what_the_whole_gives(monkeypatch: pytest.MonkeyPatch) -> None:
    n = 3000
    x = np.random.default_rng(1).normal(size=(n, 3))
    at = frames_at(n, DT)
    whole = windowed(x, at, DT)
    monkeypatch.setattr(windows, "_CUT_FRAMES", 37)
    parts = [windowed(x[cut], mine, DT) for cut, mine in cuts(at, n, DT)]
    assert len(parts) > 10
    for k in range(len(WINDOWS)):
        assert_allclose(np.concatenate([p[k] for p in parts]), whole[k], atol=1e-9)


def test_nothing_unknown_or_huge_reaches_the_trees() -> None:
    assert_allclose(bounded(np.array([np.nan, np.inf, -np.inf, 3.0])), [MISSING, LARGEST, MISSING, 3.0])
