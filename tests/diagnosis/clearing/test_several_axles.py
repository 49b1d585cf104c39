"""Three or more steered axles, or wheels that each steer alone: what one of them is off the others by."""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.axles import alone_limit, beside_others

SHARE = -float(np.log1p(-0.25))


def off() -> np.ndarray:
    """Rates of four steered wheels in windows [ln]: what their supply makes of them all, and a little of each."""
    rng = np.random.default_rng(8)
    return rng.normal(0.0, 0.3, (60, 1)) + rng.normal(0.0, 0.04, (60, 4))


def test_what_all_do_together_is_nobodys() -> None:
    beside = beside_others(off())
    assert all(np.nanmax(beside[:, j]) < alone_limit(beside, j, SHARE) for j in range(4))


def test_what_one_loses_for_some_seconds_is_its_own() -> None:
    x = off()
    x[20:24, 2] -= 0.5
    beside = beside_others(x)
    assert np.nanmax(beside[:, 2]) > alone_limit(beside, 2, SHARE)
    assert all(np.nanmax(beside[:, j]) < alone_limit(beside, j, SHARE) for j in (0, 1, 3))


def test_two_are_no_measure_of_each_other() -> None:
    assert np.isnan(beside_others(off()[:, :2])).all()
