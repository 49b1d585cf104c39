"""Steering axles judged end to end on short simulated missions with one fault each."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.channels.liveness import alive_sources
from diagnosis.results.assessment import CODE
from diagnosis.steering.assess import SteeringResult, assess_steering
from replay.control.loop import replay_loop
from replay.faults import FaultMode, FaultSpec, Side, State
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline, align
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign

RATE = 500.0


def mission_of(*faults: FaultSpec, evidence: str = "base") -> SimulatedMission:
    return simulate_mission(
        SimulationOptions(
            scenario="random",
            seed=1,
            duration_s=60.0,
            rate_hz=RATE,
            evidence=evidence,
            faults=faults,  # type: ignore[arg-type]
        )
    )


def judged(mission: SimulatedMission, *without: str) -> tuple[SteeringResult, Timeline]:
    items = {
        name: Signal(name, mission.stamps, values, SignalSource(column=name), "simulated", guessed=False)
        for name, values in mission.columns.items()
        if not name.endswith(without or ("nothing",))
    }
    timeline = align(Signals(items=items, missing={}))
    machine = haulotte()
    return (
        assess_steering(timeline, replay_loop(timeline, machine), machine, alive_sources(timeline), lambda _: None),
        timeline,
    )


def front(side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0, std: float = 0.0) -> FaultSpec:
    return FaultSpec("front", side, mode, 16.5, 27.0, epsilon, sat, std, 0.0 if side is Side.SENSOR else 0.8)


def test_healthy_steering_gives_no_finding_and_its_angle() -> None:
    mission = mission_of()
    result, _ = judged(mission)
    for assessment in result.assessments.values():
        assert assessment.findings == ()
        assert assessment.tier == "model"
    for j, axle in enumerate(("front", "rear")):
        assert np.max(np.abs(result.angle[:, j] - mission.actual[f"steer.{axle}.phi"])) < 0.005
    assert not result.doubtful.any()


@pytest.mark.turns("evidence")
@pytest.mark.parametrize(
    "fault",
    [
        front(Side.SENSOR, FaultMode.STUCK, sat=float("nan")),
        front(Side.SENSOR, FaultMode.NO_SIGNAL),
        front(Side.SENSOR, FaultMode.INEFFICIENT, epsilon=0.5),
        front(Side.SENSOR, FaultMode.NOISY, epsilon=0.4, sat=0.05, std=0.1),
        front(Side.ACTUATOR, FaultMode.STUCK, sat=0.05),
        front(Side.ACTUATOR, FaultMode.NO_SIGNAL),
        front(Side.ACTUATOR, FaultMode.NOISY, epsilon=0.4, sat=0.08, std=0.08),
    ],
    ids=lambda f: f"{f.side.value} {f.mode.value}",
)
@pytest.mark.parametrize("evidence", ["base", "direct"])
def test_a_fault_is_found_on_its_side_and_nowhere_else(fault: FaultSpec, evidence: str) -> None:
    result, timeline = judged(mission_of(fault, evidence=evidence))
    found = {key: [f.mode for f in a.findings] for key, a in result.assessments.items()}
    assert found.pop(("front", fault.side.value)) == [fault.mode]
    assert all(not modes for modes in found.values())
    finding = result.assessments["front", fault.side.value].findings[0]
    shown = 0.05 if fault.side is Side.SENSOR else 2.0
    assert finding.start * timeline.dt == pytest.approx(16.5, abs=shown)
    assert finding.stop * timeline.dt == pytest.approx(27.0, abs=0.2)


@pytest.mark.parametrize("rate", campaign([100.0, 200.0]))
@pytest.mark.parametrize("seed", campaign([2, 4]))
def test_a_held_axle_in_a_slow_log_is_no_dead_valve(rate: float, seed: int) -> None:
    # the position does not follow, sample by sample, the jitter that the log shows of a faster controller's command
    options = SimulationOptions(scenario="healthy", seed=seed, duration_s=60.0, rate_hz=rate, evidence="direct")
    result, _ = judged(simulate_mission(options))
    assert [f.mode for a in result.assessments.values() for f in a.findings] == []


@pytest.mark.parametrize("std", campaign([0.01, 0.03]))
def test_a_noisy_sensor_in_a_slow_log_makes_no_valve_faults(std: float) -> None:
    fault = front(Side.SENSOR, FaultMode.NOISY, 0.45, std=std)
    options = SimulationOptions(
        scenario="random", seed=1, duration_s=60.0, rate_hz=100.0, evidence="spool", faults=(fault,)
    )
    result, _ = judged(simulate_mission(options))
    found = [(name, f.mode) for name, a in result.assessments.items() for f in a.findings]
    assert found == [(("front", "sensor"), FaultMode.NOISY)]


def test_angle_of_a_stuck_sensor_comes_from_the_model_and_its_valve_is_masked() -> None:
    mission = mission_of(front(Side.SENSOR, FaultMode.STUCK, sat=0.1))
    result, _ = judged(mission)
    part = slice(round(16.6 * RATE), round(26.9 * RATE))
    assert np.max(np.abs(result.angle[part, 0] - mission.actual["steer.front.phi"][part])) < 0.05
    assert result.doubtful[part, 0].all()
    assert not result.doubtful[part, 1].any()
    assert (result.assessments["front", "actuator"].states[part] == CODE[State.MASKED]).all()


def test_second_angle_is_the_angle() -> None:
    mission = mission_of(front(Side.SENSOR, FaultMode.STUCK, sat=0.1), evidence="direct")
    result, _ = judged(mission, ".u_applied")
    assert np.max(np.abs(result.angle[:, 0] - mission.actual["steer.front.phi"])) < 0.01
    assert not result.doubtful[:, 0].any()


def test_without_angle_nothing_is_said() -> None:
    result, _ = judged(mission_of(), ".phi")
    for axle in ("front", "rear"):
        assert set(result.assessments[axle, "sensor"].states) == {CODE[State.NO_DATA]}
        assert not np.isfinite(result.angle).any()


def test_axle_that_is_never_steered_is_not_assessed() -> None:
    mission = mission_of()
    quiet = {name: np.zeros_like(x) if name.startswith("steer.") else x for name, x in mission.columns.items()}
    quiet["cmd.omega"] = np.zeros(mission.stamps.size)
    items = {
        name: Signal(name, mission.stamps, values, SignalSource(column=name), "simulated", guessed=False)
        for name, values in quiet.items()
    }
    timeline, machine = align(Signals(items=items, missing={})), haulotte()
    result = assess_steering(timeline, replay_loop(timeline, machine), machine, alive_sources(timeline), lambda _: None)
    for assessment in result.assessments.values():
        assert set(assessment.states) == {CODE[State.NOT_ASSESSED]}
        assert "steered too little" in assessment.reasons[State.NOT_ASSESSED]
