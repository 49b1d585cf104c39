from __future__ import annotations

import math

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Sat
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side


def finding(epsilon: Epsilon | None, sat: Sat | None, mode: FaultMode = FaultMode.OUTSIDE_TABLE) -> Finding:
    return Finding(0, 9, Side.SENSOR, mode, 0.9, (), epsilon, sat, (), Tier.MODEL)


def test_a_size_that_is_not_finite_is_not_known() -> None:
    sat = Sat(0.1, 0.1, 0.0, 0.2, "m/s")
    assert finding(Epsilon(0.3, math.nan, 0.4), sat).epsilon is None
    assert finding(None, Sat(0.1, math.inf, 0.0, 0.2, "m/s")).sat is None
    assert finding(Epsilon(1.3, 1.2, 1.4), sat).epsilon == Epsilon(1.3, 1.2, 1.4)
    assert finding(Epsilon(1.3, 0.9, 1.4), sat, FaultMode.INEFFICIENT).epsilon == Epsilon(1.0, 0.9, 1.0)
