"""Drafts of machines from logs of robots, and what they ask."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.machine.toml_file import load_machine
from replay.setup.all_channels import channel_rows
from replay.setup.draft import draft_machine, preset_draft
from replay.setup.draft_notes import Draft
from replay.setup.machine_text import machine_text
from replay.setup.preset import Preset
from replay.setup.read import read_everything
from replay.signals.mapping import map_signals
from tests.ros_robots import RADIUS, TRACK, WHEELS, Robot, urdf, write_robot

RIGHT = tuple(n for n in WHEELS if "right" in n)


def drafted(tmp_path: Path, robot: Robot, preset: Preset | None = None) -> Draft:
    write_robot(tmp_path / "run.mcap", robot, 30.0)
    return read_back(draft_machine(read_everything([tmp_path / "run.mcap"], every=False), preset), tmp_path)


def read_back(draft: Draft, tmp_path: Path) -> Draft:
    """The draft, whose file gives the same machine and leaves nothing to the paper's."""
    file = tmp_path / "machine.toml"
    file.write_text(machine_text(draft, "run"), encoding="utf-8")
    loaded = load_machine(file)
    assert loaded.signals == draft.machine.signals
    assert loaded.geometry == draft.machine.geometry
    assert (loaded.wheels, loaded.max_speed, loaded.limits) == (
        draft.machine.wheels,
        draft.machine.max_speed,
        draft.machine.limits,
    )
    assert not loaded.assumed
    return draft


def test_a_description_gives_lengths_and_the_log_which_wheels_are_mirrored(tmp_path: Path) -> None:
    draft = drafted(tmp_path, Robot(mirrored=RIGHT, description=urdf(mirrored=RIGHT)))
    machine = draft.machine
    assert (machine.name, machine.wheels, machine.control.law) == ("lorry", ("FR", "FL", "RR", "RL"), "none")
    assert machine.wheel_radius == RADIUS
    assert machine.geometry is not None
    assert machine.geometry.wheels["FL"].y == TRACK / 2
    assert {n for n, s in machine.signals.items() if s.gain == -1.0} == {"wheel.FR.v", "wheel.RR.v"}
    assert any("Mirrored" in text and "FR, RR" in text for text in draft.found)
    assert len(draft.questions) == 1  # the top speed


def test_without_a_description_lengths_follow_from_the_commands_and_are_asked(tmp_path: Path) -> None:
    draft = drafted(tmp_path, Robot(mirrored=RIGHT))
    machine = draft.machine
    assert machine.wheel_radius == pytest.approx(RADIUS, rel=0.03)
    assert machine.geometry is not None
    assert 2 * machine.geometry.wheels["FL"].y == pytest.approx(TRACK, rel=0.05)
    assert any("is the wheel radius" in q for q in draft.questions)
    assert any("is the track" in q for q in draft.questions)
    assert {n for n, s in machine.signals.items() if s.gain == -1.0} == {"wheel.FR.v", "wheel.RR.v"}


def test_without_commands_the_yaw_rate_tells_what_is_mirrored(tmp_path: Path) -> None:
    draft = drafted(tmp_path, Robot(mirrored=RIGHT, commands=False))
    assert {n for n, s in draft.machine.signals.items() if s.gain == -1.0} == {"wheel.FR.v", "wheel.RR.v"}
    assert any("where are the commands?" in q for q in draft.questions)


@pytest.mark.parametrize(
    ("names", "wheels"),
    [
        (("left_wheel_joint", "right_wheel_joint"), ("R", "L")),
        (("wheel_l", "wheel_r"), ("R", "L")),
        (("rad_vl", "rad_vr", "rad_hl", "rad_hr"), ("VR", "VL", "HR", "HL")),
        (("lf_wheel", "rf_wheel", "lr_wheel", "rr_wheel"), ("FR", "FL", "RR", "RL")),
        (("wheel_1", "wheel_2", "wheel_3"), ("W1", "W2", "W3")),
        (("A1L_wheel", "A1R_wheel", "A2L_wheel", "A2R_wheel"), ("A1R", "A1L", "A2R", "A2L")),
    ],
)
def test_names_as_people_write_them(tmp_path: Path, names: tuple[str, ...], wheels: tuple[str, ...]) -> None:
    places = {n: (0.0, TRACK / 2 if i % 2 == 0 else -TRACK / 2) for i, n in enumerate(names)}
    write_robot(tmp_path / "run.mcap", Robot(wheels=places, imu=False), 10.0)
    draft = draft_machine(read_everything([tmp_path / "run.mcap"], every=False))
    assert draft.machine.wheels == wheels
    assert {f"wheel.{w}.v" for w in wheels} <= set(draft.machine.signals)


