from __future__ import annotations

import math

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis, Sat
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


def test_what_the_readings_do_not_bound_the_row_does_where_it_is_as_sure() -> None:
    def stuck(p: float, other: str = "inefficient") -> Finding:
        rows = (Hypothesis("sensor", "stuck", p), Hypothesis("sensor", other, 1.0 - p))
        return Finding(0, 9, Side.SENSOR, FaultMode.STUCK, p, rows, Epsilon(1.0, 0.0, 1.0), None, (), Tier.MODEL)

    assert stuck(0.97).epsilon == Epsilon(1.0, 1.0, 1.0)
    assert stuck(0.8).epsilon == Epsilon(1.0, 0.1, 1.0)
    assert stuck(0.8, "healthy").epsilon == Epsilon(1.0, 0.0, 1.0)
