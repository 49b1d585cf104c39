"""Injected faults do what the truth file says, and the schedules keep their promises."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from replay.atomic_write import atomic_path
from replay.errors import ConfigError, OutputError
from replay.faults import FaultMode, FaultSpec, Side
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission
from replay.truth import read_truth, write_truth
from tests.campaigns import campaign

NAN = float("nan")
LSB = 2500 / 4096 / 60 * np.pi * 0.854 / 17.7


def mission_with(*faults: FaultSpec, duration: float = 30.0, **options: object) -> SimulatedMission:
    return simulate_mission(
        SimulationOptions(scenario="healthy", duration_s=duration, faults=faults, **options)  # type: ignore[arg-type]
    )


def rows(fault: FaultSpec) -> slice:
    return slice(round(fault.start_s * 1000), round(fault.stop_s * 1000))


def test_stuck_sensor_holds_its_last_value_and_says_so() -> None:
    fault = FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 10.0, 14.0, 1.0, NAN)
    mission = mission_with(fault)
    v = mission.columns["wheel.FR.v"]
    assert_array_equal(v[rows(fault)], v[9999])
    assert mission.truth.intervals[0].sat_mean == pytest.approx(v[9999])
    assert np.ptp(v[14000:14100]) > 0
    assert [(m.component, m.start_s, m.stop_s) for m in mission.truth.masked] == [("FR", 10.0, 14.0)]


def test_stuck_sensor_jumps_to_a_given_value_from_the_first_sample_on() -> None:
    fault = FaultSpec("RL", Side.SENSOR, FaultMode.STUCK, 0.0, 5.0, 1.0, 0.2)
    v = mission_with(fault).columns["wheel.RL.v"]
    assert_allclose(v[rows(fault)], 0.2, atol=LSB / 2)
    assert np.ptp(v[rows(fault)]) == 0


@pytest.mark.parametrize("silent", ["zero", "nan", "drop"])
def test_silent_sensor(silent: str) -> None:
    fault = FaultSpec("FL", Side.SENSOR, FaultMode.NO_SIGNAL, 10.0, 13.0)
    mission = mission_with(fault, silent=silent, evidence="direct")
    v = mission.columns["wheel.FL.v"]
    assert_array_equal(v[rows(fault)], 0.0 if silent == "zero" else NAN)
    assert not np.isnan(np.delete(v, np.arange(10_000, 13_000))).any()
    assert np.abs(mission.columns["wheel.FL.v_true"][rows(fault)]).max() > 0.1


def test_inefficient_sensor_scales_the_speed() -> None:
    fault = FaultSpec("RR", Side.SENSOR, FaultMode.INEFFICIENT, 5.0, 25.0, 0.4)
    mission = mission_with(fault)
    y, v = mission.columns["wheel.RR.v"][rows(fault)], mission.actual["wheel.RR.v"][rows(fault)]
    slope, offset = np.polyfit(v, y, 1)
    assert slope == pytest.approx(0.6, abs=0.005)
    assert offset == pytest.approx(0.0, abs=0.002)


@pytest.mark.parametrize("tau", [0.0, 0.05])
def test_noisy_sensor_has_the_injected_mean_and_power(tau: float) -> None:
    fault = FaultSpec("RR", Side.SENSOR, FaultMode.NOISY, 2.0, 29.0, 0.4, 0.05, 0.1, tau)
    mission = mission_with(fault)
    y, v = mission.columns["wheel.RR.v"][rows(fault)], mission.actual["wheel.RR.v"][rows(fault)]
    rest = y - 0.6 * v
    assert rest.mean() == pytest.approx(0.4 * 0.05, abs=0.004)
    assert rest.std() == pytest.approx(0.4 * 0.1, rel=0.1)
    neighbours = np.corrcoef(rest[1:], rest[:-1])[0, 1]
    assert neighbours == pytest.approx(np.exp(-1 / 50) if tau else 0.0, abs=0.03)


def test_actuator_faults_apply_l8() -> None:
    stuck = FaultSpec("FR", Side.ACTUATOR, FaultMode.STUCK, 3.0, 6.0, 1.0, 0.1)
    silent = FaultSpec("FL", Side.ACTUATOR, FaultMode.NO_SIGNAL, 3.0, 6.0)
    weak = FaultSpec("RR", Side.ACTUATOR, FaultMode.INEFFICIENT, 3.0, 29.0, 0.7)
    disturbed = FaultSpec("RL", Side.ACTUATOR, FaultMode.NOISY, 3.0, 29.0, 0.4, 0.1, 0.05, 0.2)
    mission = mission_with(stuck, silent, weak, disturbed)
    applied = {w: mission.actual[f"wheel.{w}.u_applied"] for w in ("FR", "FL", "RR", "RL")}
    u = {w: mission.columns[f"wheel.{w}.u"] for w in applied}
    assert_array_equal(applied["FR"][rows(stuck)], 0.1)
    assert_array_equal(applied["FL"][rows(silent)], 0.0)
    assert_allclose(applied["RR"][rows(weak)], 0.3 * u["RR"][rows(weak)], atol=1e-6)
    rest = (applied["RL"] - 0.6 * u["RL"])[rows(disturbed)]
    assert rest.mean() == pytest.approx(0.04, abs=0.01)
    assert rest.std() == pytest.approx(0.4 * 0.05, rel=0.2)
    assert_allclose(applied["FR"][6000:], u["FR"][6000:], atol=1e-6)
    assert mission.truth.masked == ()


def test_epsilon_grows_linearly_over_its_ramp() -> None:
    sensor = FaultSpec("FR", Side.SENSOR, FaultMode.INEFFICIENT, 8.0, 14.0, 0.6, ramp_s=4.0)
    valve = FaultSpec("RL", Side.ACTUATOR, FaultMode.STUCK, 8.0, 14.0, 1.0, 0.1, ramp_s=2.0)
    mission = mission_with(sensor, valve, duration=16.0)
    y, v = mission.columns["wheel.FR.v"], mission.actual["wheel.FR.v"]
    for at, epsilon in ((9.0, 0.15), (10.0, 0.3), (13.0, 0.6)):
        rows_ = slice(round(at * 1000) - 50, round(at * 1000) + 50)
        assert 1 - y[rows_].mean() / v[rows_].mean() == pytest.approx(epsilon, abs=0.01)
    u, applied = mission.columns["wheel.RL.u"], mission.actual["wheel.RL.u_applied"]
    share = np.minimum(1.0, np.arange(1, 6001) / 2000)
    assert_allclose(applied[8000:14_000], (1 - share) * u[8000:14_000] + share * 0.1, atol=1e-6)
    assert [(i.component, i.start_s, i.epsilon, i.ramp_s) for i in mission.truth.intervals] == [
        ("FR", 8.0, 0.6, 4.0),
        ("RL", 8.0, 1.0, 2.0),
    ]


def test_scenarios_may_have_growing_and_early_faults() -> None:
    base = {"scenario": "random", "rate_hz": 50.0, "seed": 3, "duration_s": 120.0}
    plain, varied = (
        simulate_mission(SimulationOptions(**base, **more)).truth.intervals  # type: ignore[arg-type]
        for more in ({}, {"ramp_share": 0.5, "ramp_max_s": 3.0, "early_share": 1.0})
    )
    early = [i for i in varied if i.start_s == 0.0]
    assert len(early) >= 2
    assert [(i.component, i.start_s) for i in varied if i.start_s > 0] == [(i.component, i.start_s) for i in plain]
    ramps = np.array([i.ramp_s for i in varied if i.start_s > 0])
    assert 0.2 < np.mean(ramps > 0) < 0.8
    assert 0.5 <= ramps[ramps > 0].min() <= ramps.max() <= 3.0
    assert all(i.ramp_s < i.stop_s - i.start_s for i in varied)


def test_redundant_measurements_have_noise_delay_and_resolution_of_their_own() -> None:
    mission = mission_with(evidence="direct")
    for name, delay, std, lsb in (
        ("wheel.FR.v:v_true", 3, 0.002, 0.001),
        ("wheel.FR.u_applied:u_applied", 2, 0.003, 2 / 4096),
        ("steer.front.phi:phi_true", 3, 0.001, 0.0005),
    ):
        actual_name, _, leaf = name.partition(":")
        true = mission.actual[actual_name]
        measured = mission.columns[f"{actual_name.rpartition('.')[0]}.{leaf}"]
        rest = measured[delay:] - true[:-delay]
        assert rest.std() == pytest.approx(np.hypot(std, lsb / np.sqrt(12)), rel=0.05)
        assert abs(rest.mean()) < std / 20
        assert_allclose(measured / lsb, np.round(measured / lsb), atol=1e-6)


def test_steering_faults_move_the_axle_or_its_sensor() -> None:
    sensor = FaultSpec("front", Side.SENSOR, FaultMode.STUCK, 5.0, 9.0, 1.0, 0.2)
    valve = FaultSpec("rear", Side.ACTUATOR, FaultMode.STUCK, 5.0, 7.0, 1.0, 0.02)
    mission = mission_with(sensor, valve)
    assert_allclose(mission.columns["steer.front.phi"][rows(sensor)], 0.2, atol=2e-4)
    # A valve stuck at 0.02 turns the axle at 4·0.02 rad/s.
    turned = mission.actual["steer.rear.phi"][7000] - mission.actual["steer.rear.phi"][6000]
    assert turned == pytest.approx(0.08, rel=0.01)
    assert {(i.component, i.kind) for i in mission.truth.intervals} == {("front", "steer"), ("rear", "steer")}


def test_the_papers_mission_has_its_faults() -> None:
    mission = simulate_mission(SimulationOptions(scenario="paper", rate_hz=100))
    truth = mission.truth
    stuck = [i for i in truth.intervals if (i.component, i.side, i.mode) == ("FR", "sensor", "stuck")]
    assert [i.start_s for i in stuck] == [30.0, 100.0, 200.0]
    rows_of_tables = {(i.component, i.side, i.mode) for i in truth.intervals}
    modes = (FaultMode.STUCK, FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT, FaultMode.NOISY)
    assert rows_of_tables == {(w, s, m) for w in truth.wheels for s in (Side.SENSOR, Side.ACTUATOR) for m in modes}
    for interval in truth.intervals:
        assert 3.0 - 1e-9 <= interval.stop_s - interval.start_s <= 12.0
        assert interval.start_s >= 50.0 or interval in stuck
        assert interval.stop_s <= 235.0
        assert abs(mission.columns["cmd.v"][round(interval.start_s * 100)]) > 0.1
    v_ref = mission.columns["cmd.v"]
    assert v_ref.max() > 0.3
    assert v_ref.min() < -0.25
    assert np.degrees(np.abs(mission.columns["steer.front.phi_ref"]).max()) == pytest.approx(35.0, abs=0.5)
    assert len(truth.slip) > 0


@pytest.mark.parametrize("seed", campaign(range(5)))
def test_random_faults_do_not_overlap_on_one_side_and_cover_the_tables(seed: int) -> None:
    options = SimulationOptions(scenario="random", rate_hz=50, seed=seed, steering_faults=True)
    intervals = simulate_mission(options).truth.intervals
    assert len(intervals) > 20
    for part, side in {(i.component, i.side) for i in intervals}:
        mine = [i for i in intervals if (i.component, i.side) == (part, side)]
        assert all(a.stop_s <= b.start_s for a, b in pairwise(mine))
    assert len({(i.side, i.mode) for i in intervals}) == 8
    assert all(np.isfinite([i.sat_mean, i.sat_std, i.epsilon]).all() for i in intervals)


def test_driving_spans_are_those_of_the_true_reference() -> None:
    mission = simulate_mission(SimulationOptions(scenario="healthy", duration_s=60.0, rate_hz=100))
    t = np.arange(6000) / 100
    flag = np.zeros(6000, np.bool_)
    for span in mission.truth.driving:
        if span.component == "RL":
            flag |= (t >= span.start_s - 1e-9) & (t < span.stop_s - 1e-9)
    assert np.mean(flag == (np.abs(mission.actual["wheel.RL.v_ref"]) > 0.05)) > 0.99


def test_truth_file_round_trip(tmp_path: Path) -> None:
    truth = simulate_mission(SimulationOptions(scenario="paper", rate_hz=50, seed=9, ramp_share=0.5)).truth
    write_truth(truth, tmp_path / "m.truth.json")
    again = read_truth(tmp_path / "m.truth.json")
    assert again.wheels == truth.wheels
    assert (again.rate_hz, again.start_ns, again.duration_s) == (50.0, truth.start_ns, 240.0)
    assert [(i.component, i.side, i.mode, i.start_s) for i in again.intervals] == [
        (i.component, i.side, i.mode, i.start_s) for i in truth.intervals
    ]
    assert_allclose([i.sat_mean for i in again.intervals], [i.sat_mean for i in truth.intervals], atol=1e-9)
    assert [i.ramp_s for i in again.intervals] == [i.ramp_s for i in truth.intervals]
    assert len(again.slip) == len(truth.slip)
    assert again.masked == truth.masked
    assert not again.open_loop


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("{", "not JSON"),
        ("[]", "schema"),
        ('{"schema": "mfhca-truth/9"}', "mfhca-truth/1"),
        ('{"schema": "mfhca-truth/1", "wheels": []}', "complete"),
    ],
)
def test_other_files_are_no_truth_files(tmp_path: Path, text: str, word: str) -> None:
    path = tmp_path / "x.json"
    path.write_text(text)
    with pytest.raises(ConfigError, match=word):
        read_truth(path)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_truth(tmp_path / "absent.json")


def test_results_appear_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "result.txt"
    with atomic_path(path) as temporary:
        temporary.write_text("whole")
        assert not path.exists()
    assert path.read_text() == "whole"
    with pytest.raises(TypeError), atomic_path(path) as temporary:
        temporary.write_bytes(b"half" + "text")  # type: ignore[operator]
    assert path.read_text() == "whole"
    assert [p.name for p in path.parent.iterdir()] == ["result.txt"]


def test_wrong_places_are_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "keep").write_text("x")
    with pytest.raises(OutputError, match="cannot be written"), atomic_path(tmp_path / "file" / "below"):
        pass
    with pytest.raises(OutputError, match="is a folder"), atomic_path(tmp_path / "folder"):
        pass
    with pytest.raises(OutputError, match="holds other files"), atomic_path(tmp_path / "folder", folder=True):
        pass
    with pytest.raises(OutputError, match="is a file"), atomic_path(tmp_path / "file", folder=True):
        pass
    assert (tmp_path / "folder" / "keep").exists()