@pytest.mark.parametrize(
    ("form", "wheels"),
    [
        ("A{n}{S}_speed", ("A1R", "A1L", "A2R", "A2L", "A3R", "A3L")),
        ("axle{n}_{side}_wheel_speed", ("A1R", "A1L", "A2R", "A2L", "A3R", "A3L")),
        ("speed_{S}{n}", ("R1", "L1", "R2", "L2", "R3", "L3")),
        ("{side}_{n}_speed", ("R1", "L1", "R2", "L2", "R3", "L3")),
        ("v_A{n}{S}", ("A1R", "A1L", "A2R", "A2L", "A3R", "A3L")),
    ],
)
def test_wheels_by_the_number_of_their_axle_and_a_side(tmp_path: Path, form: str, wheels: tuple[str, ...]) -> None:
    v = np.repeat(np.random.default_rng(1).uniform(0.2, 2.0, 10), 20)
    names = [form.format(n=n, S=side[0].upper(), side=side) for n in (1, 2, 3) for side in ("left", "right")]
    columns = {"time": np.arange(200) * 0.05, "cmd_vel_x": v} | dict.fromkeys(names, v)
    pd.DataFrame(columns | {"A1_steer_angle_deg": v, "A3_steer_angle_deg": -v}).to_csv(
        tmp_path / "run.csv", index=False
    )
    draft = draft_machine(read_everything([tmp_path / "run.csv"]))
    machine = draft.machine
    assert machine.wheels == wheels
    assert {f"wheel.{w}.v": machine.signals[f"wheel.{w}.v"].label for w in wheels} == {
        f"wheel.{w}.v": form.format(n=w.strip("ALR"), S="L" if "L" in w else "R", side="left" if "L" in w else "right")
        for w in wheels
    }
    assert machine.geometry is not None
    places = [machine.geometry.wheels[w] for w in wheels]
    assert [p.axle for p in places] == ["front", "front", "fixed", "fixed", "rear", "rear"]
    assert [p.x for p in places] == sorted((p.x for p in places), reverse=True)
    assert all((p.y > 0) == ("L" in w) for w, p in zip(wheels, places, strict=True))
    assert machine.signals["steer.front.phi"].label == "A1_steer_angle_deg"
    assert machine.signals["steer.rear.phi"].label == "A3_steer_angle_deg"
    assert any(f"is the axle of {wheels[0]} in front" in q for q in draft.questions)


def test_tables_of_one_topic_each_with_seconds_and_nanoseconds(tmp_path: Path) -> None:
    t = 1_651_608_966_000_000_000 + np.arange(600) * 50_000_000
    v = np.repeat(np.random.default_rng(1).uniform(0.2, 2.0, 15), 40)
    clock = {"header.stamp.secs": t // 10**9, "header.stamp.nsecs": t % 10**9}
    pd.DataFrame(clock | {"linear.x": v, "angular.z": 0.0}).to_csv(tmp_path / "cmd_vel.csv", index=False)
    rpm = -8000 * v + np.random.default_rng(2).normal(0.0, 20.0, 600)
    pd.DataFrame(clock | {"RPM": rpm}).to_csv(tmp_path / "core.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "cmd_vel.csv", tmp_path / "core.csv"]))
    read_back(draft, tmp_path)
    assert draft.machine.wheels == ("D",)
    assert draft.machine.signals["wheel.D.v"].gain == pytest.approx(-1 / 8000, rel=0.02)
    assert draft.machine.signals["wheel.D.v_ref"].source == "cmd_vel.csv"
    assert any("what is the scale of RPM" in q for q in draft.questions)


def test_speeds_without_a_unit_get_the_one_that_fits_the_commands(tmp_path: Path) -> None:
    t = np.arange(600) * 0.05
    v = np.repeat(np.random.default_rng(1).uniform(0.2, 2.0, 15), 40)
    columns = {"time": t, "cmd_vel_x": v, "meas_left_vel": v / 0.3, "meas_right_vel": v / 0.3}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    assert draft.machine.wheels == ("R", "L")
    assert draft.machine.signals["wheel.L.v"].unit == "rad/s"
    assert draft.machine.wheel_radius == pytest.approx(0.3, rel=0.02)
    assert any("in rad/s? None is stated" in q for q in draft.questions)


@pytest.mark.parametrize(
    ("places", "asked", "measured", "unit", "wheels"),
    [
        (("VR", "VL", "HR", "HL"), "n_soll_{}", "n_ist_{}", " [1/min]", ("VR", "VL", "HR", "HL")),
        (("AVD", "AVG", "ARD", "ARG"), "consigne_{}", "vitesse_mesure_{}", " (tr/min)", ("AVD", "AVG", "ARD", "ARG")),
    ],
)
def test_columns_of_motors_in_german_and_french(
    tmp_path: Path, places: tuple[str, ...], asked: str, measured: str, unit: str, wheels: tuple[str, ...]
) -> None:
    v = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 15), 40)
    gear, radius = 24.0, 0.64
    rpm = v / radius * gear * 60 / (2 * np.pi)
    columns: dict[str, Any] = {"Zeit [s]": np.arange(600) * 0.05, "v_soll [km/h]": 3.6 * v}
    for name in places:
        columns |= {asked.format(name) + unit: rpm, measured.format(name) + unit: rpm}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False, sep=";", decimal=",", encoding="cp1252")
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    assert draft.machine.wheels == wheels
    assert any("were the motors measured?" in q for q in draft.questions)
    for wheel in wheels:
        speed = draft.machine.signals[f"wheel.{wheel}.v"]
        assert speed.at == "motor"
        assert measured.format(wheel) in speed.label
        assert asked.format(wheel) in draft.machine.signals[f"wheel.{wheel}.v_ref"].label
    assert draft.machine.geometry is not None
    answered = replace(
        draft.machine, gear_ratio=gear, geometry=replace(draft.machine.geometry, wheel_diameter=2 * radius)
    )
    logs = read_everything([tmp_path / "run.csv"])
    found = map_signals(logs, answered).items[f"wheel.{wheels[0]}.v"]
    np.testing.assert_allclose(found.values, v, atol=1e-9)


