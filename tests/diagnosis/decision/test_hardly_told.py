"""What is over at once, or may be nothing by its own bounds, is no longer worth a check."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis.decision.hardly_told import with_hardly_told
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side
from tests.diagnosis.decision.findings import assessed, finding, machine

DT = 1e-3
NOISE = finding(Side.SENSOR, FaultMode.NOISY, 1000, 2900)
LOSS = replace(finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 1000, 5000), epsilon=Epsilon(0.12, 0.0, 0.29))
GAIN = replace(finding(Side.ACTUATOR, FaultMode.OUTSIDE_TABLE, 1000, 1700), epsilon=Epsilon(-0.11, -0.24, 0.03))


def told(f: Finding, component: str = "FR") -> Finding:
    side = "sensor" if f.side is Side.SENSOR else "actuator"
    return with_hardly_told(machine(**{f"{component}_{side}": assessed(f)}), ("front",), DT)[component, side].findings[
        0
    ]


@pytest.mark.parametrize("f", [NOISE, replace(NOISE, tier=Tier.MODEL), LOSS, GAIN])
def test_it_is_less_than_is_worth_a_check(f: Finding) -> None:
    less = told(f)
    assert sum(h.p for h in less.hypotheses if h.mode != "healthy") == pytest.approx(0.55)
    assert "makes it less probable" in less.evidence[-1]


@pytest.mark.parametrize(
    "f",
    [
        replace(NOISE, stop=3100),
        replace(NOISE, tier=Tier.SIGNAL),
        replace(LOSS, tier=Tier.MODEL),
        replace(LOSS, epsilon=Epsilon(0.2, 0.06, 0.34)),
        replace(LOSS, epsilon=Epsilon(0.35, 0.0, 1.0)),
        replace(LOSS, epsilon=None),
        replace(GAIN, stop=3100),
        replace(GAIN, epsilon=Epsilon(-0.2, -0.3, -0.1)),
        replace(GAIN, mode=FaultMode.STUCK),
    ],
)
def test_what_lasts_or_has_a_size_stays(f: Finding) -> None:
    assert told(f) is f


def test_axles_stay() -> None:
    assert told(NOISE, "front") is NOISE
