"""What is asked once more before a machine is cleared, on simulated missions."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.clearing import yaw
from diagnosis.clearing.axle_rates import _evened, _parted
from diagnosis.clearing.cells import Frame
from diagnosis.clearing.checks import checks_of
from diagnosis.clearing.limits import usual_limits
from diagnosis.clearing.measure import off_commands
from diagnosis.clearing.still import commanded_still, dead_bands
from diagnosis.clearing.wheels import (
    ROUGH,
    behind_all_through,
    beside_ground,
    most_carried,
    most_creeping,
    roughness_of,
)
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_words import HYDRAULIC
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.axle_plant import AxlePlant
from replay.machine.config import Machine
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission
from tests.diagnosis.clearing.missions import LENGTH, in_cells, simulated
from tests.diagnosis.clearing.missions import checks as checks_by_part


def _open(checks: dict[tuple[str, str, Check], Checked], component: str) -> set[Check]:
    return {check for (who, _, check), c in checks.items() if who == component and not c.passed}


def test_a_healthy_mission_passes_all_checks_and_says_what_it_would_have_shown() -> None:
    checks = checks_by_part(simulated(), base=False)
    assert [c.text for c in checks.values() if not c.passed] == []
    shown = checks["FR", "sensor", Check.SECOND_MEASUREMENT].shows
    assert shown is not None
    assert 0.05 < shown < 0.3
    base = checks_by_part(simulated(), base=True)
    assert Check.SECOND_MEASUREMENT not in {check for _, _, check in base}
    response = base["FR", "sensor_or_actuator", Check.RESPONSE]
    assert response.shows is not None
    assert 0.2 < response.shows < 0.5


@pytest.mark.turns("base")
@pytest.mark.parametrize("base", [True, False])
@pytest.mark.parametrize(
    ("component", "side", "mode", "epsilon", "sat"),
    [
        ("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL, 1.0, 0.0),
        ("FR", Side.ACTUATOR, FaultMode.INEFFICIENT, 0.5, 0.0),
        ("FR", Side.SENSOR, FaultMode.INEFFICIENT, 0.4, 0.0),
        ("FR", Side.SENSOR, FaultMode.OUTSIDE_TABLE, -0.5, 0.0),
        ("front", Side.ACTUATOR, FaultMode.NO_SIGNAL, 1.0, 0.0),
        ("front", Side.ACTUATOR, FaultMode.OUTSIDE_TABLE, 0.02, 5.0),
    ],
)
def test_a_fault_that_lasts_the_whole_mission_does_not_pass(
    component: str, side: Side, mode: FaultMode, epsilon: float, sat: float, base: bool
) -> None:
    checks = checks_by_part(simulated(FaultSpec(component, side, mode, 0.0, LENGTH, epsilon, sat)), base=base)
    assert _open(checks, component)


def test_what_a_stated_fault_makes_of_its_part_is_not_held_against_it() -> None:
    fault = FaultSpec("FR", Side.SENSOR, FaultMode.INEFFICIENT, 20.0, 34.0, 0.7, 0.0)
    cells = in_cells(simulated(fault), base=True)
    part, stated = fault.component, {fault.component: [(fault.start_s, fault.stop_s)]}
    unstated = {c.check for c in checks_of(cells, HYDRAULIC) if c.component == part and not c.passed}
    told = {c.check: c for c in checks_of(replace(cells, stated=stated), HYDRAULIC) if c.component == part}
    assert unstated
    assert [c.text for c in told.values() if not c.passed and c.worst is not None] == []


def test_spikes_and_delay_do_not_pass() -> None:
    mission = simulated()
    rng = np.random.default_rng(1)
    spiky = mission.columns["wheel.RL.v"].copy()
    spiky[rng.random(spiky.size) < 0.05] += 0.3
    late = np.roll(mission.columns["wheel.FR.v"], 40)
    late[:40] = 0.0
    checks = checks_by_part(
        replace(mission, columns={**mission.columns, "wheel.RL.v": spiky, "wheel.FR.v": late}), base=True
    )
    assert not checks["RL", "sensor", Check.ROUGHNESS].passed
    assert not checks["FR", "sensor", Check.DELAY].passed
    assert checks["RR", "sensor", Check.ROUGHNESS].passed


def test_an_axle_that_is_not_steered_is_not_cleared() -> None:
    mission = simulated()
    still = {name: np.zeros_like(x) if name.startswith("steer.") else x for name, x in mission.columns.items()}
    check = checks_by_part(replace(mission, columns=still), base=True)[
        "front", "sensor_or_actuator", Check.LASTING_RATE
    ]
    assert check.worst is None
    assert not check.passed
    assert "leaves the check" in check.text


def test_the_limit_follows_the_machine_file() -> None:
    fault = FaultSpec("FR", Side.ACTUATOR, FaultMode.INEFFICIENT, 0.0, LENGTH, 0.35)
    key = ("FR", "sensor_or_actuator", Check.LASTING_RESPONSE)
    assert not checks_by_part(simulated(fault), base=True)[key].passed
    assert checks_by_part(simulated(fault), base=True, clear_at=0.6)[key].passed


def test_an_angle_that_is_off_turns_the_machine() -> None:
    fault = FaultSpec("rear", Side.SENSOR, FaultMode.OUTSIDE_TABLE, 0.0, LENGTH, 0.02, 7.5)
    key = ("rear", "sensor_or_actuator", Check.LASTING_YAW)
    driven = [
        simulate_mission(
            SimulationOptions(scenario="random", seed=5, duration_s=LENGTH, rate_hz=100.0, faults=faults, imu=True)
        )
        for faults in ((), (fault,))
    ]
    healthy, off = (checks_by_part(_with_yaw_rate(mission), base=False)[key] for mission in driven)
    assert healthy.passed
    assert not off.passed
    assert "° off its measured angle" in off.text


def test_without_a_yaw_rate_wheels_that_turn_with_the_machine_tell_that_an_angle_is_off() -> None:
    mission = simulated()
    left = {w: mission.columns[f"wheel.{w}.v"] for w in ("FL", "RL")}
    straight = np.abs(mission.columns["steer.front.phi"] - mission.columns["steer.rear.phi"]) < 0.08

    def found(slower: tuple[str, ...], by: float) -> set[Check]:
        turned = {f"wheel.{w}.v": np.where(straight, by * left[w], left[w]) for w in slower}
        changed = checks_by_part(replace(mission, columns={**mission.columns, **turned}), base=True)
        return {check for axle, _, check in changed if axle == "rear"} & {Check.YAW, Check.LASTING_YAW}

    assert found((), 1.0) == set()
    assert found(("FL", "RL"), 0.9) == {Check.YAW, Check.LASTING_YAW}
    assert found(("FL",), 0.7) == set()  # one wheel is read wrongly: at the other end both sides are alike


def test_an_angle_that_is_off_turns_a_machine_that_never_drives_straight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaw, "_STRAIGHT", 0.0)
    fault = FaultSpec("rear", Side.SENSOR, FaultMode.OUTSIDE_TABLE, 0.0, LENGTH, 0.02, 7.5)
    for faults, passed in (((), True), ((fault,), False)):
        mission = simulate_mission(
            SimulationOptions(scenario="random", seed=5, duration_s=LENGTH, rate_hz=100.0, faults=faults, imu=True)
        )
        found = checks_by_part(_with_yaw_rate(mission), base=False)
        assert found["rear", "sensor_or_actuator", Check.LASTING_YAW].passed is passed


def test_an_angle_that_drifts_off_points_straight_no_more_and_is_seen_in_turns() -> None:
    driven = simulate_mission(
        SimulationOptions(scenario="random", seed=5, duration_s=LENGTH, rate_hz=100.0, faults=(), imu=True)
    )
    mission = _with_yaw_rate(driven)
    angle = mission.columns["steer.front.phi"]
    for drift, passed in ((0.0, True), (0.25, False)):
        drifted = angle + np.linspace(0.0, drift, angle.size)
        one = replace(mission, columns={**mission.columns, "steer.front.phi": drifted})
        found = checks_by_part(one, base=False)
        assert found["front", "sensor_or_actuator", Check.LASTING_YAW].passed is passed


def _with_yaw_rate(mission: SimulatedMission) -> SimulatedMission:
    """The yaw rate as a channel of the mission's own stamps."""
    group = next(g for g in mission.slow if "imu.yaw_rate" in g.columns)
    rate = np.interp(mission.stamps, group.stamps, group.columns["imu.yaw_rate"])
    return replace(mission, columns={**mission.columns, "imu.yaw_rate": rate})