def test_what_cannot_be_si_gets_its_usual_unit_with_one_question_for_each_kind(tmp_path: Path) -> None:
    v = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 15), 40)
    columns: dict[str, Any] = {"Zeit": np.arange(600) * 0.05, "Sollgeschwindigkeit": v}
    for i in range(1, 5):
        columns |= {f"Rad{i}_Drehzahl_soll": 320 * v, f"Rad{i}_Drehzahl_ist": 320 * v, f"Rad{i}_Ventil": 80 * v}
    columns |= {"Lenkwinkel_vorne_soll": 50 * v, "Lenkwinkel_vorne_ist": 50 * v}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    signals = draft.machine.signals
    assert {signals[f"wheel.{w}.u"].unit for w in draft.machine.wheels} == {"%"}
    assert signals["steer.front.phi"].unit == signals["steer.front.phi_ref"].unit == "deg"
    assert signals["wheel.FR.v_ref"].gain == signals["wheel.FR.v"].gain == pytest.approx(1 / 320, rel=0.01)
    assert draft.machine.max_speed < 1.0
    assert sum("None is stated; in" in q for q in draft.questions) == 2
    assert not any("cannot be" in q for q in draft.signals.questions)


def test_rotations_tell_no_size_of_each_other(tmp_path: Path) -> None:
    v = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 15), 40)
    columns: dict[str, Any] = {"Zeit [s]": np.arange(600) * 0.05}
    for name in ("vorne rechts", "vorne links", "hinten rechts", "hinten links"):
        columns |= {f"Raddrehzahl {name} Sollwert [U/min]": 20 * v, f"Raddrehzahl {name} Istwert [U/min]": 19 * v}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    assert draft.machine.wheels == ("VR", "VL", "HR", "HL")
    assert any("how large are the wheels?" in q for q in draft.questions)
    assert not any("is the wheel radius" in q or "which number" in q for q in draft.questions)


def write_numbered(tmp_path: Path, order: tuple[float, ...], commands: bool = True) -> None:
    """A robot whose wheels have only numbers: side of each in their order [m to the left]."""
    rng = np.random.default_rng(3)
    v, omega = np.repeat(rng.uniform(-0.5, 0.9, 30), 40), np.repeat(rng.uniform(-0.8, 0.8, 30), 40)
    columns: dict[str, Any] = {"time": np.arange(1200) * 0.05}
    if commands:
        columns |= {"cmd_speed [m/s]": v, "cmd_yaw_rate [rad/s]": omega}
    for i, y in enumerate(order):
        columns[f"wheel{i}_speed [rad/s]"] = (v - y * omega) / 0.15 + 0.02 * rng.standard_normal(1200)
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)


