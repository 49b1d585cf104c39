"""Figures of a law on a mission that is built by hand: two wheels, one fault."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.counterfactual.abduct import Abducted, KnownFault, weighted
from diagnosis.counterfactual.bands import band, thinned
from diagnosis.counterfactual.figures import law_figures, recoveries
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon
from diagnosis.results.vocabulary import Tier
from diagnosis.results.wheel_model import WheelModelFit
from replay.counterfactual.world import CoupledPlant, RecordedWorld, linear_map
from replay.faults import FaultMode, Side
from replay.machine.config import WheelPlant, haulotte

DT, SIZE = 0.01, 1000
MACHINE = haulotte()


def abducted() -> Abducted:
    """Wheel 0 follows but for 0.2 m/s from 4 to 6 s, when its valve has lost half; wheel 1 is 0.01 m/s too slow throughout."""
    shape = (SIZE, 2)
    v_ref = np.full(shape, 0.2)
    speed = v_ref + np.array([0.0, -0.01])
    speed[400:600, 0] -= 0.2
    faulty = np.zeros(shape, np.bool_)
    faulty[400:600, 0] = True
    let = np.ones(shape)
    let[400:600, 0] = 0.5
    none = np.zeros(shape)
    world = RecordedWorld(
        dt=DT,
        v_ref=v_ref,
        y=speed,
        u=np.full(shape, 0.1),
        opening=np.full(shape, 0.1),
        speed=speed,
        let_sensor=np.ones(shape),
        let_valve=let,
        held_sensor=none > 0,
        held_valve=none > 0,
        ratio=np.ones(shape),
        turn=none,
        ground=np.ones(shape),
    )
    finding = Finding(
        400, 600, Side.ACTUATOR, FaultMode.INEFFICIENT, 0.99, (), Epsilon(0.5, 0.4, 0.6), None, (), Tier.MODEL
    )
    plant = WheelPlant(2.0, 0.25)
    openings, speeds = linear_map(np.full(2, 2.0), np.zeros(2), 1.0)
    zero = np.zeros(2)
    return Abducted(
        world,
        WheelModelFit((plant, plant), 0.01, 100, True, ""),
        CoupledPlant(np.full(2, 0.25), openings, speeds, zero, zero, zero, 0.0, np.inf),
        np.isfinite(speed),
        faulty,
        (KnownFault(0, Side.ACTUATOR, finding),),
        (),
    )


def test_errors_in_healthy_and_faulty_time_are_apart() -> None:
    mission = abducted()
    found = law_figures(mission, MACHINE, mission.world.u, np.zeros((SIZE, 2)))
    error = found["tracking_error"]
    assert error["faulty"] == pytest.approx(0.2)
    assert error["healthy"] == pytest.approx(0.01 * 1000 / 1800)
    assert error["mission"] == pytest.approx((200 * 0.2 + 1000 * 0.01) / 2000)
    assert (found["total_variation"], found["saturated"]) == (0.0, 0.0)
    u = np.tile([[0.5], [1.0]], (SIZE // 2, 2))
    found = law_figures(mission, MACHINE, u, np.zeros((SIZE, 2)))
    assert found["total_variation"] == pytest.approx(0.5 * 999 / 10.0)
    assert found["saturated"] == pytest.approx(0.5)


def test_recovery_is_the_time_until_the_wheel_stays_at_its_command() -> None:
    mission = abducted()
    shift = np.zeros((SIZE, 2))
    shift[600:700, 0] = 0.15  # overshoots for a second, touching its command for a moment
    shift[640:650, 0] = 0.0
    late, at_once = recoveries(mission, MACHINE, shift), recoveries(mission, MACHINE, np.zeros((SIZE, 2)))
    assert late[0]["recovery_s"] == pytest.approx(1.1, abs=0.1)
    assert at_once[0]["recovery_s"] == pytest.approx(0.1, abs=0.02)
    shift[600:, 0] = 0.15
    assert recoveries(mission, MACHINE, shift)[0]["recovery_s"] is None


def test_draws_of_a_fault_change_what_it_lets_through() -> None:
    sensor, valve = weighted(abducted(), {0: 0.3})
    assert valve[500, 0] == pytest.approx(0.7)
    assert valve[700, 0] == 1.0
    assert (sensor == 1.0).all()


def test_a_thinned_mission_keeps_its_times() -> None:
    mission = thinned(abducted(), 4)
    finding = mission.faults[0].finding
    assert mission.world.dt == pytest.approx(0.04)
    assert (finding.start * mission.world.dt, finding.stop * mission.world.dt) == (4.0, 6.0)
    assert mission.faulty[finding.start : finding.stop, 0].all()


def test_a_band_holds_its_value() -> None:
    changes = np.array([0.01, 0.02])
    assert band(0.05, changes, 0.0) == {"low": 0.05, "high": pytest.approx(0.0695)}
    wider = band(0.05, changes, 0.1)
    assert wider == {"low": pytest.approx(0.045), "high": pytest.approx(0.05 + np.hypot(0.0195, 0.005))}
    assert band(None, changes, 0.1) is None
    assert band(0.05, np.empty(0), 0.1) is None