def test_readings_that_stand_out_by_themselves_do_not_clear() -> None:
    """They are too brief for any mean to show."""
    mission = simulated()
    y = mission.columns["wheel.RR.v"].copy()
    rng = np.random.default_rng(4)
    y[rng.random(y.size) < 0.03] += 0.3
    found = checks_by_part(replace(mission, columns={**mission.columns, "wheel.RR.v": y}), base=True)
    assert not found["RR", "sensor", Check.ROUGHNESS].passed
    assert found["RL", "sensor", Check.ROUGHNESS].passed


def test_the_overlap_of_steering_valves_is_found_from_their_rates() -> None:
    opening = np.random.default_rng(2).uniform(-0.5, 0.5, (2000, 2))
    rate = 0.4 * np.sign(opening) * np.maximum(np.abs(opening) - np.array([0.0, 0.07]), 0.0)
    assert dead_bands(rate[:, 1:], opening[:, 1:])[0] == pytest.approx(0.07, abs=0.006)
    assert dead_bands(rate, opening).max() == 0.0  # what one axle needs more of is a fault's


def test_what_both_axles_lose_from_start_to_end_shows_against_the_machine_file() -> None:
    mission = simulated()
    plant = AxlePlant(slope_up=1.0, slope_down=1.0, dead_up=0.0, dead_down=0.0, lag=0.1, play=0.0)

    def rates(*slopes: float) -> list[Checked]:
        cells = in_cells(mission, base=True)
        steering = {a: replace(plant, slope_up=s, slope_down=s) for a in cells.machine.axles for s in slopes}
        checks = checks_of(replace(cells, machine=replace(cells.machine, steering=steering)), HYDRAULIC)
        return [c for c in checks if c.check is Check.PLANT_RATE]

    assert rates() == []
    off = float(np.mean([c.worst for c in rates(1.0) if c.worst is not None]))
    usual = min((float(np.exp(sign * off)) for sign in (-1.0, 1.0)), key=lambda slope: rates(slope)[0].worst or 0.0)
    assert [c.passed for c in rates(usual)] == [True, True]
    assert [c.passed for c in rates(2.0 * usual)] == [False, False]