@pytest.mark.parametrize(
    ("order", "wheels"),
    [
        ((-0.4, 0.4, -0.4, 0.4), ("FR", "FL", "RR", "RL")),
        ((0.4, -0.4, 0.4, -0.4), ("FL", "FR", "RL", "RR")),
        ((0.4, 0.4, -0.4, -0.4), ("FL", "RL", "FR", "RR")),
        ((0.4, -0.4), ("L", "R")),
    ],
)
def test_turns_tell_the_sides_of_wheels_that_have_only_numbers(
    tmp_path: Path, order: tuple[float, ...], wheels: tuple[str, ...]
) -> None:
    write_numbered(tmp_path, order)
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    assert draft.machine.wheels == wheels
    assert [draft.machine.signals[f"wheel.{w}.v"].column for w in wheels] == [
        f"wheel{i}_speed [rad/s]" for i in range(len(order))
    ]
    assert draft.machine.geometry is not None
    track = max(p.y for p in draft.machine.geometry.wheels.values()) * 2
    assert track == pytest.approx(0.8, rel=0.05)
    assert sum("which wheel has which number" in q for q in draft.questions) == 1


def test_commands_of_wheels_tell_their_sides_where_a_wheel_fails(tmp_path: Path) -> None:
    write_numbered(tmp_path, (0.4, -0.4, 0.4, -0.4))
    table = pd.read_csv(tmp_path / "run.csv")
    for i in range(4):
        table[f"wheel{i}_speed_ref [rad/s]"] = table[f"wheel{i}_speed [rad/s]"]
    table.loc[600:, "wheel2_speed [rad/s]"] = 0.0
    table.to_csv(tmp_path / "run.csv", index=False)
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    assert draft.machine.wheels == ("FL", "FR", "RL", "RR")
    assert draft.machine.geometry is not None
    assert draft.machine.geometry.wheels["FL"].y == pytest.approx(0.4, rel=0.02)


def test_without_turns_the_numbers_are_asked(tmp_path: Path) -> None:
    write_numbered(tmp_path, (0.4, -0.4, 0.4, -0.4), commands=False)
    draft = draft_machine(read_everything([tmp_path / "run.csv"]))
    assert draft.machine.wheels == ("FR", "FL", "RR", "RL")
    assert any("wheel0_speed [rad/s] as FR" in q and "no name says it" in q for q in draft.questions)


def test_currents_of_valves_stand_for_openings_once_somebody_says_their_scale(tmp_path: Path) -> None:
    v = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 15), 40)
    columns: dict[str, Any] = {"time": np.arange(600) * 0.05}
    for name in ("FR", "FL", "RR", "RL"):
        columns |= {
            f"drive {name} speed setpoint [m/s]": v,
            f"drive {name} speed [m/s]": v,
            f"drive {name} valve current [mA]": 800 * v,
        }
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    source = draft.machine.signals["wheel.FL.u"]
    assert (source.column, source.unit) == ("drive FL valve current [mA]", "1")
    assert source.gain == pytest.approx(1 / (800 * np.abs(v).max()), rel=0.05)
    assert sum("which current opens a valve fully?" in q and " mA " in q for q in draft.questions) == 1
    assert not any(name.endswith("effort") for name in draft.machine.signals)


