"""No finding is surer than the surest ones turned out to be, and what is missing stays with the faults of its part."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.limited import MOST_CLAIMED, believed
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side


def _finding(p: float, side: Side, mode: FaultMode, *hypotheses: Hypothesis) -> Finding:
    return Finding(0, 10, side, mode, p, hypotheses, None, None, (), Tier.DIRECT)


def _believed(finding: Finding) -> Finding:
    (out,) = believed(Assessment(np.zeros(10, np.int8), findings=(finding,))).findings
    return out


@pytest.mark.parametrize("mode", list(FaultMode))
def test_the_surest_findings_leave_something_to_the_other_rows_of_their_part(mode: FaultMode) -> None:
    rows = (Hypothesis("sensor", mode.value, 0.999), Hypothesis("none", "healthy", 0.001))
    found = _believed(_finding(0.999, Side.SENSOR, mode, *rows))
    assert found.probability == MOST_CLAIMED
    assert (found.hypotheses[0].side, found.hypotheses[0].mode) == ("sensor", mode.value)
    assert found.hypotheses[0].p == pytest.approx(MOST_CLAIMED)
    assert {h.mode for h in found.hypotheses if h.side == "sensor"} == {m.value for m in FaultMode}
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)
    assert next(h.p for h in found.hypotheses if h.mode == "healthy") == 0.001  # it deviates all the same


def test_what_may_be_of_either_side_stays_of_either() -> None:
    halves = [Hypothesis(side, "no_signal", 0.495) for side in ("sensor", "actuator")]
    found = _believed(_finding(0.99, Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL, *halves))
    assert sum(h.p for h in found.hypotheses if h.mode == "no_signal") == pytest.approx(MOST_CLAIMED)
    assert {h.side for h in found.hypotheses} == {"sensor", "actuator"}


def test_what_is_less_sure_is_left_as_it_is() -> None:
    finding = _finding(0.96, Side.ACTUATOR, FaultMode.STUCK, Hypothesis("actuator", "stuck", 0.96))
    assert _believed(finding) is finding
