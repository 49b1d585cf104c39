"""How probable a finding on an axle may be: its length, its company, and what becomes of the others."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.reliability import commanded, features_of, lost_by_model, paired, told_from_none, weighed
from diagnosis.steering.side_findings import SideFindings
from replay.faults import FaultMode, Side

DT, LENGTH = 0.01, 5


def finding(start: float, stop: float, mode: FaultMode = FaultMode.STUCK, tier: Tier = Tier.MODEL) -> Finding:
    hypotheses = (Hypothesis("actuator", mode.value, 0.98), Hypothesis("none", "healthy", 0.02))
    return Finding(
        start=round(start / DT),
        stop=round(stop / DT),
        side=Side.ACTUATOR,
        mode=mode,
        probability=0.98,
        hypotheses=hypotheses,
        epsilon=None,
        sat=None,
        evidence=("It is seen.",),
        tier=tier,
    )


def valves(*findings: Finding, sensors: tuple[Finding, ...] = ()) -> SideFindings:
    both = {Side.SENSOR: SideFindings(sensors, ()), Side.ACTUATOR: SideFindings(findings, ((0, 3),))}
    return weighed(both, LENGTH, DT)[Side.ACTUATOR]


def test_a_long_finding_alone_stays_nearly_certain() -> None:
    (found,) = valves(finding(10.0, 18.0)).findings
    assert 0.95 < found.probability <= 0.98
    assert_allclose(sum(h.p for h in found.hypotheses), 1.0)


def test_a_brief_one_stays_open() -> None:
    found = valves(finding(10.0, 11.5))
    assert found.findings == ()
    assert found.unexplained == ((0, 3), (200, 230))


def test_company_lowers_the_probability() -> None:
    (alone,) = valves(finding(10.0, 16.0)).findings
    first, _ = valves(finding(10.0, 16.0), finding(16.5, 30.0)).findings
    (beside,) = valves(finding(10.0, 16.0), sensors=(finding(12.0, 18.0),)).findings
    assert first.probability < alone.probability
    assert beside.probability < alone.probability
    assert first.evidence[-1].startswith("Findings of this length and company were right in")
    assert {h.mode: h.p for h in first.hypotheses}["healthy"] == pytest.approx(1.0 - first.probability)


def test_a_loss_of_a_valve_may_be_one_of_the_sensor() -> None:
    (found,) = valves(finding(10.0, 30.0, FaultMode.INEFFICIENT)).findings
    assert found.probability == pytest.approx(0.6)
    told = {(h.side, h.mode): h.p for h in found.hypotheses}
    assert told["sensor", "inefficient"] > 0.3
    assert sum(told.values()) == pytest.approx(1.0)
    (sensor,) = weighed(
        {Side.SENSOR: SideFindings((replace(finding(10.0, 30.0, FaultMode.INEFFICIENT), side=Side.SENSOR),), ())},
        LENGTH,
        DT,
    )[Side.SENSOR].findings
    assert sensor.probability > 0.9


def test_what_the_channel_itself_shows_is_left_alone() -> None:
    (found,) = valves(finding(10.0, 10.5, tier=Tier.SIGNAL)).findings
    assert found.probability == 0.98


def test_features() -> None:
    got = features_of((10.0, 20.0), FaultMode.NO_SIGNAL, [(20.5, 30.0)], [(18.5, 40.0)])
    assert_allclose(got, [np.log(6.0), 1.0, 0.0, 1.0])
    got = features_of((10.0, 12.0), FaultMode.STUCK, [(13.5, 30.0)], [(11.0, 40.0)])
    assert_allclose(got, [np.log(2.0), 0.0, 1.0, 0.0])


def test_a_partial_fault_beside_one_of_the_other_side_is_a_set_of_candidates() -> None:
    stuck, loss = finding(10.0, 18.0), finding(10.0, 12.0, FaultMode.INEFFICIENT)
    found = paired({Side.SENSOR: SideFindings((loss,), ()), Side.ACTUATOR: SideFindings((stuck,), ((0, 3),))})
    assert found[Side.ACTUATOR].findings == (stuck,)
    assert found[Side.ACTUATOR].unexplained == ((0, 3),)
    (doubted,) = found[Side.SENSOR].findings
    assert doubted.probability < 0.9
    assert_allclose(sum(h.p for h in doubted.hypotheses), 1.0)


def test_faults_at_other_times_do_not_doubt_each_other() -> None:
    both = {
        Side.SENSOR: SideFindings((finding(10.0, 18.0, FaultMode.NOISY),), ()),
        Side.ACTUATOR: SideFindings((finding(20.0, 28.0, FaultMode.INEFFICIENT),), ()),
    }
    assert paired(both) == both


def test_a_brief_loss_of_an_angle_that_is_measured_once_stays_open_however_well_its_valve_is_known() -> None:
    brief, long = (
        replace(finding(*span, FaultMode.INEFFICIENT), side=Side.SENSOR) for span in ((10.0, 13.0), (30.0, 40.0))
    )
    dead = replace(finding(20.0, 22.0), side=Side.SENSOR)
    both = {Side.SENSOR: SideFindings((brief, dead, long), ()), Side.ACTUATOR: SideFindings((), ())}
    sensor = lost_by_model(both, LENGTH, DT)[Side.SENSOR]
    assert [(f.start, f.mode) for f in sensor.findings] == [
        (dead.start, FaultMode.STUCK),
        (long.start, FaultMode.INEFFICIENT),
    ]
    assert sensor.unexplained == ((brief.start // LENGTH, brief.stop // LENGTH),)
    assert sensor.findings[0] == dead


@pytest.mark.parametrize(("low", "probability"), [(0.0, 0.6), (0.06, 0.6), (0.2, 0.98)])
def test_a_loss_that_its_own_bounds_do_not_tell_from_none_is_not_sure(low: float, probability: float) -> None:
    loss = replace(finding(10.0, 22.0, FaultMode.INEFFICIENT), epsilon=Epsilon(0.3, low, 0.7))
    stuck = replace(finding(30.0, 40.0), epsilon=Epsilon(1.0, low, 1.0))
    both = {Side.SENSOR: SideFindings((), ()), Side.ACTUATOR: SideFindings((loss, stuck), ((0, 3),))}
    told = told_from_none(both)[Side.ACTUATOR]
    assert [f.probability for f in told.findings] == [probability, 0.98]
    assert told.unexplained == ((0, 3),)
    assert told_from_none({Side.ACTUATOR: SideFindings((finding(1.0, 2.0, FaultMode.INEFFICIENT),), ())})


@pytest.mark.parametrize(
    ("opening", "refuted"), [(0.004, True), (0.3, False), (np.nan, False)], ids=["obeys", "elsewhere", "unknown"]
)
def test_an_opening_where_its_command_is_refutes_a_dead_valve_of_which_nothing_is_asked(
    opening: float, refuted: bool
) -> None:
    blocks, size = 400, 2000
    twice = SimpleNamespace(opening=np.full(blocks, opening), command=np.zeros(blocks), share=np.full(blocks, np.nan))
    noise = SimpleNamespace(white=1e-8, lsb=0.0)
    axle: Any = SimpleNamespace(
        blocks=SimpleNamespace(length=LENGTH, dt=DT * LENGTH, redundancy=twice, count=np.ones(blocks)),
        driven=SimpleNamespace(command=np.zeros(blocks)),
        model=SimpleNamespace(noise=noise, rate_error=1e-4, stop=0.5),
    )
    dead = SideFindings((finding(5.0, 15.0, FaultMode.NO_SIGNAL),), ())
    found = commanded(dead, np.zeros(size), axle)
    assert found == SideFindings((), () if refuted else ((100, 300),), ((100, 300),) if refuted else ())