def test_a_preset_whose_wheels_are_not_found_asks_for_their_speeds(tmp_path: Path) -> None:
    pd.DataFrame({"time": np.arange(50.0), "temperature": 20.0}).to_csv(tmp_path / "run.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "run.csv"]), Preset.SKID_4)
    assert any("where are the speeds of the wheels?" in q and '"wheel.FR.v"' in q for q in draft.questions)


def test_small_wheels_of_joints_called_wheels_are_no_motors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.ros_robots.RADIUS", 0.033)
    draft = drafted(tmp_path, Robot())
    assert draft.machine.wheel_radius == pytest.approx(0.033, rel=0.03)
    assert {s.at for s in draft.machine.signals.values()} == {"wheel"}


def test_a_log_without_a_drive_says_what_to_record(tmp_path: Path) -> None:
    pd.DataFrame({"time": np.arange(50.0), "temperature": 20.0}).to_csv(tmp_path / "run.csv", index=False)
    with pytest.raises(LogError, match=r"no wheel speed is in the log: none of its columns \(temperature\)"):
        draft_machine(read_everything([tmp_path / "run.csv"]))
    places = {f"drivewheel_{n}": (0.0, y) for n, y in (("port", TRACK / 2), ("starboard", -TRACK / 2))}
    write_robot(tmp_path / "run.mcap", Robot(wheels=places), 5.0)
    with pytest.raises(LogError, match=r"none of its joints \(drivewheel_port, drivewheel_starboard\)"):
        draft_machine(read_everything([tmp_path / "run.mcap"], every=False))


@pytest.mark.parametrize("preset", Preset)
def test_presets_are_machines_that_load(tmp_path: Path, preset: Preset) -> None:
    read_back(preset_draft(preset), tmp_path)


def test_every_channel_is_listed_with_unit_range_and_signals(tmp_path: Path) -> None:
    write_robot(tmp_path / "run.mcap", Robot(), 5.0)
    logs = read_everything([tmp_path / "run.mcap"])
    rows = {r.name: r for r in channel_rows(logs, draft_machine(logs).machine)}
    speed = rows["/joint_states.velocity[front_left_wheel_joint]"]
    assert (speed.unit, speed.guessed, speed.could_be) == ("rad/s", False, ("wheel.FL.v",))
    assert speed.rate_hz == pytest.approx(20.0)
    assert speed.low is not None
    assert speed.high is not None
    assert speed.low < speed.high
    assert rows["/cmd_vel.linear.x"].could_be == ("cmd.v",)
    assert (rows["/imu.linear_acceleration.z"].unit, rows["/imu.linear_acceleration.z"].could_be) == ("m/s^2", ())


def test_the_wheel_of_a_tricycle_is_found(tmp_path: Path) -> None:
    draft = drafted(tmp_path, Robot(wheels={"front_wheel_joint": (0.5, 0.0)}))
    assert draft.machine.wheels == ("D",)
    assert draft.machine.signals["wheel.D.v"].field == "velocity[front_wheel_joint]"


def test_joints_of_a_description_are_found_by_their_positions(tmp_path: Path) -> None:
    places = {"rear_left_wheel_joint": (0.0, TRACK / 2), "rear_right_wheel_joint": (0.0, -TRACK / 2)}
    draft = drafted(tmp_path, Robot(wheels=places, description=urdf(places), positions=True))
    assert draft.machine.signals["wheel.L.v_position"].derivative


@pytest.mark.parametrize(
    ("asked", "measured"),
    [
        (("V", 10.0, 0.0, 0.1, 0.0), ("mA", 8.0, 12.0, 0.125, -1.5)),
        (("mA", 8.0, 12.0, 0.125, -1.5), ("V", 10.0, 0.0, 0.1, 0.0)),
    ],
)
def test_a_command_in_volts_and_its_position_in_a_current_loop_are_both_mapped(
    tmp_path: Path, asked: tuple[str, float, float, float, float], measured: tuple[str, float, float, float, float]
) -> None:
    u = 0.9 * np.sin(np.arange(600) * 0.05)
    columns: dict[str, Any] = {"Zeit [s]": np.arange(600) * 0.05, "v_soll [m/s]": u}
    for name in ("VR", "VL", "HR", "HL"):
        columns |= {f"{name}.n_ist [1/min]": 100 * u}
        for word, (unit, scale, rest, *_) in (("Soll", asked), ("Ist", measured)):
            columns[f"fbRad_{name}.fVentil_{word} [{unit}]"] = rest + scale * u
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    for leaf, (*_, gain, offset) in (("u", asked), ("u_applied", measured)):
        source = draft.machine.signals[f"wheel.VL.{leaf}"]
        assert (source.unit, source.gain, source.offset) == ("1", gain, offset)
    questions = " ".join(draft.questions)
    assert "12 mA close a valve and 20 mA open it fully" in questions
    assert "do 10 V" in questions


def test_currents_of_valves_in_percent_keep_their_unit(tmp_path: Path) -> None:
    v = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 15), 40)
    columns: dict[str, Any] = {"time": np.arange(600) * 0.05}
    for name in ("VR", "VL", "HR", "HL"):
        columns |= {f"fbRad_{name}.nSoll [U/min]": 90 * v, f"fbRad_{name}.nIst [U/min]": 90 * v}
        columns[f"fbRad_{name}.fVentilStrom [%]"] = 160 * v
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    assert (draft.machine.signals["wheel.VL.u"].unit, draft.machine.signals["wheel.VL.u"].gain) == ("%", 1.0)
    assert not any("which current opens" in q for q in draft.questions)
    assert sum("100 %" in q for q in draft.questions) == 1


