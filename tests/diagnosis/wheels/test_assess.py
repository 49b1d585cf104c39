"""Wheels judged by openings and speeds alone, on small simulated missions: each row on its side, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.assess import assess_components
from diagnosis.results.assessment import CODE, Assessment
from replay.control.loop import replay_loop
from replay.faults import FaultMode, FaultSpec, Side, State
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline, align
from replay.simulation.options import EvidenceLevel, SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign_of_rows

PAPER = haulotte()
RATE, SECONDS = 500, 40.0
Key = tuple[str, str]


def logged(coupling: str, *faults: FaultSpec, evidence: EvidenceLevel = "base") -> Signals:
    mission = simulate_mission(
        SimulationOptions(
            scenario="healthy",
            seed=1,
            duration_s=SECONDS,
            rate_hz=RATE,
            evidence=evidence,
            coupling=coupling,  # type: ignore[arg-type]
            faults=faults,
        )
    )
    return Signals(
        {
            name: Signal(name, mission.stamps, x, SignalSource(column=name), "a.mcap", guessed=False)
            for name, x in mission.columns.items()
        },
        {},
    )


def judged(coupling: str, *faults: FaultSpec) -> dict[Key, Assessment]:
    return assessed(align(logged(coupling, *faults)))


def assessed(line: Timeline) -> dict[Key, Assessment]:
    """Assessments of the wheels alone."""
    got = assess_components(line, replay_loop(line, PAPER), PAPER, PAPER.wheels, lambda text: None)
    return {key: a for key, a in got.assessments.items() if key[0] in PAPER.wheels}


ROWS = {
    "stuck": (FaultMode.STUCK, (1.0, 0.2), (1.0, 0.1)),
    "silent": (FaultMode.NO_SIGNAL, (1.0,), (1.0,)),
    "inefficient": (FaultMode.INEFFICIENT, (0.5,), (0.5,)),
    "noisy": (FaultMode.NOISY, (0.4, 0.1, 0.15), (0.5, 0.1, 0.1, 0.8)),  # ε, mean, deviation, correlation time
}
SENSOR_S, VALVE_S = (6.0, 13.0), (15.0, 25.0)
BOTH = pytest.mark.parametrize("coupling", ["free", "ground"])


def specs(row: str) -> tuple[FaultSpec, FaultSpec]:
    """One row of both tables, one after the other."""
    mode, sensor, valve = ROWS[row]
    return (
        FaultSpec("FR", Side.SENSOR, mode, *SENSOR_S, *sensor),
        FaultSpec("RL", Side.ACTUATOR, mode, *VALVE_S, *valve),
    )


@pytest.mark.turns("coupling")
@BOTH
@pytest.mark.parametrize("row", ROWS)
def test_each_row_is_found_on_its_side_and_wheel(row: str, coupling: str) -> None:
    got = judged(coupling, *specs(row))
    least = PAPER.limits.min_probability
    stated = {key: [f for f in a.findings if f.probability >= least] for key, a in got.items()}
    assert {key for key, findings in stated.items() if findings} <= {("FR", "sensor"), ("RL", "actuator")}
    for spec in specs(row):
        side = got[spec.component, spec.side.value]
        middle = slice(round((spec.start_s + 1) * RATE), round((spec.stop_s - 1) * RATE))
        if row == "inefficient" and spec.side is Side.ACTUATOR:  # half of a gain shows little on one wheel of four
            assert np.mean(side.states[middle] == CODE[State.HEALTHY]) < 0.1
            continue
        found = max(side.findings, key=lambda f: f.stop - f.start)
        jumps = spec.side is Side.SENSOR and spec.mode is not FaultMode.NOISY
        assert found.probability > (0.75 if spec.side is Side.SENSOR else 0.5)
        assert found.start / RATE == pytest.approx(spec.start_s, abs=0.003 if jumps else 1.5)
        assert found.stop / RATE == pytest.approx(spec.stop_s, abs=0.003 if jumps else 0.5)
        assert found.detected is not None
        assert 0 <= found.detected / RATE - found.start / RATE < 1.5
        if row == "silent" and spec.side is Side.ACTUATOR and coupling == "ground":
            continue  # the body pulls the wheel along: which row of its valve it is remains open
        assert found.mode is spec.mode
        if spec.mode is not FaultMode.NOISY:  # there the part that is lost and the one that is added look alike
            assert found.epsilon is not None
            assert found.epsilon.value == pytest.approx(spec.epsilon, abs=0.08)
        if spec.mode is FaultMode.STUCK:
            assert found.sat is not None
            assert found.sat.mean == pytest.approx(spec.sat, abs=0.02)
        assert np.mean(side.states[middle] == CODE[State(spec.mode.value)]) > 0.9
    # what a stuck or silent sensor hides is said
    hidden = got["FR", "actuator"].states[round(6.5 * RATE) : round(12.5 * RATE)]
    assert (hidden == CODE[State.MASKED]).all() == (row in ("stuck", "silent"))


@BOTH
def test_healthy_wheels_give_no_finding(coupling: str) -> None:
    for key, a in judged(coupling).items():
        assert a.findings == (), key
        assert a.tier == "model"
        assert np.mean(a.states == CODE[State.HEALTHY]) > 0.8, key
        assert "K 2." in a.notes[0]
        # the residual stays within its threshold
        residual, threshold = a.columns["residual"], a.columns["threshold"]
        known = np.isfinite(residual)
        assert np.mean(np.abs(residual[known]) <= threshold[known]) > 0.98


@pytest.mark.parametrize(
    ("side", "mode", "values"),
    campaign_of_rows([(Side.ACTUATOR, FaultMode.STUCK, (1.0, 0.1)), (Side.SENSOR, FaultMode.STUCK, (1.0, 0.2))]),
    ids=["valve", "sensor"],
)
def test_a_fault_from_the_first_sample(side: Side, mode: FaultMode, values: tuple[float, ...]) -> None:
    got = judged("ground", FaultSpec("RL", side, mode, 0.0, 10.0, *values))
    (finding,) = got["RL", side.value].findings
    assert (finding.start, finding.mode) == (0, mode)
    assert finding.stop / RATE == pytest.approx(10.0, abs=0.3)
    assert finding.probability > (0.9 if side is Side.SENSOR else 0.6)
    assert any("from the first sample" in line for line in finding.evidence)
    assert {key for key, a in got.items() if a.findings} == {("RL", side.value)}


def test_only_the_valve_is_left_out_where_its_position_is_measured() -> None:
    _, valve = specs("silent")
    signals = logged("ground", valve, evidence="spool")
    got = assessed(align(signals))
    assert {got[w, "sensor"].tier for w in PAPER.wheels} == {"model"}
    assert {got[w, "actuator"].tier for w in PAPER.wheels} == {"direct"}
    assert [key for key, a in got.items() if a.findings] == [("RL", "actuator")]
