"""The simulated machine obeys its physics and its law."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from replay.control.kinematics import wheel_commands
from replay.errors import ConfigError
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import haulotte
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.plant_options import PlantOptions
from replay.simulation.run import simulate_mission

WHEELS = ("FR", "FL", "RR", "RL")
ALIKE = PlantOptions(wheel_spread=0.0)


def stack(mission: SimulatedMission, leaf: str, *, actual: bool = True) -> np.ndarray:
    source = mission.actual if actual else mission.columns
    return np.column_stack([source[f"wheel.{w}.{leaf}"] for w in WHEELS])


def open_valves(openings: tuple[float, ...], *, plant: PlantOptions = ALIKE) -> SimulatedMission:
    """Wheels off level ground, each valve stuck at an opening from the first sample on."""
    faults = tuple(
        FaultSpec(w, Side.ACTUATOR, FaultMode.STUCK, 0.0, 99.0, 1.0, u) for w, u in zip(WHEELS, openings, strict=True)
    )
    return simulate_mission(
        SimulationOptions(scenario="healthy", duration_s=3.0, coupling="free", slopes=False, faults=faults, plant=plant)
    )


@pytest.fixture(scope="module")
def healthy() -> SimulatedMission:
    return simulate_mission(SimulationOptions(scenario="healthy", duration_s=120.0))


def test_healthy_machine_tracks_its_commands(healthy: SimulatedMission) -> None:
    error = np.abs(stack(healthy, "v") - stack(healthy, "v_ref"))
    assert 0.012 < error.mean() < 0.03
    assert healthy.truth.intervals == ()
    assert np.abs(stack(healthy, "v_ref")).max() > 0.25


def test_open_valves_give_the_steady_state_speed() -> None:
    mission = open_valves((0.1, -0.1, 0.05, 0.0))
    # K·u once the lag of 0.25 s has died out
    assert_allclose(stack(mission, "v")[-1], [0.24, -0.24, 0.12, 0.0], atol=1e-4)
    assert_allclose(stack(mission, "v")[250, 0], 0.24 * (1 - np.exp(-1)), rtol=0.01)


def test_the_pump_limits_all_wheels_together() -> None:
    # 63 l/min over 100 cm³ per turn, gear 17.7 and 2π·0.427 m per wheel turn
    total = 63e-3 / 60 / 100e-6 / 17.7 * np.pi * 0.854
    assert_allclose(total / 4, 0.398, atol=0.001)
    assert_allclose(stack(open_valves((1.0, 1.0, 1.0, 1.0)), "v")[-1], total / 4, rtol=1e-3)
    assert_allclose(stack(open_valves((0.5, 0.0, 0.0, 0.0)), "v")[-1], [1.2, 0.0, 0.0, 0.0], atol=1e-3)
    assert_allclose(stack(open_valves((1.0, 0.5, 0.0, 0.0)), "v")[-1], [total * 2 / 3, total / 3, 0, 0], atol=1e-3)


def test_dead_zone_and_valve_lag() -> None:
    plant = PlantOptions(wheel_spread=0.0, dead_zone=0.03, valve_lag=0.1)
    mission = open_valves((0.02, 0.1, 0.1, 0.1), plant=plant)
    assert_allclose(stack(mission, "v")[-1], [0.0, 0.168, 0.168, 0.168], atol=1e-3)
    assert stack(mission, "v")[100, 1] < stack(open_valves((0.1, 0.1, 0.1, 0.1)), "v")[100, 1]


def test_machine_without_drive_stands_still() -> None:
    faults = tuple(FaultSpec(w, Side.ACTUATOR, FaultMode.NO_SIGNAL, 0.0, 99.0) for w in WHEELS)
    mission = simulate_mission(SimulationOptions(scenario="healthy", duration_s=5.0, slopes=False, faults=faults))
    # Steering alone turns a wheel about its offset; nothing else moves.
    assert np.abs(stack(mission, "v")).max() < 0.25 * 0.20
    assert np.abs(mission.actual["body.x"]).max() < 0.02
    noise = mission.columns["wheel.FR.v"] - mission.actual["wheel.FR.v"]
    assert np.std(noise) == pytest.approx(0.004, rel=0.1)


@pytest.mark.parametrize("coupling", ["free", "ground"])
def test_slope_costs_speed(coupling: str) -> None:
    faults = tuple(FaultSpec(w, Side.ACTUATOR, FaultMode.STUCK, 0.0, 99.0, 1.0, 0.1) for w in WHEELS)
    made = [
        simulate_mission(
            SimulationOptions(
                scenario="paper", duration_s=80.0, rate_hz=100, coupling=coupling, ice=0.0, slopes=slopes, faults=faults
            )
        )
        for slopes in (False, True)
    ]
    level, hill = (stack(m, "v")[7900].mean() for m in made)
    # m·g·slope/4 on each wheel, times the droop
    assert level - hill == pytest.approx(6650 * 9.81 * 0.07 / 4 * 1e-5, rel=0.05)


def test_tyres_slip_on_ice() -> None:
    made = [
        simulate_mission(SimulationOptions(scenario="paper", faults=(), duration_s=90.0, rate_hz=200, ice=ice))
        for ice in (0.0, 0.5)
    ]
    seconds = [sum(s.stop_s - s.start_s for s in m.truth.slip) for m in made]
    assert seconds[1] > 2 * seconds[0] + 1.0
    free = simulate_mission(SimulationOptions(scenario="healthy", duration_s=30.0, coupling="free", ice=0.6))
    assert free.truth.slip == ()


def test_friction_bounds_the_body() -> None:
    mission = simulate_mission(SimulationOptions(scenario="random", duration_s=60.0, slopes=False))
    acceleration = np.diff(mission.actual["body.v"]) * 1000.0
    # friction 0.6 plus rolling resistance 0.03; wheels turned inwards push a little less or more than straight ones
    assert np.abs(acceleration).max() < 0.63 * 9.81 * 1.6


def test_free_wheel_follows_its_difference_equation() -> None:
    options = SimulationOptions(scenario="random", duration_s=20.0, coupling="free", slopes=False, plant=ALIKE)
    mission = simulate_mission(options)
    v, u = stack(mission, "v"), stack(mission, "u_applied")
    share = np.minimum(1.0, 4 * 0.398083 / np.maximum(2.4 * np.abs(u).sum(axis=1, keepdims=True), 1e-9))
    # τ v̇ = −v + K u
    predicted = v + 1e-3 / 0.25 * (share * 2.4 * u - v)
    assert_allclose(v[1:], predicted[:-1], atol=1e-5)


def test_leakage_takes_speed_at_any_load_but_never_turns_a_wheel() -> None:
    mission = open_valves((0.1, -0.1, 0.002, 0.0), plant=PlantOptions(wheel_spread=0.0, leakage=0.02))
    # K·u − leakage where the flow is larger, hardly any speed where it is smaller
    slow = 0.0048 - 0.02 * np.tanh(0.0048 / 0.02)
    assert_allclose(stack(mission, "v")[-1], [0.22, -0.22, slow, 0.0], atol=1e-4)


def test_wheels_may_differ_in_lag_alone() -> None:
    mission = open_valves((0.1, 0.1, 0.1, 0.1), plant=PlantOptions(wheel_spread=0.0, tau_spread=0.2))
    assert_allclose(stack(mission, "v")[-1], 0.24, atol=1e-3)
    assert np.ptp(stack(mission, "v")[250]) > 0.01


def test_steeper_ground_is_steeper() -> None:
    made = [
        simulate_mission(SimulationOptions(scenario="healthy", duration_s=40.0, rate_hz=100, seed=2, steepness=s))
        for s in (0.0, 1.0, 3.0)
    ]
    effort = [np.abs(stack(m, "u_applied", actual=True)[2500:]).mean() for m in made]
    flat = simulate_mission(SimulationOptions(scenario="healthy", duration_s=40.0, rate_hz=100, seed=2, slopes=False))
    assert_array_equal(stack(made[0], "v"), stack(flat, "v"))
    assert len(set(effort)) == 3


def test_event_reset_sets_psi_anew_at_jumps_of_the_error_and_decays_between() -> None:
    fault = FaultSpec("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL, 12.0, 16.0)
    options = SimulationOptions(
        scenario="paper", duration_s=20.0, law="event_reset", faults=(fault,), coupling="free", slopes=False
    )
    mission = simulate_mission(options)
    v, v_ref, psi = stack(mission, "v", actual=False), stack(mission, "v_ref"), stack(mission, "psi")
    rho = 0.001 + np.abs(v_ref) + np.abs(v) + 1.0
    decays = np.isclose(psi[1:], psi[:-1] * np.exp(-rho[1:] * 1e-3), rtol=1e-9)
    jumps = np.flatnonzero(~decays[:, 0]) + 1
    assert np.any((jumps > 12_000) & (jumps < 12_500))
    assert jumps.size < 12
    expected = v_ref - v + np.where(v_ref >= 0, 1.0, -1.0) * psi**2
    assert_allclose(stack(mission, "u", actual=False), np.clip(expected, -1, 1), atol=1e-6)


@pytest.mark.parametrize("law", ["opposed", "signed", "printed", "sign_abs", "p"])
def test_recorded_command_obeys_the_law(law: str) -> None:
    mission = simulate_mission(SimulationOptions(scenario="random", duration_s=40.0, law=law, psi0=0.3))
    v, v_ref, psi = stack(mission, "v", actual=False), stack(mission, "v_ref"), stack(mission, "psi")
    e, s = v - v_ref, np.where(v_ref >= 0, 1.0, -1.0)
    expected = {
        "opposed": -e - np.sign(e) * psi**2,
        "signed": -e + s * psi**2,
        "printed": np.abs(v_ref) - np.abs(v) + psi**2,
        "sign_abs": s * (np.abs(v_ref) - np.abs(v) + psi**2),
        "p": -e,
    }[law]
    assert_allclose(stack(mission, "u", actual=False), np.clip(expected, -1, 1), atol=1e-6)


def test_psi_decays_as_printed_and_is_forced_as_chosen() -> None:
    for law, zeta in (("signed", 0.0), ("opposed", 1000.0)):
        mission = simulate_mission(SimulationOptions(scenario="healthy", duration_s=10.0, law=law, psi0=0.5))
        v, v_ref, psi = stack(mission, "v", actual=False), stack(mission, "v_ref"), stack(mission, "psi")
        rho = 0.001 + np.abs(v_ref) + np.abs(v) + 1.0
        forced = psi[:-1] * np.exp(-rho[1:] * 1e-3) + 0.5 * zeta * (v - v_ref)[1:] ** 2 * 1e-3
        assert_allclose(psi[1:], forced, rtol=1e-9)


def test_printed_law_drives_forward_on_a_reverse_command() -> None:
    # Valves closed while the command turns from forward to backward: the law then starts from standstill.
    faults = tuple(FaultSpec(w, Side.ACTUATOR, FaultMode.NO_SIGNAL, 39.0, 44.0) for w in WHEELS)
    ends = {}
    for law in ("printed", "signed", "opposed"):
        options = SimulationOptions(
            scenario="paper", duration_s=54.0, rate_hz=100, law=law, faults=faults, ice=0.0, slopes=False
        )
        mission = simulate_mission(options)
        assert (stack(mission, "v_ref")[4800:5300] < -0.1).all()
        ends[law] = stack(mission, "v")[4800:5300].mean()
    assert ends["printed"] > 0.15
    assert ends["signed"] < -0.1
    assert ends["opposed"] < -0.2


def test_printed_law_has_no_stable_reverse_equilibrium() -> None:
    # Started in reverse at the command by an actuator fault, the printed law leaves it as soon as it may act.
    faults = tuple(FaultSpec(w, Side.ACTUATOR, FaultMode.STUCK, 41.0, 46.0, 1.0, -0.11) for w in WHEELS)
    options = SimulationOptions(
        scenario="paper", duration_s=54.0, rate_hz=100, law="printed", faults=faults, ice=0.0, coupling="free"
    )
    v = stack(simulate_mission(options), "v")
    assert v[4590].mean() == pytest.approx(-0.26, abs=0.03)
    assert v[5390].mean() > 0.15


def test_references_agree_with_the_replayed_kinematics(healthy: SimulatedMission) -> None:
    machine = haulotte()
    assert machine.geometry is not None
    v, omega = healthy.columns["cmd.v"], healthy.columns["cmd.omega"]
    command = wheel_commands(v, omega, machine.geometry, dt=1e-3, max_steer=machine.max_steer)
    assert np.median(np.abs(command.speed - stack(healthy, "v_ref"))) < 1e-4
    axles = np.column_stack([healthy.columns["steer.front.phi_ref"], healthy.columns["steer.rear.phi_ref"]])
    moving = np.abs(v) > 0.02
    assert_allclose(command.axle_angle[moving], axles[moving], atol=1e-3)
    assert_allclose(axles[:, 0], -axles[:, 1], atol=1e-6)


def test_steering_follows_and_turns_the_body(healthy: SimulatedMission) -> None:
    error = healthy.actual["steer.front.phi"] - healthy.columns["steer.front.phi_ref"]
    assert np.abs(error).max() < 0.12
    kappa = np.tan(healthy.actual["steer.front.phi"]) - np.tan(healthy.actual["steer.rear.phi"])
    expected = kappa / 2.1 * healthy.actual["body.v"]
    assert_allclose(healthy.actual["body.omega"], expected, atol=2e-3)
    yaw = np.cumsum(healthy.actual["body.omega"]) * 1e-3
    assert_allclose(healthy.actual["body.yaw"], yaw, atol=0.01)


def test_same_seed_same_mission_other_seed_other_mission() -> None:
    options = [SimulationOptions(duration_s=5.0, rate_hz=100, seed=s) for s in (4, 4, 5)]
    first, again, other = (simulate_mission(o).columns["wheel.FR.v"] for o in options)
    assert_array_equal(first, again)
    assert np.any(first != other)


@pytest.mark.parametrize("rate", [1000.0, 300.0])
def test_blocks_give_the_numbers_of_the_whole(rate: float) -> None:
    faults = (
        FaultSpec("FR", Side.SENSOR, FaultMode.NOISY, 0.0, 2.5, 0.4, 0.05, 0.1, 0.05),
        FaultSpec("RL", Side.ACTUATOR, FaultMode.STUCK, 1.0, 2.0, 1.0, float("nan")),
    )
    options = SimulationOptions(duration_s=4.0, rate_hz=rate, faults=faults, ice=0.3)
    whole, parts = simulate_mission(options), simulate_mission(options, block=777)
    assert whole.columns.keys() == parts.columns.keys()
    for name, values in whole.columns.items():
        assert_array_equal(values, parts.columns[name])
    for name, values in whole.actual.items():
        assert_array_equal(values, parts.actual[name])
    assert whole.truth == parts.truth


@pytest.mark.parametrize("rate", [50.0, 62.5, 300.0, 1000.0])
def test_any_recorded_rate_has_a_uniform_grid(rate: float) -> None:
    mission = simulate_mission(SimulationOptions(duration_s=4.0, rate_hz=rate))
    assert mission.stamps.size == int(4 * rate)
    assert_allclose(np.diff(mission.stamps), 1e9 / rate, atol=1000)
    assert all(values.size == mission.stamps.size for values in mission.columns.values())
    for group in mission.slow:
        assert np.isin(group.stamps, mission.stamps).all()


def test_late_stamps_stay_within_their_step() -> None:
    options = [SimulationOptions(duration_s=4.0, rate_hz=200, evidence="direct", jitter=j) for j in (0.0, 0.8)]
    exact, late = (simulate_mission(o) for o in options)
    delay = late.stamps - exact.stamps
    assert delay[0] == 0
    assert 0 <= delay.min() < 100_000 < 3_900_000 < delay.max() <= 4_000_000
    assert np.diff(late.stamps).min() > 0
    assert_array_equal(late.columns["wheel.FR.v"], exact.columns["wheel.FR.v"])
    assert all(np.isin(group.stamps, late.stamps).all() for group in late.slow)


@pytest.mark.parametrize("burst", [0.0, 0.2])
def test_rows_are_lost_by_group_of_channels(burst: float) -> None:
    mission = simulate_mission(SimulationOptions(duration_s=60.0, rate_hz=100, drop_share=0.1, drop_burst_s=burst))
    series = {name: (stamps, values) for name, stamps, values in mission.series()}
    assert series.keys() >= mission.columns.keys()
    assert len(mission.kept) == 6
    for rows in mission.kept.values():
        assert 0.8 < rows.mean() < 0.97
        lost = np.flatnonzero(np.diff(rows.astype(np.int8)) == -1).size
        assert (~rows).sum() / lost == pytest.approx(max(1.0, burst * 100), rel=0.5)
    assert np.any(mission.kept["sensors"] != mission.kept["commands"])
    rows = mission.kept["sensors"]
    for name in ("wheel.FR.v", "steer.rear.phi"):
        assert_array_equal(series[name][0], mission.stamps[rows])
        assert_array_equal(series[name][1], mission.columns[name][rows])


def test_each_evidence_level_logs_what_it_says() -> None:
    leaves = {}
    for level in ("base", "spool", "direct"):
        mission = simulate_mission(SimulationOptions(duration_s=1.0, rate_hz=50, evidence=level))
        leaves[level] = {name.rpartition(".")[2] for name in mission.columns}
        assert (len(mission.slow) == 0) == (level == "base")
    assert leaves["base"] == {"v", "omega", "v_ref", "u", "phi", "phi_ref"}
    assert leaves["spool"] == leaves["base"] | {"u_applied"}
    assert leaves["direct"] == leaves["spool"] | {"v_true", "phi_true"}


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"scenario": "moon"}, "scenario"),
        ({"rate_hz": 20.0}, "rate_hz"),
        ({"ice": 2.0}, "ice"),
        ({"jitter": 1.0}, "jitter"),
        ({"drop_share": 0.6}, "drop_share"),
        ({"steepness": -1.0}, "steepness"),
        ({"early_share": 2.0}, "early_share"),
        ({"law": "auto"}, "law"),
        ({"faults": (FaultSpec("XX", Side.SENSOR, FaultMode.STUCK, 0, 1),)}, "XX"),
        ({"faults": (FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 2, 1),)}, "interval"),
        ({"faults": (FaultSpec("FR", Side.SENSOR, FaultMode.NOISY, 0, 1, 1.5),)}, "epsilon"),
    ],
)
def test_wrong_options_are_named(change: dict[str, object], word: str) -> None:
    with pytest.raises(ConfigError, match=word):
        SimulationOptions(**change)  # type: ignore[arg-type]


def test_overlapping_faults_of_one_part_and_side_are_refused() -> None:
    faults = tuple(FaultSpec("FR", Side.SENSOR, FaultMode.NO_SIGNAL, t, t + 2.0) for t in (0.0, 1.0))
    with pytest.raises(ConfigError, match="overlap at 1 s"):
        simulate_mission(SimulationOptions(duration_s=4.0, faults=faults))
