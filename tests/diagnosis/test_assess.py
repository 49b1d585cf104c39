"""Which evidence judges which component, and what is said where there is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from diagnosis.assess import ComponentResult, assess_components
from diagnosis.channels.liveness import alive_sources
from diagnosis.results.assessment import CODE, Assessment
from replay.control.loop import replay_loop
from replay.faults import FaultMode, FaultSpec, Side, State
from replay.machine.config import Machine, haulotte
from replay.signals.timeline import Timeline
from replay.simulation.options import EvidenceLevel, SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

PAPER = haulotte()
WHEELS = PAPER.wheels
Array = np.ndarray


def simulated(evidence: EvidenceLevel = "direct", faults: tuple[FaultSpec, ...] = ()) -> SimulatedMission:
    return simulate_mission(
        SimulationOptions(scenario="healthy", seed=3, duration_s=18.0, rate_hz=500.0, evidence=evidence, faults=faults)
    )


def timeline(columns: dict[str, Array], fresh: dict[str, Array] | None = None) -> Timeline:
    step = 2_000_000
    size = next(iter(columns.values())).size
    return Timeline(
        start_ns=0,
        step_ns=step,
        size=size,
        signals=columns,
        fresh={k: np.isfinite(x) for k, x in columns.items()} | (fresh or {}),
        sources=dict.fromkeys(columns, "a.mcap"),
        periods_ns=dict.fromkeys(columns, step),
    )


def assess(columns: dict[str, Array], machine: Machine = PAPER, wheels: tuple[str, ...] = WHEELS) -> ComponentResult:
    line = timeline(columns)
    return assess_components(line, replay_loop(line, machine), machine, wheels, lambda text: None)


@pytest.fixture(scope="module")
def direct() -> SimulatedMission:
    return simulated()


@pytest.fixture(scope="module")
def base() -> SimulatedMission:
    return simulated("base")


def without(mission: SimulatedMission, *leaves: str) -> dict[str, Array]:
    return {k: x for k, x in mission.columns.items() if not k.endswith(leaves)}


def share(assessment: Assessment, state: State) -> float:
    return float(np.mean(assessment.states == CODE[state]))


def test_everything_measured_twice_is_judged_directly(direct: SimulatedMission) -> None:
    got = assess(dict(direct.columns))
    assert set(got.assessments) == {(c, s) for c in (*WHEELS, "front", "rear") for s in ("sensor", "actuator")}
    assert {got.assessments[w, s].tier for w in WHEELS for s in ("sensor", "actuator")} == {"direct"}
    assert [f for a in got.assessments.values() for f in a.findings] == []
    assert got.wheel_model is None
    for wheel in WHEELS:
        assert share(got.assessments[wheel, "sensor"], State.HEALTHY) > 0.7


def test_second_speed_alone_judges_the_sensor_directly(direct: SimulatedMission) -> None:
    got = assess(without(direct, ".u_applied"))
    for wheel in WHEELS:
        assert got.assessments[wheel, "sensor"].tier == "direct"
        assert got.assessments[wheel, "actuator"].tier == "model"
    assert got.wheel_model is not None


def test_spool_alone_judges_the_valve_directly(direct: SimulatedMission) -> None:
    got = assess(without(direct, "_true"))
    for wheel in WHEELS:
        assert got.assessments[wheel, "sensor"].tier == "model"
        assert got.assessments[wheel, "actuator"].tier == "direct"
    assert got.assessments["front", "sensor"].tier == "model"


def test_speed_and_valve_command_alone_go_by_the_model(base: SimulatedMission) -> None:
    got = assess(dict(base.columns))
    for wheel in WHEELS:
        assert (got.assessments[wheel, "sensor"].tier, got.assessments[wheel, "actuator"].tier) == ("model", "model")
    for axle in ("front", "rear"):
        for side in ("sensor", "actuator"):
            assert got.assessments[axle, side].tier == "model"
    assert [f for a in got.assessments.values() for f in a.findings] == []


def test_without_valve_command_the_drive_is_judged_by_its_answers_which_a_short_mission_does_not_show(
    base: SimulatedMission,
) -> None:
    got = assess(without(base, ".u"))
    for wheel in WHEELS:
        one = got.assessments[wheel, "sensor"]
        assert one.tier == "response"
        assert share(one, State.NOT_ASSESSED) + share(one, State.NOT_EXCITED) == 1.0
    # a steering axle's command follows from its reference, so that its valve needs no recorded one
    assert got.assessments["front", "actuator"].tier == "model"


def test_axle_that_is_not_logged_is_no_data(base: SimulatedMission) -> None:
    columns = {k: x for k, x in base.columns.items() if not k.startswith("steer.front.")}
    got = assess(columns)
    for side in ("sensor", "actuator"):
        one = got.assessments["front", side]
        assert one.tier == "none"
        assert share(one, State.NO_DATA) + share(one, State.NOT_ASSESSED) == 1.0


def test_speed_alone_is_judged_by_its_channel_and_never_healthy(base: SimulatedMission) -> None:
    got = assess({"wheel.FR.v": base.columns["wheel.FR.v"]})
    for side in ("sensor", "actuator"):
        one = got.assessments["FR", side]
        assert one.tier == "tracking"
        assert share(one, State.NOT_ASSESSED) + share(one, State.NOT_EXCITED) == 1.0
        assert one.reasons[State.NOT_ASSESSED].startswith("without its command or a second measurement")


def test_speeds_of_several_wheels_alone_are_never_called_healthy(base: SimulatedMission) -> None:
    columns = {k: x for k, x in base.columns.items() if k.endswith(".v") and k.startswith("wheel.")}
    got = assess(columns)
    for wheel in WHEELS:
        assert all(share(got.assessments[wheel, side], State.HEALTHY) == 0.0 for side in ("sensor", "actuator"))


def test_wheel_that_is_not_logged_is_no_data(direct: SimulatedMission) -> None:
    columns = {k: x for k, x in direct.columns.items() if not k.startswith("wheel.FL.")}
    got = assess(columns)
    for side in ("sensor", "actuator"):
        assert share(got.assessments["FL", side], State.NO_DATA) == 1.0
    assert share(got.assessments["FR", "sensor"], State.HEALTHY) > 0.7


def test_only_the_asked_wheels_are_judged(direct: SimulatedMission) -> None:
    got = assess(dict(direct.columns), wheels=("RL",))
    assert {c for c, _ in got.assessments} == {"RL", "front", "rear"}


def test_without_geometry_there_is_no_steering(direct: SimulatedMission) -> None:
    got = assess(dict(direct.columns), replace(PAPER, geometry=None))
    assert {c for c, _ in got.assessments} == set(WHEELS)


@pytest.mark.parametrize(
    ("component", "side", "mode", "epsilon", "sat"),
    [
        ("FR", Side.SENSOR, FaultMode.STUCK, 1.0, 0.2),
        ("FL", Side.SENSOR, FaultMode.NO_SIGNAL, 1.0, 0.0),
        ("RR", Side.ACTUATOR, FaultMode.NO_SIGNAL, 1.0, 0.0),
        ("RL", Side.ACTUATOR, FaultMode.INEFFICIENT, 0.5, 0.0),
        ("front", Side.SENSOR, FaultMode.STUCK, 1.0, 0.3),
        ("rear", Side.ACTUATOR, FaultMode.NO_SIGNAL, 1.0, 0.0),
    ],
)
def test_injected_fault_is_found_where_it_is(
    component: str, side: Side, mode: FaultMode, epsilon: float, sat: float
) -> None:
    spec = FaultSpec(component, side, mode, 8.0, 14.0, epsilon, sat)
    got = assess(dict(simulated(faults=(spec,)).columns))
    stated = PAPER.limits.min_probability
    findings = [(key, f) for key, a in got.assessments.items() for f in a.findings if f.probability >= stated]
    assert {key for key, _ in findings} == {(component, side.value)}
    longest = max((f for _, f in findings), key=lambda f: f.stop - f.start)
    assert longest.mode is mode
    assert all(f.start >= 3975 and f.stop <= 7025 for _, f in findings)


def test_stuck_sensor_masks_its_valve() -> None:
    spec = FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 5.0, 11.0, 1.0, 0.35)
    got = assess(dict(simulated("base", (spec,)).columns))
    states = got.assessments["FR", "actuator"].states
    assert np.mean(states[2525:5475] == CODE[State.MASKED]) > 0.99
    assert CODE[State.MASKED] not in states[:2475]
    assert np.mean(got.assessments["FR", "sensor"].states[2525:5475] == CODE[State.STUCK]) > 0.99


def test_source_counts_what_delivers() -> None:
    n = 100
    columns = {"wheel.FR.v": np.zeros(n), "wheel.FL.v": np.zeros(n), "cmd.v": np.zeros(n)}
    silent = np.ones(n, dtype=bool)
    silent[40:60] = False  # held, but nothing new
    line = replace(timeline(columns, {"wheel.FL.v": silent}), sources={**dict.fromkeys(columns, "a"), "cmd.v": "b"})
    counts = alive_sources(line)
    assert_array_equal(counts["b"], 1)
    assert_array_equal(counts["a"][[0, 39, 50, 59, 60]], [2, 2, 1, 1, 2])
