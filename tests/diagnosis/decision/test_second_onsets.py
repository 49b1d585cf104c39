"""What filterpy says of onsets and of whole faults, beside each fault of a mission."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.decision.second_onsets import with_second_onsets
from diagnosis.decision.verified import verified
from diagnosis.pipeline import diagnose_mission
from diagnosis.results.assessment import Assessment
from diagnosis.results.result import Closeups, MissionResult
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, FaultSpec, Side
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.mission import Mission
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import EvidenceLevel, SimulationOptions
from replay.simulation.run import simulate_mission
from tests.diagnosis.decision.findings import finding

FAULTS = (
    FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 6.0, 9.0, 1.0, 0.2),
    FaultSpec("RL", Side.ACTUATOR, FaultMode.NO_SIGNAL, 14.0, 17.0),
    FaultSpec("FL", Side.SENSOR, FaultMode.INEFFICIENT, 18.0, 23.0, 0.5),
)


def diagnosed(evidence: EvidenceLevel) -> MissionResult:
    options = SimulationOptions(
        scenario="healthy", seed=3, duration_s=25.0, rate_hz=500.0, evidence=evidence, faults=FAULTS
    )
    made = simulate_mission(options)
    items = {
        n: Signal(n, made.stamps, x, SignalSource(column=n), "a.mcap", guessed=False) for n, x in made.columns.items()
    }
    signals = Signals(items, {})
    return diagnose_mission(Mission((), signals, align(signals)), haulotte())


@pytest.fixture(scope="module")
def direct() -> MissionResult:
    return diagnosed("direct")


def test_every_stated_fault_says_when_filterpy_sees_it_begin(direct: MissionResult) -> None:
    stated = [f for f in direct.report["intervals"] if f["probability"] > 0.9]
    assert len(stated) == len(FAULTS)
    for f in stated:
        (text,) = (e for e in f["evidence"] if "(filterpy)" in e)
        assert (
            "the same sample" in text
            or "ms later, for by its models the readings between fit a healthy part better than the fault." in text
            or "ms earlier, for by its models the readings between fit the fault better than a healthy part." in text
        )
        seen = float(text.split("onset at ")[1].split(" s")[0])
        assert seen == pytest.approx(f["start_s"], abs=0.006)


def test_whole_faults_are_the_same_rows_to_filterpy(direct: MissionResult) -> None:
    calls: list[tuple[int, int]] = []
    found = {v.id: v for v in verified(direct, lambda done, of: calls.append((done, of)))}
    assert calls[-1][0] == calls[-1][1] == len(found)
    for f in direct.report["intervals"]:
        if f["probability"] <= 0.9:
            continue
        one = found[f["id"]]
        assert one.row == f["mode"]
        assert one.gain > 50.0
        if f["mode"] == FaultMode.INEFFICIENT:
            assert one.epsilon is not None
            assert f["epsilon"] is not None
            assert one.epsilon.value == pytest.approx(f["epsilon"]["value"], abs=0.02)


def test_a_valve_behind_a_model_departs_from_the_expected_speed() -> None:
    result = diagnosed("base")
    valve = next(f for f in result.report["intervals"] if (f["component"], f["side"]) == ("RL", "actuator"))
    one = next(v for v in verified(result) if v.id == valve["id"])
    assert one.row is None
    assert one.gain > 10.0


def test_what_is_not_kept_is_said(direct: MissionResult) -> None:
    long = replace(direct, windows=Closeups(direct.columns["t"][:0].astype("int64"), {}))
    assert all("--start" in v.why for v in verified(long))
    bare = replace(direct, columns={"t": direct.columns["t"]})
    assert all("no comparison" in v.why for v in verified(bare))


def test_what_was_off_before_the_first_reading_that_is_looked_at_has_no_onset_there() -> None:
    """The first of the readings was given as the onset, half a second before the stated one, of one fault after another."""
    n, rng = 1000, np.random.default_rng(1)
    expected = 1.0 + 0.2 * np.sin(np.arange(n) / 20.0)
    residual = 0.4 + 0.01 * rng.standard_normal(n) - expected
    columns = {"residual": residual, "threshold": np.full(n, 0.03), "expected": expected}
    found = finding(Side.SENSOR, FaultMode.STUCK, 500, 800)
    side = Assessment(np.zeros(n, np.int8), findings=(found,), tier=Tier.DIRECT, columns=columns)
    ((told,),) = (a.findings for a in with_second_onsets({("FR", "sensor"): side}, 0.005).values())
    assert "sees no onset among them: by its models those of 500 ms before it fit the fault better" in told.evidence[-1]
