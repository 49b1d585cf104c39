"""The replayed loop: what is used where it is logged, what is computed else, and what is said about it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from replay.control.kinematics import wheel_commands
from replay.control.loop import Replay, replay_loop, stack
from replay.control.loop_columns import replay_columns
from replay.machine.config import Control, Machine, haulotte
from replay.signals.timeline import Timeline
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

WHEELS = haulotte().wheels
PAPER = haulotte()


def timeline(columns: dict[str, np.ndarray], step_ns: int = 1_000_000) -> Timeline:
    size = next(iter(columns.values())).size
    return Timeline(
        start_ns=0,
        step_ns=step_ns,
        size=size,
        signals=columns,
        fresh={name: np.isfinite(x) for name, x in columns.items()},
        sources=dict.fromkeys(columns, "a.mcap"),
        periods_ns=dict.fromkeys(columns, step_ns),
    )


@pytest.fixture(scope="module")
def mission() -> SimulatedMission:
    return simulate_mission(SimulationOptions(scenario="healthy", seed=4, duration_s=15.0, evidence="base"))


def without(mission: SimulatedMission, *leaves: str) -> Timeline:
    return timeline({k: x for k, x in mission.columns.items() if not k.endswith(leaves)})


def with_control(**settings: object) -> Machine:
    return replace(PAPER, control=replace(PAPER.control, **settings))  # type: ignore[arg-type]


def reading(replay: Replay, name: str) -> str:
    return next(f"{r.value}; {r.detail}" for r in replay.readings if r.name == name)


def test_columns_side_by_side() -> None:
    line = timeline({"a": np.arange(3.0)})
    assert_array_equal(stack(line, ["b", "a"]), [[np.nan, 0], [np.nan, 1], [np.nan, 2]])
    assert stack(line, []).shape == (3, 0)


def test_auto_finds_the_law_that_ran(mission: SimulatedMission) -> None:
    replay = replay_loop(timeline(dict(mission.columns)), PAPER)
    assert replay.fits[0].law == "opposed"
    assert reading(replay, "control law").startswith("opposed")
    assert reading(replay, "adaptive law Ψ̂").startswith("forced")
    assert np.sqrt(np.mean(replay.u_difference**2)) < 2e-3
    assert np.nanmax(np.abs(replay.steer_difference)) < 2e-6
    true_psi = np.column_stack([mission.actual[f"wheel.{w}.psi"] for w in WHEELS])
    assert np.abs(replay.psi - true_psi).max() < 0.02


def test_error_and_decay_rate_are_those_of_the_measured_speed(mission: SimulatedMission) -> None:
    columns = mission.columns
    replay = replay_loop(timeline(dict(columns)), PAPER)
    assert_allclose(replay.e[:, 0], columns["wheel.FR.v"] - columns["wheel.FR.v_ref"], atol=1e-15)
    rho = 0.001 + np.abs(columns["wheel.RL.v_ref"]) + np.abs(columns["wheel.RL.v"]) + 1.0
    assert_allclose(replay.rho[:, 3], rho)
    assert_allclose(replay.psi_implied**2, np.maximum(replay.implied_squared, 0.0), atol=1e-15)


def test_recorded_wheel_commands_come_first(mission: SimulatedMission) -> None:
    columns = dict(mission.columns)
    columns["wheel.FR.v_ref"] = columns["wheel.FR.v_ref"] + 0.05
    replay = replay_loop(timeline(columns), PAPER)
    assert_array_equal(replay.v_ref[:, 0], columns["wheel.FR.v_ref"])
    assert reading(replay, "commanded wheel speed v_c,i").startswith("as recorded")


def test_missing_wheel_commands_come_from_the_kinematics(mission: SimulatedMission) -> None:
    replay = replay_loop(without(mission, "_ref"), PAPER)
    assert PAPER.geometry is not None
    mapped = wheel_commands(
        mission.columns["cmd.v"], mission.columns["cmd.omega"], PAPER.geometry, dt=0.001, max_steer=PAPER.max_steer
    )
    assert_array_equal(replay.v_ref, mapped.speed)
    assert_array_equal(replay.phi_ref, mapped.axle_angle)
    recorded = np.column_stack([mission.columns[f"wheel.{w}.v_ref"] for w in WHEELS])
    assert np.abs(replay.v_ref - recorded).max() < 2e-3
    assert "L1 (1)" in reading(replay, "commanded wheel speed v_c,i")
    assert "L2 (2)" in reading(replay, "steering angle φ_c,i")


def test_one_missing_wheel_command_is_filled_in(mission: SimulatedMission) -> None:
    replay = replay_loop(without(mission, "FL.v_ref"), PAPER)
    full = replay_loop(timeline(dict(mission.columns)), PAPER)
    assert_array_equal(replay.v_ref[:, [0, 2, 3]], full.v_ref[:, [0, 2, 3]])
    assert np.abs(replay.v_ref[:, 1] - full.v_ref[:, 1]).max() < 2e-3


def test_order_of_the_wheels_permutes_the_columns(mission: SimulatedMission) -> None:
    order = ("RL", "FR", "RR", "FL")
    shuffled = replay_loop(without(mission, "_ref"), replace(PAPER, wheels=order))
    straight = replay_loop(without(mission, "_ref"), PAPER)
    columns = [WHEELS.index(w) for w in order]
    for name in ("v_ref", "e", "rho", "wheel_phi"):
        assert_allclose(getattr(shuffled, name), getattr(straight, name)[:, columns], atol=1e-12, err_msg=name)
    assert_allclose(shuffled.u, straight.u[:, columns], atol=1e-9)


def test_without_any_command_nothing_is_replayed(mission: SimulatedMission) -> None:
    replay = replay_loop(without(mission, "_ref", "cmd.v", "cmd.omega"), PAPER)
    assert np.isnan(replay.v_ref).all()
    assert np.isnan(replay.u).all()
    assert np.isnan(replay.psi_printed).all()
    assert reading(replay, "commanded wheel speed v_c,i").startswith("not available")


def test_without_recorded_valve_command_the_law_is_taken_as_printed(mission: SimulatedMission) -> None:
    replay = replay_loop(without(mission, ".u"), PAPER)
    assert replay.fits == ()
    assert "no recorded valve command" in reading(replay, "control law")
    assert reading(replay, "adaptive law Ψ̂").startswith("printed only")
    assert_array_equal(replay.psi_printed, 0.0)  # Ψ̂(0) is not given and cannot be fitted
    assert np.isnan(replay.implied_squared).all()
    assert np.isnan(replay.u_difference).all()
    # signed, λ = 1: u = −(v − v_c)
    assert_allclose(replay.u, np.clip(-replay.e, -1, 1), atol=1e-12)


def test_without_a_commanded_yaw_rate_wheels_turn_with_the_steering(mission: SimulatedMission) -> None:
    replay = replay_loop(without(mission, ".v_ref", "cmd.omega"), PAPER)
    full = replay_loop(timeline(dict(mission.columns)), PAPER)
    assert "steering angles" in reading(replay, "commanded wheel speed v_c,i")
    turning = np.abs(mission.columns["cmd.omega"]) > 0.05
    straight = np.abs(np.broadcast_to(mission.columns["cmd.v"][:, np.newaxis], full.v_ref.shape) - full.v_ref)
    by_angles = np.abs(replay.v_ref - full.v_ref)
    assert np.median(by_angles[turning]) < 0.2 * np.median(straight[turning])


def test_another_controller_has_no_law(mission: SimulatedMission) -> None:
    replay = replay_loop(timeline(dict(mission.columns)), with_control(law="none"))
    for x in (replay.u, replay.psi, replay.psi_printed, replay.implied_squared, replay.forcing, replay.u_difference):
        assert np.isnan(x).all()
    assert np.isfinite(replay.e).all()
    assert reading(replay, "control law").startswith("none")
    shown = replay_columns(timeline(dict(mission.columns)), replay, with_control(law="none"))
    assert "replay.front.phi_ref" in shown  # what is asked of it is known, with which opening is not
    assert not [name for name in shown if name in ("replay.front.u", "replay.front.u_difference")]


def test_given_psi0_decays_as_printed(mission: SimulatedMission) -> None:
    replay = replay_loop(timeline(dict(mission.columns)), with_control(law="signed", psi="printed", psi0=0.5))
    decay = np.exp(-np.cumsum(np.vstack([np.zeros(4), replay.rho[:-1] * 0.001]), axis=0))
    assert_allclose(replay.psi, 0.5 * decay, rtol=1e-9)
    assert_array_equal(replay.psi, replay.psi_printed)


@pytest.mark.parametrize("law", ["signed", "opposed", "printed", "sign_abs"])
def test_implied_mode_gives_back_the_recorded_command(mission: SimulatedMission, law: str) -> None:
    replay = replay_loop(timeline(dict(mission.columns)), with_control(law=law, psi="implied"))
    assert reading(replay, "control law").startswith(law)
    known = replay.implied_squared >= 0  # Ψ̂² below zero is clipped
    assert known.sum() > 1000
    assert np.abs(replay.u_difference[known]).max() < 1e-9


def test_event_reset_mode_follows_the_implied_value(mission: SimulatedMission) -> None:
    printed = replay_loop(timeline(dict(mission.columns)), with_control(law="opposed", psi="printed"))
    events = replay_loop(timeline(dict(mission.columns)), with_control(law="opposed", psi="event_reset"))
    assert np.nanmean(events.u_difference**2) < 0.2 * np.nanmean(printed.u_difference**2)


def test_printed_law_leaves_no_forcing() -> None:
    options = SimulationOptions(
        scenario="healthy", seed=4, duration_s=10.0, evidence="base", law="signed", zeta=0.0, psi0=0.6
    )
    printed = replay_loop(timeline(dict(simulate_mission(options).columns)), with_control(law="signed"))
    assert reading(printed, "adaptive law Ψ̂").startswith("printed")
    forced = replay_loop(
        timeline(dict(simulate_mission(replace(options, zeta=10.0)).columns)), with_control(law="signed")
    )
    assert np.nanmax(np.abs(printed.forcing)) < 2e-3
    assert np.nanmax(np.abs(forced.forcing)) > 5e-3
    assert np.sqrt(np.mean(printed.u_difference**2)) < 2e-5


def test_lost_samples_stay_unknown(mission: SimulatedMission) -> None:
    columns = dict(mission.columns)
    columns["wheel.FR.v"] = columns["wheel.FR.v"].copy()
    columns["wheel.FR.v"][3000:3500] = np.nan
    replay = replay_loop(timeline(columns), PAPER)
    assert np.isnan(replay.e[3000:3500, 0]).all()
    assert np.isnan(replay.u[3000:3500, 0]).all()
    assert np.isfinite(replay.u[3500:, 0]).all()
    assert np.isfinite(replay.u[:, 1:]).all()


def test_one_wheel_without_geometry() -> None:
    n = 2000
    v_ref = np.where(np.arange(n) % 1000 < 500, 0.2, -0.2)
    v = v_ref * 0.9
    machine = Machine(name="rig", id="", wheels=("M",), geometry=None, control=Control(law="signed", lambda_=2.0))
    replay = replay_loop(timeline({"wheel.M.v": v, "wheel.M.v_ref": v_ref, "wheel.M.u": 2 * (v_ref - v)}), machine)
    assert replay.phi_ref.shape == (n, 0)
    assert_allclose(replay.u[:, 0], 2 * (v_ref - v), atol=1e-9)
    assert_allclose(replay.implied_squared[:, 0], 0.0, atol=1e-12)


def test_given_lambda_stays_where_the_law_is_given(mission: SimulatedMission) -> None:
    replay = replay_loop(timeline(dict(mission.columns)), with_control(law="opposed", psi="implied", lambda_=3.0))
    assert "replayed with λ = 3 s/m" in reading(replay, "control law")
    assert "λ̂ = 1 ±" in reading(replay, "control law")


def test_a_pi_controller_has_no_psi_to_replay(mission: SimulatedMission) -> None:
    columns = dict(mission.columns)
    for wheel in WHEELS:
        e = columns[f"wheel.{wheel}.v"] - columns[f"wheel.{wheel}.v_ref"]
        columns[f"wheel.{wheel}.u"] = 0.4 * columns[f"wheel.{wheel}.v_ref"] - 0.2 * e - 0.5 * np.cumsum(e) * 1e-3
    replay = replay_loop(timeline(columns), PAPER)
    assert replay.law is None
    assert replay.pi is not None
    assert "proportional and integral with feed-forward" in reading(replay, "control law")
    assert np.isnan(replay.u).all()


def test_the_order_of_a_forced_psi_is_replayed(mission: SimulatedMission) -> None:
    replay = replay_loop(timeline(dict(mission.columns)), PAPER)
    assert replay.law is not None
    assert replay.law.lead == pytest.approx(1.0, abs=0.02)
    assert "Ψ̂ takes its step before the command is given" in reading(replay, "adaptive law Ψ̂")
    assert np.nanmax(np.abs(replay.u_difference)) < 1e-4