def test_the_only_steered_axle_is_held_against_the_machine_file_or_its_second_measurements() -> None:
    mission = simulated()
    cells = in_cells(mission, base=True)
    geometry = cells.machine.geometry
    assert geometry is not None
    wheels = {k: replace(w, axle="fixed") if w.axle == "rear" else w for k, w in geometry.wheels.items()}
    machine = replace(cells.machine, geometry=replace(geometry, wheels=wheels))
    plant = AxlePlant(slope_up=1.0, slope_down=1.0, dead_up=0.0, dead_down=0.0, lag=0.1, play=0.0)

    def front(machine: Machine, *, base: bool) -> dict[Check, Checked]:
        one = replace(in_cells(mission, base=base), machine=machine)
        return {c.check: c for c in checks_of(one, HYDRAULIC) if c.component == "front"}

    assert Check.LASTING_RATE not in front(machine, base=True)
    unknown = front(machine, base=True)[Check.PLANT_RATE]
    assert unknown.worst is None
    assert not unknown.passed
    known = front(replace(machine, steering={"front": plant}), base=True)[Check.PLANT_RATE]
    assert known.worst is not None
    usual = float(np.exp(known.worst))
    gains = [replace(plant, slope_up=s, slope_down=s) for s in (usual, 1.0 / usual)]
    assert any(front(replace(machine, steering={"front": g}), base=True)[Check.PLANT_RATE].passed for g in gains)
    assert Check.PLANT_RATE not in front(machine, base=False)


def test_what_is_left_of_a_jump_is_not_held_against_a_slow_valve() -> None:
    cells = in_cells(simulated(), base=True)
    t = np.arange(cells.size) * cells.dt
    command = np.where((t % 10.0) < 2.0, 0.6, 0.0)[:, np.newaxis]
    keep = np.exp(-cells.dt / 0.1)
    opening = np.zeros_like(command)
    for k in range(1, len(t)):
        opening[k] = keep * opening[k - 1] + (1.0 - keep) * command[k]
    assert np.nanmax(off_commands(cells, opening, command, 0.03)) < 0.3
    assert np.nanmax(off_commands(cells, 0.5 * opening, command, 0.03)) > 0.4