@pytest.mark.parametrize(
    ("late", "rows", "clock"),
    [(0, 600, "as recorded"), (42, 600, "estimate"), (0, 400, "estimate"), (-10, 400, "estimate")],
    ids=["together", "apart", "begin together", "end together"],
)
def test_tables_that_begin_or_end_apart_are_not_taken_to_share_a_clock(
    tmp_path: Path, late: float, rows: int, clock: str
) -> None:
    v = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 15), 40)
    t = pd.Timestamp("2026-10-14T06:00:00Z") + pd.to_timedelta(np.arange(600) * 0.05, "s")
    wheels = {f"{w} {what}": v for w in ("FR", "FL") for what in ("speed setpoint [m/s]", "speed [m/s]")}
    pd.DataFrame({"time": t, **wheels}).to_csv(tmp_path / "a.csv", index=False)
    later = t - pd.Timedelta(seconds=late)
    table = pd.DataFrame({"time": later, "yaw_rate [rad/s]": 0.1 * v})
    table.iloc[:rows].to_csv(tmp_path / "b.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "a.csv", tmp_path / "b.csv"]))
    assert [o.clock for o in draft.machine.sources.values() or [SourceOptions()]] == [clock]
    assert any("stamped by one computer" in q for q in draft.questions)


@pytest.mark.parametrize(("rows", "clock"), [(600, ["as recorded"]), (560, [])], ids=["alike", "shorter"])
def test_tables_that_count_from_their_own_start_share_a_clock_where_they_end_together(
    tmp_path: Path, rows: int, clock: list[str]
) -> None:
    v = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 15), 40)
    t = np.arange(600) * 0.05
    wheels = {f"{w} {what}": v for w in ("FR", "FL") for what in ("speed setpoint [m/s]", "speed [m/s]")}
    pd.DataFrame({"time [s]": t, **wheels}).to_csv(tmp_path / "a.csv", index=False)
    pd.DataFrame({"time [s]": t, "Temperatur": v, "steer_angle_front [rad]": 0.1}).iloc[:rows].to_csv(
        tmp_path / "b.csv", index=False
    )
    draft = draft_machine(read_everything([tmp_path / "a.csv", tmp_path / "b.csv"]))
    assert [o.clock for o in draft.machine.sources.values()] == clock
    assert any("stamped by one computer" in q for q in draft.questions)


