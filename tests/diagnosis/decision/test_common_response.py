"""What all wheels' speed per opening has in common before and after a moment, at the same speeds."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.decision.common_response import _largest

N = 160
RNG = np.random.default_rng(7)
LEVEL = np.log(np.repeat(RNG.choice([0.3, 0.6, 1.0, 1.5], N // 8), 8))
VALVE = 0.4 * LEVEL + 0.02 * RNG.standard_normal(N)  # no straight line: faster per opening where it is driven faster


@pytest.mark.parametrize("change", [-0.35, 0.3])
def test_what_changes_at_the_same_speeds_is_found_with_its_moment(change: float) -> None:
    found = _largest(LEVEL, VALVE + change * (np.arange(N) >= 90))
    assert found is not None
    assert found[0] == pytest.approx(change, abs=0.05)
    assert abs(found[1] - 90) <= 8


def test_faster_driving_is_no_change() -> None:
    level = np.where(np.arange(N) < 80, LEVEL, LEVEL + 0.6)
    found = _largest(level, 0.4 * level)
    assert found is None or abs(found[0]) < 0.05


def test_what_is_never_driven_alike_is_not_known() -> None:
    level = np.where(np.arange(N) < 80, 0.0, 1.0)
    found = _largest(level, level)
    assert found is None or found[0] == 0.0
