"""Real logs: what can be judged is judged, and the rest is said to be unjudged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.drives.assess import assess_drive
from diagnosis.drives.inputs import DriveData, drive_data
from diagnosis.fitting.drives import fit_drives
from diagnosis.pipeline import diagnose, diagnose_signals
from diagnosis.results.result import MissionResult
from replay.control.loop import replay_loop
from replay.errors import LogError
from replay.faults import FaultMode, FaultSpec, Side
from replay.injection.inject import inject_signals
from replay.machine.config import Machine, haulotte
from replay.machine.drive_model import DriveModel
from replay.machine.toml_file import load_machine
from replay.machine.toml_text import dump_machine
from replay.mission import read_signals
from replay.signals.signal import Signals
from replay.signals.timeline import align
from tests.campaigns import campaign

ROSA = """
[machine]
name = "motor rig"
wheels = ["M"]
[geometry]
max_speed = 400
[control]
law = "none"
u_max = 100
[sources]
"*.csv.gz" = { time = "Rel Time", time_unit = "ms" }
[signals]
"wheel.M.v_ref" = { column = "Desired Speed", unit = "m/s" }
"wheel.M.v" = { column = "Actual Speed", unit = "m/s" }
"wheel.M.u" = { column = "Shaft Control Effort", unit = "1" }
"""

ARM = """
[machine]
name = "robot arm"
wheels = ["m1", "m2", "m3", "m4", "m5"]
[geometry]
max_speed = 1.5
[control]
law = "none"
[limits]
driving_speed = 0.02
[sources]
"*.csv" = { time = "t_s" }
[signals]
""" + "\n".join(
    f'"wheel.m{i}.v_ref" = {{ column = "cmd_m{i}_rad", unit = "m", derivative = true }}\n'
    f'"wheel.m{i}.v" = {{ column = "resp_m{i}_rad", unit = "m", derivative = true }}'
    for i in range(1, 6)
)


def machine(text: str, folder: Path) -> Machine:
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return load_machine(path)


def serious(result: MissionResult) -> list[tuple[str, str]]:
    return [(f["component"], f["mode"]) for f in result.report["intervals"] if f["severity"] != "info"]


@pytest.mark.parametrize(
    ("log", "error", "reason"),
    [
        ("robot_localization/test1.bag", LogError, "no wheel signal"),
        ("gps_nav_ws/bag", LogError, "no wheel signal"),
    ],
)
def test_a_log_without_evidence_is_refused_with_the_reason(
    reference_data: Path, log: str, error: type[LogError], reason: str
) -> None:
    with pytest.raises(error, match=reason):
        diagnose([reference_data / "reference_logs" / log], haulotte())


def test_a_robot_without_commands_is_neither_blamed_nor_cleared(reference_data: Path) -> None:
    result = diagnose([reference_data / "reference_logs/abitobot"], haulotte())
    assert serious(result) == []
    assert result.report["verdict"]["status"] == "not_assessed"


@pytest.mark.parametrize("robot", ["husky_bag", "warthog_bag"])
def test_the_sensors_of_a_healthy_robot_are_judged_by_its_commands(reference_data: Path, robot: str) -> None:
    folder = reference_data / "fault_data/robots"
    report = diagnose([folder / robot], load_machine(folder / f"{robot}.toml")).report
    assert report["intervals"] == []
    assert report["verdict"]["title"].startswith("No speed sensor fault seen, ")
    assert report["verdict"]["title"].endswith("drives not judged")
    sensors = [c for c in report["coverage"] if c["side"] == "sensor"]
    assert all(c["decided_driving_s"] > 0.8 * c["driving_s"] for c in sensors)


def test_a_disabled_robot_did_not_follow_and_no_wheel_is_blamed(reference_data: Path) -> None:
    folder = reference_data / "fault_data/robots"
    result = diagnose([folder / "warthog_disabled.csv"], load_machine(folder / "warthog_disabled.toml"))
    assert serious(result) == []
    assert result.report["verdict"]["title"] == "The machine did not follow its commands"


@pytest.mark.parametrize("run", campaign(["Healthy_01", "Healthy_02", "Healthy_03", "Healthy_04"]))
def test_no_motor_of_a_healthy_arm_is_flagged(reference_data: Path, tmp_path: Path, run: str) -> None:
    result = diagnose([reference_data / "fault_data/dtr_robot_arm" / f"{run}.csv"], machine(ARM, tmp_path))
    assert serious(result) == []
    assert result.report["verdict"]["status"] == "not_assessed"


@pytest.mark.parametrize("motor", [1, 2, 3, 4])
@pytest.mark.parametrize("run", campaign([1, 2, 3, 4]))
def test_the_stuck_motor_of_the_arm_is_found(reference_data: Path, tmp_path: Path, motor: int, run: int) -> None:
    log = reference_data / "fault_data/dtr_robot_arm" / f"Motor_{motor}_Stuck_{run:02d}.csv"
    result = diagnose([log], machine(ARM, tmp_path))
    assert serious(result) == [(f"m{motor}", "no_signal")]
    assert result.report["intervals"][0]["side"] == "sensor_or_actuator"
    assert result.report["intervals"][0]["start_s"] < 1.0


def healthy_run(reference_data: Path, number: int) -> pd.DataFrame:
    """A healthy run of the motor without the lone rows before and after it, at least 20 s long."""
    name = reference_data / "fault_data/rosa/healthy_mode" / f"merged_data{number}.csv.gz"
    frame = pd.read_csv(name, skipinitialspace=True)
    t = frame["Rel Time"].to_numpy() / 1e3
    inside = np.r_[False, np.ones(t.size - 2, dtype=bool), False]
    return frame[inside].reset_index(drop=True)


@pytest.mark.parametrize("number", campaign([106, 130]))
@pytest.mark.parametrize("mode", ["none", "stuck", "no_signal", "inefficient", "noisy"])
def test_faults_put_into_a_real_motors_sensor_are_found(
    reference_data: Path, tmp_path: Path, number: int, mode: str
) -> None:
    frame = healthy_run(reference_data, number)
    t = (frame["Rel Time"] - frame["Rel Time"].iloc[0]).to_numpy() / 1e3
    v = frame["Actual Speed"].to_numpy().copy()
    inside = (t >= 8) & (t < 16)
    rng = np.random.default_rng(number)
    sat = rng.normal(300, 100, int(inside.sum()))
    # L4: v = (1 − ε) v_a + ε sat
    put = {
        "none": v[inside],
        "stuck": np.full(sat.size, v[np.flatnonzero(inside)[0]]),
        "no_signal": np.zeros(sat.size),
        "inefficient": 0.7 * v[inside],
        "noisy": 0.7 * v[inside] + 0.3 * sat,
    }[mode]
    v[inside] = put
    frame["Actual Speed"] = v
    log = tmp_path / "run.csv.gz"
    frame.to_csv(log, index=False)
    result = diagnose([log], machine(ROSA, tmp_path))
    assert serious(result) == ([] if mode == "none" else [("M", mode)])
    if mode != "none":
        fault = result.report["intervals"][0]
        assert fault["side"] == "sensor"
        assert abs(fault["start_s"] - 8) < 0.5
        assert abs(fault["stop_s"] - 16) < 0.5


FINE = """[limits]
min_epsilon = 0.02
min_sat = 2.0
driving_speed = 20.0
"""
FITTED = (93, 136, 100, 112, 130, 87, 99)


def rosa_signals(reference_data: Path, folder: str, number: int, rig: Machine) -> Signals:
    return read_signals([reference_data / "fault_data/rosa" / folder / f"merged_data{number}.csv.gz"], rig)[1]


def rosa_drive(signals: Signals, rig: Machine, model: DriveModel | None = None) -> DriveData:
    timeline = align(signals)
    data = drive_data(timeline, timeline.signals["wheel.M.v_ref"], rig, "M")
    assert data is not None
    return replace(data, model=model)


@pytest.fixture(scope="module")
def rig(reference_data: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Machine, DriveModel]:
    """The motor, and its model from a few healthy runs."""
    found = machine(ROSA + FINE, tmp_path_factory.mktemp("rig"))
    runs = [align(rosa_signals(reference_data, "healthy_mode", n, found)) for n in FITTED]
    drives = fit_drives([(t, replay_loop(t, found)) for t in runs], found)
    return found, drives["M"]


def test_the_motors_controller_is_read_off_its_effort(rig: tuple[Machine, DriveModel]) -> None:
    _, model = rig
    assert model.echo is not None
    assert model.effort is not None
    assert min(model.echo.gains) == pytest.approx(-20.0, rel=0.02)
    assert model.echo.memory_s == pytest.approx(1.18, rel=0.1)


@pytest.mark.turns("number")
@pytest.mark.parametrize(("number", "known"), [(106, True), (118, True), (106, False)])
@pytest.mark.parametrize(
    ("mode", "epsilon", "sat", "std"),
    [
        (FaultMode.STUCK, 1.0, float("nan"), 0.0),
        (FaultMode.NO_SIGNAL, 1.0, 0.0, 0.0),
        (FaultMode.INEFFICIENT, 0.3, 0.0, 0.0),
        (FaultMode.INEFFICIENT, 0.05, 0.0, 0.0),
        (FaultMode.NOISY, 0.3, 200.0, 100.0),
        (FaultMode.NOISY, 0.05, 200.0, 100.0),
    ],
)
def test_small_faults_written_into_a_healthy_run_are_found(
    reference_data: Path,
    rig: tuple[Machine, DriveModel],
    number: int,
    mode: FaultMode,
    epsilon: float,
    sat: float,
    std: float,
    known: bool,
) -> None:
    found, model = rig
    fault = FaultSpec("M", Side.SENSOR, mode, 6.0, 12.0, epsilon, sat, std)
    signals = inject_signals(rosa_signals(reference_data, "healthy_mode", number, found), [fault], found, number)[0]
    data = rosa_drive(signals, found, model if known else None)
    sensor, _ = assess_drive(data, found.limits)
    (finding,) = sensor.findings
    assert (finding.side, finding.mode) == (Side.SENSOR, mode)
    assert abs(finding.start * data.dt - 6.0) < 0.3
    assert abs(finding.stop * data.dt - 12.0) < 0.3
    assert finding.detected is not None
    assert finding.detected * data.dt < 6.6


@pytest.mark.parametrize("number", [46, 69, 75, 81, 106])
def test_a_healthy_motor_raises_nothing(reference_data: Path, rig: tuple[Machine, DriveModel], number: int) -> None:
    found, model = rig
    sensor, actuator = assess_drive(
        rosa_drive(rosa_signals(reference_data, "healthy_mode", number, found), found, model), found.limits
    )
    assert sensor.findings == actuator.findings == ()


@pytest.mark.parametrize(
    ("folder", "number", "start"),
    [("manual_d_mode", 449, 3.4), ("manual_n_mode", 212, 1.9), ("mc-generated_v_mode", 325, 2.0)],
)
def test_the_motors_own_loads_are_extra_effort_and_no_fault_of_its_sensor_alone(
    reference_data: Path, rig: tuple[Machine, DriveModel], folder: str, number: int, start: float
) -> None:
    found, model = rig
    data = rosa_drive(rosa_signals(reference_data, folder, number, found), found, model)
    sensor, actuator = assess_drive(data, found.limits)
    assert all(f.side is not Side.SENSOR for f in sensor.findings)
    assert abs(actuator.findings[0].start * data.dt - start) < 1.5


@pytest.mark.parametrize("motor", [1, 2, 3, 4])
def test_a_steady_state_error_of_the_arm_is_no_standstill(reference_data: Path, tmp_path: Path, motor: int) -> None:
    log = reference_data / "fault_data/dtr_robot_arm" / f"Motor_{motor}_Steady_state_error_01.csv"
    assert serious(diagnose([log], machine(ARM, tmp_path))) == []


@pytest.mark.parametrize("mode", [None, FaultMode.INEFFICIENT, FaultMode.NOISY])
def test_the_whole_diagnosis_with_a_fitted_machine_file(
    reference_data: Path, rig: tuple[Machine, DriveModel], tmp_path: Path, mode: FaultMode | None
) -> None:
    found, model = rig
    path = tmp_path / "fitted.toml"
    path.write_text(dump_machine(replace(found, drives={"M": model})), encoding="utf-8")
    fitted = load_machine(path)
    signals = rosa_signals(reference_data, "healthy_mode", 106, fitted)
    if mode is not None:
        sat = (200.0, 100.0) if mode is FaultMode.NOISY else (0.0, 0.0)
        signals = inject_signals(signals, [FaultSpec("M", Side.SENSOR, mode, 8.0, 16.0, 0.05, *sat)], fitted, 1)[0]
    result = diagnose_signals(signals, fitted)
    assert serious(result) == ([] if mode is None else [("M", mode.value)])
    verdict = result.report["verdict"]
    if mode is None:
        # a load of a quarter of the effort could have lasted all through this run
        assert verdict["status"] == "not_assessed"
        assert "a load that lasts all through the mission would show from" in " ".join(verdict["caveats"])
        lenient = replace(fitted, limits=replace(fitted.limits, clear_at=0.4))
        verdict = diagnose_signals(signals, lenient).report["verdict"]
        assert verdict["status"] == "ready"
        assert "A load on the M drive motor, o" in verdict["text"]
        assert [c[:30] for c in verdict["caveats"]] == ["The machine file's limits clea"]
    else:
        fault = result.report["intervals"][0]
        assert (fault["side"], fault["tier"]) == ("sensor", "drive")


def test_a_healthy_motor_without_a_fitted_machine_file_is_not_called_ready(
    reference_data: Path, rig: tuple[Machine, DriveModel]
) -> None:
    found, _ = rig
    verdict = diagnose_signals(rosa_signals(reference_data, "healthy_mode", 106, found), found).report["verdict"]
    assert verdict["status"] == "not_assessed"
    assert "no effort of healthy missions to compare with" in verdict["caveats"][0]
