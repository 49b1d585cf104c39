"""Figures of a mission, by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.decision.metrics import body_motion, coverage, driving, loop_metrics, open_states, phases
from diagnosis.decision.short import AS_WELL_HEALTHY, main_reason
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.control.loop import Replay, replay_loop
from replay.faults import FaultMode, Side, State
from replay.machine.config import Machine, haulotte
from replay.signals.timeline import Timeline

STEP = 10_000_000  # 100 Hz
MACHINE = Machine(name="two", id="", wheels=("A", "B"), geometry=None)
Array = np.ndarray


def timeline(**columns: Array) -> Timeline:
    named = {name.replace("__", "."): np.asarray(x, dtype=np.float64) for name, x in columns.items()}
    size = next(iter(named.values())).size
    return Timeline(
        start_ns=0,
        step_ns=STEP,
        size=size,
        signals=named,
        fresh={k: np.isfinite(x) for k, x in named.items()},
        sources=dict.fromkeys(named, "a.csv"),
        periods_ns=dict.fromkeys(named, STEP),
    )


def loop(line: Timeline, machine: Machine = MACHINE) -> Replay:
    return replay_loop(line, machine)


def test_driving_is_by_the_command() -> None:
    command = [0.0, 0.04, 0.06, -0.06, np.nan, np.nan]
    line = timeline(wheel__A__v_ref=command, wheel__A__v=[*[0.3] * 5, 0.0], wheel__B__v=[0.3] * 6)
    got = driving(loop(line), line, MACHINE)
    # a command that is lost, as by a topic that fell silent, leaves the wheel driving: that it is not judged then counts
    assert_array_equal(got[:, 0], [False, False, True, True, True, False])
    assert_array_equal(got[:, 1], True)  # nothing is commanded: the measured speed stands in


def test_tracking_error_and_effort() -> None:
    line = timeline(
        wheel__A__v_ref=[0.0, 0.2, 0.2, np.nan],
        wheel__A__v=[0.01, 0.17, 0.22, 0.2],
        wheel__A__u=[0.0, 0.1, -0.3, np.nan],
        wheel__B__v_ref=[0.0, 0.2, 0.2, 0.2],
        wheel__B__v=[0.0, 0.1, 0.1, 0.1],
        wheel__B__v_true=[0.0, 0.2, 0.2, 0.16],
        wheel__B__u=[0.0, 0.2, 0.2, 0.2],
    )
    replay = loop(line)
    got = loop_metrics(line, replay, MACHINE, driving(replay, line, MACHINE))
    a, b = got["wheels"]["A"], got["wheels"]["B"]
    assert a["tracking_error"] == pytest.approx({"mission": 0.02, "driving": 0.025})
    assert a["control_effort"] == pytest.approx({"mission": 0.4 / 3, "driving": 0.2})
    # with v_true where it is logged, not with the faulty measurement
    assert b["tracking_error"] == pytest.approx({"mission": 0.01, "driving": 0.04 / 3})
    assert got["average"]["tracking_error"]["mission"] == pytest.approx(0.015)
    assert got["average"]["control_effort"]["driving"] == pytest.approx(0.2)


def test_the_papers_table_stands_beside() -> None:
    line = timeline(wheel__A__v=[0.0, 0.0])
    replay = loop(line)
    got = loop_metrics(line, replay, MACHINE, driving(replay, line, MACHINE))
    rows = [(r["controller"], r["tracking_error"], r["control_effort"], r["parameters"]) for r in got["paper"]]
    assert rows[0] == ("MFHCA", 0.019, 0.125, 4)
    assert rows[1:] == [
        ("Yang", 0.032, 0.13, 16),
        ("Wang", 0.021, 0.145, 7),
        ("Yu", 0.024, 0.125, 6),
        ("Sun", 0.035, 0.135, 12),
    ]
    assert got["average"]["tracking_error"]["mission"] is None


def test_coverage_counts_every_sample() -> None:
    states = np.repeat(
        [CODE[s] for s in (State.HEALTHY, State.STUCK, State.NOT_EXCITED, State.MASKED)], [40, 30, 20, 10]
    )
    moving = np.zeros((100, 2), dtype=bool)
    moving[20:60, 0] = True
    moving[60:95, 1] = True
    one = Assessment(states.astype(np.int8), tier=Tier.DIRECT)
    rows, decided = coverage({("A", "sensor"): one, ("front", "sensor"): one}, moving, MACHINE, 0.01)
    assert rows[0]["seconds"] == pytest.approx({"healthy": 0.4, "stuck": 0.3, "not_excited": 0.2, "masked": 0.1})
    assert sum(rows[0]["seconds"].values()) == pytest.approx(1.0)
    assert rows[0]["driving_s"] == pytest.approx(0.4)
    assert decided["A", "sensor"] == pytest.approx(0.4)
    # a steering axle drives while any wheel does
    assert rows[1]["driving_s"] == pytest.approx(0.75)
    assert decided["front", "sensor"] == pytest.approx(0.5)
    assert rows[1]["decided_driving_s"] == decided["front", "sensor"]


def test_a_finding_that_leaves_a_part_as_probably_healthy_decides_nothing() -> None:
    """A state is stated all the same; but nobody may take a doubtful dead sensor for time in which it was judged."""
    states = np.repeat([CODE[s] for s in (State.HEALTHY, State.NO_SIGNAL)], [60, 40]).astype(np.int8)
    moving = np.ones((100, 2), dtype=bool)

    def decided(healthy: float) -> float:
        rows = (Hypothesis("none", "healthy", healthy), Hypothesis("sensor", "no_signal", 1.0 - healthy))
        finding = Finding(60, 100, Side.SENSOR, FaultMode.NO_SIGNAL, 1.0 - healthy, rows, None, None, (), Tier.MODEL)
        one = Assessment(states, findings=(finding,), tier=Tier.MODEL)
        return coverage({("A", "sensor"): one}, moving, MACHINE, 0.01)[1]["A", "sensor"]

    assert decided(0.54) == pytest.approx(0.6)
    assert decided(0.1) == pytest.approx(1.0)


def test_the_commonest_open_state_counts_while_driving_alone() -> None:
    states = np.repeat([CODE[s] for s in (State.NOT_EXCITED, State.MASKED, State.HEALTHY)], [50, 20, 30]).astype(
        np.int8
    )
    reasons = {State.NOT_EXCITED: "it rests", State.MASKED: "a dead sensor"}
    moving = np.zeros((100, 2), dtype=bool)
    moving[45:, 0] = True
    one = Assessment(states, reasons, tier=Tier.DIRECT)
    assert open_states({("A", "sensor"): one}, moving, MACHINE) == {("A", "sensor"): State.MASKED}
    assert open_states({("A", "sensor"): one}, moving & False, MACHINE) == {}


def test_a_doubtful_finding_is_why_most_of_the_driving_is_open() -> None:
    states = np.repeat([CODE[s] for s in (State.HEALTHY, State.NOT_ASSESSED, State.STUCK)], [60, 5, 35]).astype(np.int8)
    rows = (Hypothesis("none", "healthy", 0.6), Hypothesis("actuator", "stuck", 0.4))
    finding = Finding(65, 100, Side.ACTUATOR, FaultMode.STUCK, 0.4, rows, None, None, (), Tier.MODEL)
    one = Assessment(states, {State.NOT_ASSESSED: "alike"}, findings=(finding,), tier=Tier.MODEL)
    moving = np.ones((100, 2), dtype=bool)
    state = open_states({("A", "actuator"): one}, moving, MACHINE)["A", "actuator"]
    assert main_reason(one, state) == AS_WELL_HEALTHY
    sure = replace(finding, hypotheses=(Hypothesis("actuator", "stuck", 0.9), Hypothesis("none", "healthy", 0.1)))
    state = open_states({("A", "actuator"): replace(one, findings=(sure,))}, moving, MACHINE)["A", "actuator"]
    assert main_reason(one, state) == "alike"


def test_phases_by_the_command() -> None:
    n = 200
    v = np.repeat([0.0, 0.2, 0.2, -0.2, 0.0], n)
    omega = np.repeat([0.0, 0.0, 0.1, 0.0, 0.0], n)
    line = timeline(cmd__v=v, cmd__omega=omega, wheel__A__v=v)
    got = phases(line, loop(line), MACHINE)
    assert [p["name"] for p in got] == ["standstill", "forward", "turning", "reverse", "standstill"]
    assert_allclose([p["start_s"] for p in got], [0, 2, 4, 6, 8])
    assert_allclose([p["stop_s"] for p in got], [2, 4, 6, 8, 10])


def test_short_phases_join_the_one_before() -> None:
    v = np.repeat([0.2, -0.2, 0.2], [200, 20, 200])
    line = timeline(cmd__v=v, wheel__A__v=v)
    assert phases(line, loop(line), MACHINE) == [{"name": "forward", "start_s": 0.0, "stop_s": 4.2}]


def test_body_motion_without_a_command_is_the_wheels_mean() -> None:
    line = timeline(wheel__A__v=[0.1, np.nan, np.nan], wheel__B__v=[0.3, 0.2, np.nan])
    v, omega = body_motion(line, loop(line), MACHINE)
    assert_allclose(v, [0.2, 0.2, np.nan])
    assert_array_equal(omega, 0.0)
    commanded = replace(line, signals={**line.signals, "cmd.v": np.array([0.5, 0.5, 0.5])})
    assert_array_equal(body_motion(commanded, loop(line), MACHINE)[0], 0.5)


def test_body_motion_without_a_commanded_yaw_rate_follows_from_the_angles() -> None:
    machine, front = haulotte(), np.array([0.0, 0.1, np.nan, 0.1])
    asked = np.array([np.nan, np.nan, 0.2, np.nan])
    line = timeline(
        cmd__v=np.full(4, 0.5), steer__front__phi=front, steer__front__phi_ref=asked, steer__rear__phi=np.zeros(4)
    )
    v, omega = body_motion(line, loop(line, machine), machine)
    length = machine.geometry.axle_x("front") - machine.geometry.axle_x("rear")
    assert_allclose(omega, v * np.tan([0.0, 0.1, 0.2, 0.1]) / length)


def test_body_motion_of_a_machine_without_axles_takes_the_gyro() -> None:
    line = timeline(cmd__v=[0.5, 0.5], imu__yaw_rate=[0.1, np.nan])
    assert_array_equal(body_motion(line, loop(line), MACHINE)[1], [0.1, np.nan])
    steered = haulotte()  # whose angles are not logged
    assert_array_equal(body_motion(line, loop(line, steered), steered)[1], [0.1, np.nan])


def test_a_drive_that_is_commanded_to_rest_is_not_asked_for_anything() -> None:
    states = np.repeat([CODE[State.HEALTHY], CODE[State.NOT_EXCITED]], [600, 400]).astype(np.int8)
    moving = np.ones((1000, 2), dtype=np.bool_)
    for tier, driven in ((Tier.DIRECT, 6.0), (Tier.MODEL, 10.0)):
        one = Assessment(states=states, reasons={}, tier=tier)
        rows, _ = coverage({("A", "actuator"): one, ("A", "sensor"): one}, moving, MACHINE, 0.01)
        assert [row["driving_s"] for row in rows] == pytest.approx([driven, 10.0])
