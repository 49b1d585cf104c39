"""A delay of less than two readings are apart is how a log is taken, and none of a part."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.estimation.simple_causes import Cause, Measured, below_limit
from replay.faults import FaultMode


@pytest.mark.parametrize(("every", "seconds", "below"), [(1, 0.025, False), (5, 0.025, True), (5, 0.06, False)])
def test_a_delay_within_one_reading_is_below_the_limit(every: int, seconds: float, *, below: bool) -> None:
    use = np.zeros(1_000, np.bool_)
    use[::every] = True
    measured = Measured(np.zeros(1_000), np.zeros(1_000), use, 0.01, ("y", "x"), "1", 0.01, 0.05)
    late = Cause(FaultMode.OUTSIDE_TABLE, "It comes late.", changes=True, late=True, seconds=seconds)
    assert below_limit(late, measured) is below