@pytest.mark.parametrize(("late", "shared"), [(0, True), (3, False)])
def test_tables_that_only_begin_together_share_a_clock_where_their_signals_fit(
    tmp_path: Path, late: float, shared: bool
) -> None:
    """A delay is no length: of a table whose clock is not known nothing is measured, and the file says so."""
    rng = np.random.default_rng(3)
    v, w = (np.convolve(np.repeat(rng.uniform(-1, 1, 40), 75), np.ones(25) / 25, "same") for _ in range(2))
    t = pd.Timestamp("2026-10-14T06:00:00Z") + pd.to_timedelta(np.arange(3000) * 0.04, "s")
    sides = {"FL": v - 0.4 * w, "FR": v + 0.4 * w, "RL": v - 0.4 * w, "RR": v + 0.4 * w}
    wheels = {f"{n} {what}": x for n, x in sides.items() for what in ("speed setpoint [m/s]", "speed [m/s]")}
    pd.DataFrame({"time": t, **wheels}).to_csv(tmp_path / "a.csv", index=False)
    table = pd.DataFrame({"time": t + pd.Timedelta(seconds=late), "yaw_rate [rad/s]": w})
    table.iloc[:2000].to_csv(tmp_path / "b.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "a.csv", tmp_path / "b.csv"]))
    assert ("as recorded" in [o.clock for o in draft.machine.sources.values()]) == shared
    (asked,) = [q for q in draft.questions if "stamped by one computer" in q]
    assert ("their signals fit" if shared else "imu.yaw_rate in b.csv is about 3.0 s later") in asked
    assert any("By the yaw rate" in q for q in draft.questions) == shared
    assert "# QUESTION: were all tables stamped" in machine_text(draft, "a.csv, b.csv", [])
    assert "imu.yaw_rate" in draft.machine.signals


def test_directions_and_lengths_are_of_signals_at_one_time(tmp_path: Path) -> None:
    """The second file's clock is 42 s behind: what is found is found on one clock."""
    rng = np.random.default_rng(3)
    v, w = (np.convolve(np.repeat(rng.uniform(-1, 1, 40), 75), np.ones(25) / 25, "same") for _ in range(2))
    t = pd.Timestamp("2026-10-14T06:00:00Z") + pd.to_timedelta(np.arange(3000) * 0.04, "s")
    sides = {"FL": v - 0.4 * w, "FR": v + 0.4 * w, "RL": v - 0.4 * w, "RR": v + 0.4 * w}
    wheels = {f"{n} {what}": x for n, x in sides.items() for what in ("speed setpoint [m/s]", "speed [m/s]")}
    pd.DataFrame({"time": t, "cmd_v [m/s]": v, **wheels}).to_csv(tmp_path / "a.csv", index=False)
    late = {"speed_cmd_mps": v, "cmd_yaw_rate [rad/s]": w, "yaw_rate [rad/s]": w}
    pd.DataFrame({"time": t - pd.Timedelta(seconds=42), **late}).to_csv(tmp_path / "b.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "a.csv", tmp_path / "b.csv"]))
    assert not any("exchanged" in q for q in draft.questions)
    assert draft.machine.geometry is not None
    assert draft.machine.geometry.wheels["FL"].y == pytest.approx(0.4, rel=0.05)


def test_a_reference_is_a_command_and_another_velocity_is_asked_for(tmp_path: Path) -> None:
    draft = drafted(tmp_path, Robot(command_topic="/rover/drive_controller/reference"))
    assert draft.machine.signals["cmd.v"].topic == "/rover/drive_controller/reference"
    draft = drafted(tmp_path, Robot(command_topic="/rover/nav_vel"))
    assert "cmd.v" not in draft.machine.signals
    (question,) = [q for q in draft.questions if "where are the commands?" in q]
    assert '"cmd.v" = { topic = "/rover/nav_vel", field = "' in question
    assert "None is in the log" not in question
    draft = drafted(tmp_path, Robot(command_topic="/rover/gps/velocity"))
    (question,) = [q for q in draft.questions if "where are the commands?" in q]
    assert "None is in the log" in question


def test_columns_that_ask_for_something_unsaid_are_pointed_at_rather_than_denied(tmp_path: Path) -> None:
    t = np.arange(0.0, 30.0, 0.05)
    asked = 0.3 * np.sign(np.sin(t))
    columns = {"time": t, "LEFT SETPOINT": asked, "RIGHT SETPOINT": asked, "LEFT VEL": asked, "RIGHT VEL": 0.9 * asked}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "run.csv"], every=False))
    (question,) = [q for q in draft.questions if "where are the commands?" in q]
    assert "LEFT SETPOINT" in question
    assert "RIGHT SETPOINT" in question
    assert '.v_ref" = { column =' in question
    assert "None is in the log" not in question


@pytest.mark.parametrize(("name", "axle"), [("steering_angle_rad", "front"), ("rear_steering_angle_rad", "rear")])
def test_a_steering_angle_beside_the_only_tachometer_gets_an_axle(tmp_path: Path, name: str, axle: str) -> None:
    t = np.arange(1200) * 0.05
    speed = 1.0 + np.sin(t / 5)
    columns = {"time": t, "speed_cmd_mps": speed, "wheel_speed_mps": speed, name: 0.3 * np.sin(t / 7)}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "run.csv"], every=False))
    assert draft.machine.wheels == ("D",)
    assert draft.machine.axles == (axle,)
    assert draft.machine.signals[f"steer.{axle}.phi"].column == name
    assert draft.machine.max_steer == pytest.approx(0.36, abs=0.01)
    assert any(f"the unsteered wheels is the {axle} axle, which is steered?" in q for q in draft.questions)
    assert not any("left and right" in q for q in draft.questions)


@pytest.mark.parametrize("lead", ["", "field."])
def test_odometry_that_was_exported_as_a_table_is_the_drive_as_a_whole(tmp_path: Path, lead: str) -> None:
    t = 1_747_151_383_574_611_814 + np.arange(600) * 50_000_000
    v = np.repeat(np.random.default_rng(1).uniform(0.2, 2.0, 15), 40)
    columns = {"twist.twist.linear.x": v, "pose.pose.position.x": np.cumsum(v) * 0.05, "pose.pose.position.y": 0.0 * v}
    table = pd.DataFrame({"%time": t} | {lead + name: x for name, x in columns.items()})
    table.to_csv(tmp_path / "odom.csv", index=False)
    draft = read_back(draft_machine(read_everything([tmp_path / "odom.csv"])), tmp_path)
    assert draft.machine.wheels == ("D",)
    assert draft.machine.signals["wheel.D.v"].column == f"{lead}twist.twist.linear.x"
    assert {"odom.x", "odom.y"} <= set(draft.machine.signals)