@pytest.mark.parametrize(("kept", "passes"), [(1.0, True), (0.68, False)])
def test_a_reading_that_loses_scale_on_one_axle_changes_its_rate(kept: float, passes: bool) -> None:
    mission = simulated(seed=8)
    half = mission.stamps > mission.stamps[mission.stamps.size // 2]
    angle = mission.columns["steer.front.phi"] * np.where(half, kept, 1.0)
    one = replace(mission, columns={**mission.columns, "steer.front.phi": angle})
    found = checks_by_part(one, base=True)
    assert found["front", "sensor_or_actuator", Check.RATE].passed is passes
    assert found["rear", "sensor_or_actuator", Check.RATE].passed


@pytest.mark.parametrize(("scatter", "expected"), [(0.01, 0.17), (0.3, 0.0)])
def test_a_drift_between_axles_shows_that_their_common_supply_hides(scatter: float, expected: float) -> None:
    rng, n = np.random.default_rng(4), 120
    supply, grows = 0.5 * np.sin(np.linspace(0.0, 9.0, n)), np.linspace(0.0, 2 * 0.17, n)
    bands = [np.column_stack([supply + grows, supply]) + rng.normal(0.0, scatter, (n, 2)) for _ in range(3)]
    assert _parted(bands) == pytest.approx([expected, expected], abs=0.02)
    assert _parted([b[:10] for b in bands]) == [None, None]
    assert _parted([b[:, :1] - b[:, 1:] for b in bands]) == pytest.approx(
        [expected], abs=0.02
    )  # of the only axle, its own


def test_an_axle_that_is_slower_to_one_side_is_evened_where_it_was_steered_to_both() -> None:
    opening = np.where(np.arange(400) < 200, 0.5, -0.5)[:, np.newaxis]
    opened, ahead = np.abs(opening), np.where(opening > 0.0, 0.15, 0.10)
    evened = _evened(ahead, opened, opening, 0.1)
    assert ahead / evened == pytest.approx(np.full((400, 1), 0.25))
    assert np.array_equal(_evened(ahead[:210], opened[:210], opening[:210], 0.1), opened[:210])  # hardly steered to one


def test_a_valve_that_is_slow_beside_the_others_is_not_cleared() -> None:
    mission = simulated(seed=8)
    names = [name for name in mission.columns if name.startswith("wheel.") and name.endswith(".u_applied")]
    assert all(
        checks_by_part(mission, base=False)[name.split(".")[1], "actuator", Check.SECOND_MEASUREMENT].passed
        for name in names
    )
    opening, dt = mission.columns["wheel.FR.u_applied"].copy(), 0.01
    for k in range(1, opening.size):
        opening[k] = opening[k - 1] + dt / 0.6 * (mission.columns["wheel.FR.u"][k] - opening[k - 1])
    slow = replace(mission, columns={**mission.columns, "wheel.FR.u_applied": opening})
    found = checks_by_part(slow, base=False)
    assert not found["FR", "actuator", Check.SECOND_MEASUREMENT].passed
    assert found["RL", "actuator", Check.SECOND_MEASUREMENT].passed


def test_wheels_that_are_steered_one_by_one_are_an_axle_beside_the_yaw_rate() -> None:
    mission = _with_yaw_rate(
        simulate_mission(SimulationOptions(scenario="random", seed=5, duration_s=LENGTH, rate_hz=100.0, imu=True))
    )
    cells = in_cells(mission, base=True)
    geometry = cells.machine.geometry
    assert geometry is not None
    turned = {k: replace(w, axle=f"{k}_steer") if w.axle == "front" else w for k, w in geometry.wheels.items()}
    machine = replace(cells.machine, geometry=replace(geometry, wheels=turned))
    assert len(machine.axles) == 3
    columns = dict(mission.columns)
    for leaf in ("phi", "u", "phi_ref"):
        for k in ("FR", "FL"):
            if f"steer.front.{leaf}" in columns:
                columns[f"steer.{k}_steer.{leaf}"] = columns[f"steer.front.{leaf}"]
    one = replace(in_cells(replace(mission, columns=columns), base=False), machine=machine)
    yaw = {c.component: c for c in checks_of(one, HYDRAULIC) if c.check is Check.LASTING_YAW}
    assert set(yaw) == set(machine.axles)
    assert all(c.passed for c in yaw.values())


@pytest.mark.parametrize(("base", "share", "passed"), [(True, 0.95, False), (True, 0.5, True), (False, 0.95, None)])
def test_a_wheel_that_the_ground_carries_shows_no_dead_valve(base: bool, share: float, passed: bool | None) -> None:
    """With the opening measured, the ground hides nothing of the valve: it is not asked."""
    cells = replace(in_cells(simulated(), base=base), carried={"FR": share})
    asked = [c for c in checks_of(cells, HYDRAULIC) if c.check is Check.CARRIED]
    assert [(c.component, c.passed) for c in asked] == ([] if passed is None else [("FR", passed)])
    assert all(c.passed or "ground carries FR" in c.text for c in asked)


def test_a_wheel_that_the_ground_carries_is_held_to_what_a_loss_would_leave() -> None:
    free = usual_limits((False, False), 0.25)
    assert beside_ground(free, 0.0, 0.25) == free
    assert beside_ground(free, 0.6, 0.25).below == pytest.approx(1.3 * 0.4 * -np.log(0.75))
    assert beside_ground(free, 0.99, 0.25).below == pytest.approx(0.06)  # healthy wheels differ by as much
    assert beside_ground(free, most_carried(0.25), 0.25).below == pytest.approx(0.06)
    assert most_carried(0.25) < most_carried(0.5)


def test_a_creeping_wheel_is_held_to_what_the_others_do() -> None:
    """Two of four wheels that are wrong are told, all that stick alike are not."""
    assert most_creeping([0.33, 0.05, 0.32, 0.06], 0, 0.25) == 0.25
    assert most_creeping([0.44, 0.31, 0.48, 0.3], 2, 0.25) == pytest.approx(1.5 * 0.31)
    assert most_creeping([0.3, np.nan, np.nan, np.nan], 0, 0.25) == 0.25


@pytest.mark.parametrize(("left", "passed"), [(1.0, True), (0.6, False)])
def test_speed_per_opening_is_asked_of_a_wheel_that_creeps(left: float, passed: bool) -> None:
    mission = simulated()
    seconds = (mission.stamps - mission.stamps[0]) * 1e-9
    creeps = (seconds > 5.0) & (seconds < 12.0)
    slow = {"v_ref": 0.04, "v": 0.04, "u": 0.12, "u_applied": 0.12}
    columns = {
        name: np.where(creeps, slow[leaf], x)
        if name.startswith("wheel.") and (leaf := name.split(".")[2]) in slow
        else x
        for name, x in mission.columns.items()
    }
    columns["wheel.FR.u"] = np.where(creeps, slow["u"] / left, mission.columns["wheel.FR.u"])
    checks = checks_by_part(replace(mission, columns=columns), base=True)
    assert checks["FR", "sensor_or_actuator", Check.RESPONSE].passed is passed
    assert checks["RR", "sensor_or_actuator", Check.RESPONSE].passed


@pytest.mark.parametrize(("made", "still"), [(1.0, False), (0.5, False), (0.0, True), (-1.0, True)])
def test_an_axle_that_creeps_as_its_valve_lets_it_does_not_stand_still(made: float, still: bool) -> None:
    """Near its target a valve opens little beyond its dead band: `made` of the rate that this gives."""
    mission = simulated()
    columns = dict(mission.columns)
    t = np.arange(columns["steer.front.u"].size) / 100.0
    opening = np.where(t % 8.0 < 4.0, 0.5, -0.5)
    creeping = (t >= 20.0) & (t < 24.0)
    opening[creeping] = 0.09
    rate = 0.4 * np.sign(opening) * np.maximum(np.abs(opening) - 0.06, 0.0)
    rate[creeping] *= made
    for axle in ("front", "rear"):
        columns[f"steer.{axle}.u"], columns[f"steer.{axle}.phi"] = opening, np.cumsum(rate) / 100.0
    values = commanded_still(in_cells(replace(mission, columns=columns), base=True), 0)
    assert (np.nanmax(values) > 0.06) == still


def test_a_command_that_has_only_just_come_has_moved_nothing_yet() -> None:
    mission = simulated()
    columns = dict(mission.columns)
    t = np.arange(columns["steer.front.u"].size) / 100.0
    opening = np.where((t % 4.0) < 1.0, 0.3, 0.0)
    rate = np.roll(np.where(opening > 0.0, 0.1, 0.0), 20)
    columns["steer.front.u"], columns["steer.front.phi"] = opening, np.cumsum(rate) / 100.0
    assert np.nanmax(commanded_still(in_cells(replace(mission, columns=columns), base=True), 0)) < 0.06


def test_where_an_opening_is_no_speed_nothing_clears_what_lies_behind_a_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("diagnosis.clearing.wheels.openings_tell", lambda *_: False)
    behind = [c for c in checks_of(in_cells(simulated(), base=False), HYDRAULIC) if c.check is Check.BEHIND]
    assert [c.component for c in behind] == ["FR", "FL", "RR", "RL"]
    assert not any(c.passed for c in behind)
    assert "nothing tells what lies behind its valve" in behind[0].text
    mission = simulated()
    once = {name: x for name, x in mission.columns.items() if not name.endswith("_true")}
    spool = checks_of(in_cells(replace(mission, columns=once), base=False), HYDRAULIC)
    assert [c.component for c in spool if c.check is Check.BEHIND] == ["FR", "FL", "RR", "RL"]
    assert not [
        c for c in checks_of(in_cells(mission, base=True), HYDRAULIC) if c.check is Check.BEHIND
    ]  # carried or not


@pytest.mark.filterwarnings("ignore:Mean of empty slice")  # no other wheel
@pytest.mark.parametrize(("wheels", "spikes", "doubted"), [(1, False, False), (1, True, True), (2, False, True)])
def test_a_lone_drive_may_jump_as_its_command_does(wheels: int, *, spikes: bool, doubted: bool) -> None:
    asked = np.where(np.arange(100) % 40 < 20, 1.0, 0.0)[:, None]
    speed = np.r_[np.zeros((2, 1)), asked[:-2]]
    if spikes:
        speed[::7] += 0.6
    beside = [np.full((100, wheels - 1), 0.5)]
    cells = SimpleNamespace(
        frame=Frame(100, 30, 5), machine=SimpleNamespace(max_speed=1.2), dt=0.1, reference=np.repeat(asked, wheels, 1)
    )
    rough = roughness_of(cells, np.hstack([speed, *beside]), np.hstack([asked, *beside]))  # type: ignore[arg-type]
    assert bool(np.nanmax(rough.quick[:, 0] / rough.size[:, 0]) > ROUGH) is doubted


@pytest.mark.filterwarnings("ignore:Mean of empty slice")  # no other wheel
@pytest.mark.parametrize("noisy", [False, True])
def test_a_lone_drive_without_commands_may_start_and_stop_but_not_go_back_and_forth(*, noisy: bool) -> None:
    speed = np.convolve(np.where(np.arange(100) % 40 < 20, 1.0, 0.0), [0.3, 0.7], mode="same")[:, None]
    if noisy:
        speed = speed + np.random.default_rng(1).normal(0.0, 0.3, speed.shape)
    cells = SimpleNamespace(
        frame=Frame(100, 30, 5), machine=SimpleNamespace(max_speed=1.2), dt=0.1, reference=np.full((100, 1), np.nan)
    )
    rough = roughness_of(cells, speed)  # type: ignore[arg-type]
    assert bool(np.nanmax(rough.quick[:, 0] / rough.size[:, 0]) > ROUGH) is noisy


@pytest.mark.parametrize(("told_by", "open_"), [(None, True), ("u", False), ("phi_true", False), ("yaw", False)])
def test_an_angle_whose_scale_nothing_tells_clears_no_axle(told_by: str | None, open_: bool) -> None:
    mission = simulated()
    dropped = {f"steer.front.{leaf}" for leaf in ("u", "u_applied", "phi_true") if leaf != told_by}
    columns = {n: x for n, x in mission.columns.items() if n not in dropped}
    if told_by == "yaw":
        columns["imu.yaw_rate"] = np.zeros(mission.stamps.size)
    cells = in_cells(replace(mission, columns=columns), base=False)
    asked = [c for c in checks_of(cells, HYDRAULIC) if c.check is Check.ANGLE_SCALE and c.component == "front"]
    assert bool(asked) is open_
    assert not any(c.passed for c in asked)
    assert all("as large as it reads" in c.text for c in asked)


@pytest.mark.parametrize(
    ("made", "behind"), [((0.05, 0.98), 0.93), ((0.05, 0.1), 0.0), ((0.95, 0.98), 0.03), ((0.05,), 0.0)]
)
def test_a_wheel_that_hardly_answers_beside_one_that_does_is_behind(made: tuple[float, ...], behind: float) -> None:
    """Where both do not, the machine does not follow; a lone drive has nothing beside it."""
    assert behind_all_through(np.array(made), 0) == pytest.approx(behind)
