"""A mission whose openings are in a wrong unit condemns no valve, and is not ready."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.channels.doubted_openings import without_valves
from diagnosis.pipeline import diagnose_mission
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.document import ReportDocument
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, FaultSpec, Side
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.mission import Mission
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import EvidenceLevel, SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

PAPER = haulotte()
STUCK = FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 20.0, 30.0, 1.0, 0.2)


def mission(evidence: EvidenceLevel, faults: tuple[FaultSpec, ...] = ()) -> SimulatedMission:
    return simulate_mission(
        SimulationOptions(scenario="healthy", seed=4, duration_s=60.0, rate_hz=100.0, evidence=evidence, faults=faults)
    )


def judged(recorded: SimulatedMission, scales: Mapping[str, float], unit: str = "1") -> ReportDocument:
    """The mission with openings (by the end of their names) that are so many times what they should be."""
    items = {}
    for name, x in recorded.columns.items():
        leaf = name.rpartition(".")[2]
        opens = leaf in ("u", "u_applied")
        source = SignalSource(column=name, unit=unit if opens else "")
        items[name] = Signal(name, recorded.stamps, x * scales.get(leaf, 1.0), source, "a.csv", guessed=False)
    signals = Signals(items, {})
    return diagnose_mission(Mission((), signals, align(signals)), PAPER).report


@pytest.mark.parametrize("evidence", ["spool", "direct"])
@pytest.mark.parametrize("scales", [{"u": 0.1}, {"u_applied": 0.1}, {"u_applied": 0.5}])
def test_a_wrong_unit_condemns_no_valve(evidence: EvidenceLevel, scales: Mapping[str, float]) -> None:
    report = judged(mission(evidence), scales)
    verdict = report["verdict"]
    assert (verdict["status"], verdict["cleared"], report["intervals"]) == ("not_assessed", False, [])
    assert verdict["title"] == "The unit of the valve openings is in doubt"
    assert "unit = " in verdict["to_clear"][0]["act"]
    assert any(
        "valve openings is in doubt" in row["why"] or "unit of wheel" in row["act"] for row in verdict["to_clear"]
    )
    assert not any("log steer.front.u (" in row["act"] for row in verdict["to_clear"])  # which is logged
    assert all(row["side"] != "actuator" or row["tier"] == "none" for row in report["coverage"])


def test_a_unit_that_is_left_open_condemns_none_and_sensors_are_judged() -> None:
    report = judged(mission("direct", (STUCK,)), {"u": 0.1, "u_applied": 0.1}, "% or V")
    assert report["verdict"]["status"] == "stop"
    assert {(f["component"], str(f["side"])) for f in report["intervals"]} == {("FR", "sensor")}
    assert not report["verdict"]["cleared"]


def test_a_speed_that_departs_beside_openings_that_were_left_out_is_of_either_side() -> None:
    """A stuck valve was its speed sensor's loss, p = 0.91."""
    valve = FaultSpec("FR", Side.ACTUATOR, FaultMode.STUCK, 20.0, 30.0, 1.0, 0.05)
    report = judged(mission("base", (valve,)), {"u": 0.1}, "% or V")
    assert all(
        f["tier"] == "direct" or f["side"] != "sensor" for f in report["intervals"] if f["mode"] == "inefficient"
    )
    assert all(f["probability"] < 0.6 for f in report["intervals"] if f["mode"] == "inefficient")


def test_of_a_finding_beside_openings_that_were_left_out_half_is_the_valves() -> None:
    rows = (Hypothesis("sensor", "inefficient", 0.9), Hypothesis("none", "healthy", 0.1))
    own = Finding(5, 9, Side.SENSOR, FaultMode.INEFFICIENT, 0.9, rows, None, None, ("text",), Tier.RESPONSE)
    steady = Assessment(np.zeros(10, np.int8), findings=(own, replace(own, mode=FaultMode.STUCK)), tier=Tier.RESPONSE)
    told = without_valves({("FR", "sensor"): steady, ("FR", "actuator"): steady}, HYDRAULIC)
    either, stuck = told["FR", "sensor"].findings
    assert (either.side, either.probability, stuck.side) == (Side.SENSOR_OR_ACTUATOR, 0.45, Side.SENSOR)
    assert sum(h.p for h in either.hypotheses) == pytest.approx(1.0)
    assert {(h.side, h.mode) for h in either.hypotheses} > {("actuator", "stuck"), ("actuator", "inefficient")}
    assert "looks the same" in either.evidence[-1]
    assert told["FR", "actuator"].tier is Tier.NONE


def test_a_mission_in_its_units_is_judged() -> None:
    report = judged(mission("direct"), {})
    assert "unit" not in report["verdict"]["title"]
    assert any(row["side"] == "actuator" and row["tier"] == "direct" for row in report["coverage"])
