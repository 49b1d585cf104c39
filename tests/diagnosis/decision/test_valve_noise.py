"""Noise of a valve: its row where it stands alone and lasts, less sure where it is brief or passes into another row."""

from __future__ import annotations

import pytest

from diagnosis.decision.valve_noise import with_doubted_noise
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode, Side

from .findings import assessed, finding

DT = 0.001


def told(*findings: Finding, side: str = "actuator", part: str = "FR") -> list[Finding]:
    return list(with_doubted_noise({(part, side): assessed(*findings)}, ("front",), DT)[part, side].findings)


def noise(start: int, stop: int, side: Side = Side.ACTUATOR) -> Finding:
    return finding(side, FaultMode.NOISY, start, stop, p=0.96, epsilon=0.4)


def test_noise_that_stands_alone_and_lasts_is_as_sure_as_it_was() -> None:
    alone = noise(1_000, 9_000)
    far = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 12_000, 15_000)
    assert told(alone, far)[0] is alone


def test_noise_that_passes_into_another_row_may_be_of_none() -> None:
    loss = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, 9_300, 15_000)
    first, second = told(noise(1_000, 9_000), loss)
    assert second is loss
    rows = {h.mode: h.p for h in first.hypotheses}
    assert first.probability == rows["noisy"] == rows["outside_table"] == pytest.approx(0.48)
    assert sum(rows.values()) == pytest.approx(1.0)
    assert "passes into another fault" in first.evidence[-1]


def test_brief_noise_is_less_sure() -> None:
    (brief,) = told(noise(1_000, 3_000))
    assert brief.probability == pytest.approx(0.55)
    (longer,), (steered,) = (told(noise(1_000, 4_500), part=part) for part in ("FR", "front"))
    assert (longer.probability, steered.probability) == (0.96, pytest.approx(0.6))


def test_a_sensors_noise_is_left_as_it_is() -> None:
    own = noise(1_000, 2_000, Side.SENSOR)
    assert told(own, side="sensor") == [own]