def test_a_machine_that_ignored_its_commands_is_as_fast_as_they_are(tmp_path: Path) -> None:
    t = np.arange(600) * 0.05
    pd.DataFrame({"time_s": t, "target_speed": 0.5, "actual_speed": 0.0 * t}).to_csv(tmp_path / "run.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "run.csv"]))
    assert draft.machine.max_speed == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("scale", "rest", "unit", "asked"),
    [
        (10.0, 0.0, "% or V", "or in volts? Write unit"),
        (5.0, 5.0, "% or V", "or in volts? Write unit"),
        (1.4, 0.0, "% or V", "or in volts? Write unit"),
        (8.0, 12.0, "% or mA", "or in mA? Write unit"),
        (80.0, 0.0, "%", "in %? None is stated"),
    ],
)
def test_openings_that_may_be_volts_or_a_current_are_asked_for_as_such(
    tmp_path: Path, scale: float, rest: float, unit: str, asked: str
) -> None:
    v = np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, 15), 40)
    v[0], v[-40:] = -1.0, 1.0
    columns: dict[str, Any] = {"Zeit": np.arange(600) * 0.05, "Sollgeschwindigkeit": v}
    for i in range(1, 5):
        columns |= {f"Rad{i}_v_soll": v, f"Rad{i}_v_ist": v, f"Rad{i}_Ventil": rest + scale * v}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    draft = read_back(draft_machine(read_everything([tmp_path / "run.csv"])), tmp_path)
    assert {draft.machine.signals[f"wheel.{w}.u"].unit for w in draft.machine.wheels} == {unit}
    assert any(asked in q for q in draft.questions)


def test_wheels_that_the_draft_does_not_have_are_asked_for(tmp_path: Path) -> None:
    """Two of six wheels, which are called otherwise than the four, were left out without a word."""
    t = np.arange(0.0, 20.0, 0.05)
    speed = 0.5 * np.sin(t)
    names = [f"{wheel}_speed [m/s]" for wheel in ("FL", "FR", "RL", "RR", "A2L", "A2R")]
    table = pd.DataFrame(
        {"t [s]": t, "v_soll [m/s]": speed, **{n: speed * (1 + 0.01 * k) for k, n in enumerate(names)}}
    )
    table.to_csv(tmp_path / "six.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "six.csv"], every=False))
    (asked,) = [q for q in draft.questions if q.startswith("which wheels are")]
    assert ", ".join(names[4:]) in asked
    (tmp_path / "m.toml").write_text(machine_text(draft, "six.csv"))
    assert any(q.startswith("which wheels are A2L_speed") for q in load_machine(tmp_path / "m.toml").questions)


def top_speed(tmp_path: Path, columns: dict[str, Any]) -> tuple[float, str]:
    pd.DataFrame({"time": np.arange(600) * 0.05, **columns}).to_csv(tmp_path / "run.csv", index=False)
    draft = draft_machine(read_everything([tmp_path / "run.csv"]))
    return draft.machine.max_speed, next(q for q in draft.questions if q.startswith("how fast can it go?"))


def test_the_top_speed_is_a_fifth_more_than_what_the_sentence_says(tmp_path: Path) -> None:
    """It was a fifth more than the slower of two wheels, or than half of the turns that were asked for."""
    v, turn = np.repeat([0.2, 0.3, 0.4], 200), np.repeat([0.8, -0.4, 0.8], 200)
    wheels = {"left_speed [m/s]": v - 0.2 * turn, "right_speed [m/s]": v + 0.2 * turn}
    top, said = top_speed(tmp_path, wheels)
    assert top == pytest.approx(1.2 * 0.56, rel=0.01)
    assert "0.672 m/s is a fifth more than the 0.56 m/s that its wheels reach" in said
    top, said = top_speed(tmp_path, wheels | {"cmd_v [m/s]": 2.0 * v})
    assert (top, "the 0.8 m/s" in said) == (pytest.approx(1.2 * 0.8, rel=0.01), True)


def test_a_wild_wheel_and_a_log_without_motion_are_no_measure_of_the_top_speed(tmp_path: Path) -> None:
    v = np.repeat([0.2, 0.3, 0.4], 200)
    top, said = top_speed(tmp_path, {"left_speed [m/s]": v, "right_speed [m/s]": 50.0 * v})
    assert (top, "the 0.4 m/s" in said) == (pytest.approx(0.48, rel=0.01), True)
    top, said = top_speed(tmp_path, {"left_speed [m/s]": 0.01 * v, "right_speed [m/s]": 0.01 * v})
    assert (top, "a fifth more" in said) == (0.05, False)
