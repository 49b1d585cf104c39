from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replay.errors import ConfigError
from replay.export.mission import FORMATS, write_mission
from replay.log.raw_log import Channel, LogSummary, RawLog, TopicInfo
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.config import Machine, haulotte
from replay.readers.registry import read_log, summarise_log
from replay.signals.mapping import map_signals, plan_topics
from replay.signals.name_parts import axle_of, wheel_of
from replay.signals.signal import Signals
from replay.signals.symbol_rules import _effort_unit
from replay.signals.to_si import slope
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission

STEP = 10_000_000
MACHINE = haulotte()
RADIUS = 0.427


def channel(
    name: str, values: Any, *, topic: str = "", kind: str = "", unit: str | None = None, stamps: Any = None
) -> Channel:
    data = np.asarray(values)
    at = np.arange(len(data), dtype=np.int64) * STEP if stamps is None else np.asarray(stamps, np.int64)
    field = name.removeprefix(f"{topic}.") if topic else name
    return Channel(name, topic, field, at, data, unit, kind)


def log_of(*channels: Channel, source: str = "run.mcap") -> RawLog:
    summary = LogSummary(source, "mcap", 0, 0, ())
    return RawLog(source, "mcap", "header", {c.name: c for c in channels}, summary)


def topic(name: str, kind: str, columns: Mapping[str, Any]) -> list[Channel]:
    return [channel(f"{name}.{field}", v, topic=name, kind=kind) for field, v in columns.items()]


def joints(columns: Mapping[str, Any], name: str = "/joint_states") -> list[Channel]:
    return topic(name, "sensor_msgs/msg/JointState", columns)


def mapped(*channels: Channel, machine: Machine = MACHINE) -> Signals:
    return map_signals([log_of(*channels)], machine)


@pytest.mark.parametrize(
    ("name", "wheel"),
    [
        ("front_right_wheel", "FR"),
        ("fr_wheel", "FR"),
        ("wheel_fr", "FR"),
        ("wheelFL_joint", "FL"),
        ("left_front_wheel_joint", "FL"),
        ("wheel_left_back_joint", "RL"),
        ("rear_left", "RL"),
        ("rl", "RL"),
        ("br_wheel", "RR"),
        ("wheel_b_r", "RR"),
        ("w_r_l", "RL"),
        ("MAIN.fbWheelFR.fVelocity", "FR"),
        ("MAIN.lrVelocity", None),
        ("arm_1_link_joint", None),
        ("gripper_left", None),
        ("front_steering", None),
    ],
)
def test_wheels_by_name(name: str, wheel: str | None) -> None:
    assert wheel_of(name, MACHINE) == wheel


def test_axles_by_name() -> None:
    assert axle_of("front_steering", MACHINE) == "front"
    assert axle_of("steer_back_joint", MACHINE) == "rear"
    assert axle_of("steering", MACHINE) is None


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_of_a_mission_maps_to_the_same_signals(tmp_path: Path, name: str) -> None:
    mission = simulate_mission(SimulationOptions(duration_s=2.0, rate_hz=100, silent="nan"))
    path = tmp_path / "log"
    write_mission(mission, path, name)
    summary = summarise_log(path, SourceOptions())
    log = read_log(path, SourceOptions(), plan_topics([summary], MACHINE)[summary.source])
    signals = map_signals([log], MACHINE)
    groups = [(mission.stamps, mission.columns), *((g.stamps, g.columns) for g in mission.slow)]
    for stamps, columns in groups:
        for key, values in columns.items():
            np.testing.assert_array_equal(signals.items[key].stamps, stamps, err_msg=key)
            np.testing.assert_allclose(signals.items[key].values, values, rtol=1e-12, atol=1e-12, err_msg=key)
            assert signals.items[key].guessed
    assert not set(signals.items) & set(signals.missing)
    assert {*signals.items, *signals.missing} == set(MACHINE.canonical_signals())


def test_joint_velocities_become_rim_speeds() -> None:
    found = mapped(
        *joints({"velocity[fr_wheel]": [0.1, 0.2], "velocity[arm]": [9.0, 9.0], "effort[fr_wheel]": [5.0, 5.0]})
    )
    assert set(found.items) == {"wheel.FR.v", "wheel.FR.effort"}
    np.testing.assert_allclose(found.items["wheel.FR.v"].values, [0.1 * RADIUS, 0.2 * RADIUS])
    assert "no channel fits" in found.missing["wheel.FR.u"]


@pytest.mark.parametrize("base", [0, 1])
def test_numbered_joints_follow_the_machines_order(base: int) -> None:
    found = mapped(*joints({f"velocity[wheel_{i + base}]": [0.1 * i] for i in range(4)}))
    for i, wheel in enumerate(MACHINE.wheels):
        np.testing.assert_allclose(found.items[f"wheel.{wheel}.v"].values, [0.1 * i * RADIUS])


def test_positions_stand_in_where_no_velocity_is_recorded() -> None:
    found = mapped(*joints({"position[fr_wheel]": np.arange(5) * 0.01, "velocity[fr_wheel]": np.full(5, np.nan)}))
    np.testing.assert_allclose(found.items["wheel.FR.v"].values, np.full(5, RADIUS))
    assert found.items["wheel.FR.v"].origin.derivative


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("geometry_msgs/msg/Twist", ("linear.x", "angular.z")),
        ("geometry_msgs/TwistStamped", ("twist.linear.x", "twist.angular.z")),
    ],
)
def test_twist_commands(kind: str, fields: tuple[str, str]) -> None:
    found = mapped(*topic("/cmd_vel", kind, {fields[0]: [0.3], fields[1]: [0.1]}))
    assert (found.items["cmd.v"].values[0], found.items["cmd.omega"].values[0]) == (0.3, 0.1)


def test_the_plainest_command_topic_wins_and_the_rival_is_named() -> None:
    channels = [
        *topic("/a/cmd_vel", "geometry_msgs/msg/Twist", {"linear.x": [1.0, 1.0]}),
        *topic("/b/cmd_vel", "geometry_msgs/msg/Twist", {"linear.x": [2.0]}),
    ]
    found = mapped(*channels)
    assert found.items["cmd.v"].origin.topic == "/a/cmd_vel"
    assert any("/b/cmd_vel.linear.x would fit as well" in n for n in found.notes)
    plain = topic("/cmd_vel", "geometry_msgs/msg/Twist", {"linear.x": [3.0]})
    assert mapped(*channels, *plain).items["cmd.v"].origin.topic == "/cmd_vel"


def test_ackermann_commands() -> None:
    fields = {"drive.speed": [0.2], "drive.steering_angle": [0.4]}
    found = mapped(*topic("/ack", "ackermann_msgs/msg/AckermannDriveStamped", fields))
    assert (found.items["cmd.v"].values[0], found.items["steer.front.phi_ref"].values[0]) == (0.2, 0.4)


def test_yaw_from_the_quaternion_is_continuous() -> None:
    yaw = np.linspace(-7.0, 7.0, 200)
    pose = "pose.pose.orientation"
    fields = {f"{pose}.x": 0 * yaw, f"{pose}.y": 0 * yaw, f"{pose}.z": np.sin(yaw / 2), f"{pose}.w": np.cos(yaw / 2)}
    found = mapped(*topic("/odom", "nav_msgs/msg/Odometry", {"pose.pose.position.x": yaw, **fields})).items
    np.testing.assert_allclose(np.diff(found["odom.yaw"].values), np.diff(yaw), atol=1e-9)
    np.testing.assert_array_equal(found["odom.x"].values, yaw)


def test_controller_arrays_of_one_entry_per_wheel() -> None:
    fields = {f"data[{i}]": [0.1 * i] for i in range(4)}
    found = mapped(*topic("/wheel_controller/commands", "std_msgs/msg/Float64MultiArray", fields))
    np.testing.assert_allclose(found.items["wheel.RL.v_ref"].values, [0.3 * RADIUS])
    assert any("its order taken to be" in n for n in found.notes)


def test_dynamic_joint_states_and_controller_states() -> None:
    dynamic = topic(
        "/dynamic_joint_states", "control_msgs/msg/DynamicJointState",
        {"interface_values[fl_wheel].values[velocity]": [0.5]},
    )  # fmt: skip
    state = topic(
        "/drive/state", "control_msgs/msg/JointTrajectoryControllerState",
        {"desired.velocities[fl_wheel]": [0.4], "error.velocities[fl_wheel]": [0.1]},
    )  # fmt: skip
    found = mapped(*dynamic, *state).items
    np.testing.assert_allclose(found["wheel.FL.v"].values, [0.5 * RADIUS])
    np.testing.assert_allclose(found["wheel.FL.v_ref"].values, [0.4 * RADIUS])


@pytest.mark.parametrize("base", [0, 1])
def test_plc_symbols_with_numbers_of_either_base(base: int) -> None:
    channels = []
    for i in range(4):
        channels += [
            channel(f"MAIN.fbWheel[{i + base}].fVelocity", [100.0 + i], unit="rpm"),
            channel(f"GVL_Drive.aValveCmd[{i + base}]", [10.0 * i], unit="%"),
        ]
    found = mapped(*channels).items
    rpm = 2 * np.pi / 60 * RADIUS / 17.7
    for i, wheel in enumerate(MACHINE.wheels):
        np.testing.assert_allclose(found[f"wheel.{wheel}.v"].values, [(100 + i) * rpm])
        np.testing.assert_allclose(found[f"wheel.{wheel}.u"].values, [0.1 * i])
    assert found["wheel.FR.v"].origin.at == "motor"


def test_columns_with_canonical_names_and_units() -> None:
    found = mapped(channel("wheel.FR.v [mm/s]", [100.0], unit="mm/s"), channel("STEER.front.phi", [0.2])).items
    np.testing.assert_allclose(found["wheel.FR.v"].values, [0.1])
    np.testing.assert_allclose(found["steer.front.phi"].values, [0.2])


def test_a_slow_column_loses_its_empty_cells_and_a_silent_one_keeps_them() -> None:
    slow = np.full(100, np.nan)
    slow[::10] = 0.5
    silent = np.full(100, 0.1)
    silent[20:95] = np.nan
    found = mapped(channel("imu.yaw_rate", slow), channel("wheel.FR.v", silent)).items
    assert len(found["imu.yaw_rate"].stamps) == 10
    assert len(found["wheel.FR.v"].stamps) == 100


def merged(seed: int, periods: tuple[float, ...] = (0.05, 0.04, 0.07)) -> tuple[list[np.ndarray], np.ndarray]:
    """Stamps [s] of several recorders and, in their union, which of them each row is of, shape (n,)."""
    rng = np.random.default_rng(seed)
    stamps = [np.cumsum(p * rng.uniform(0.4, 1.6, 400)) for p in periods]
    of = np.repeat(np.arange(len(stamps)), [s.size for s in stamps])
    return stamps, of[np.argsort(np.concatenate(stamps), kind="stable")]


@pytest.mark.parametrize("seed", range(3))
def test_a_table_merged_of_several_loses_the_empty_cells_of_each(seed: int) -> None:
    stamps, of = merged(seed)
    at = (np.sort(np.concatenate(stamps)) * 1e9).astype(np.int64)
    names = ("wheel.FR.v", "imu.yaw_rate", "odom.v")
    columns = [np.where(of == k, 0.5 + 0.01 * k, np.nan) for k in range(3)]
    found = mapped(*(channel(n, c, stamps=at) for n, c in zip(names, columns, strict=True))).items
    for k, name in enumerate(names):
        assert len(found[name].stamps) == 400
        assert np.isfinite(found[name].values).all()
        np.testing.assert_array_equal(found[name].stamps, at[of == k])


@pytest.mark.parametrize("seed", range(3))
def test_a_lost_channel_of_a_merged_table_keeps_the_empty_cells_of_its_own_rows(seed: int) -> None:
    stamps, of = merged(seed)
    at = (np.sort(np.concatenate(stamps)) * 1e9).astype(np.int64)
    whole = np.where(of == 0, 0.5, np.nan)
    lost = np.where(np.random.default_rng(seed).random(of.size) < 0.5, whole, np.nan)
    other = np.where(of > 0, 0.5, np.nan)
    found = mapped(
        channel("wheel.FR.v", lost, stamps=at),
        channel("wheel.FL.v", whole, stamps=at),
        channel("imu.yaw_rate", other, stamps=at),
    ).items
    assert len(found["wheel.FL.v"].stamps) == 400
    assert len(found["wheel.FR.v"].stamps) == 400
    assert np.isfinite(found["wheel.FR.v"].values).mean() == pytest.approx(0.5, abs=0.1)


def given(**signals: SignalSource) -> Machine:
    return replace(MACHINE, signals={k.replace("__", "."): v for k, v in signals.items()})


def test_given_signals_are_taken_exactly() -> None:
    machine = given(
        wheel__FR__v=SignalSource(topic="/a", field="x", unit="rpm", at="motor", gain=2.0, offset=1.0),
        wheel__FR__u=SignalSource(symbol="MAIN.u", unit="%"),
        cmd__v=SignalSource(column="v"),
    )
    channels = [channel("/a.x", [10.0], topic="/a"), channel("MAIN.u", [50]), channel("v", [0.1])]
    found = mapped(*channels, *joints({"velocity[fr_wheel]": [9.0]}), machine=machine).items
    np.testing.assert_allclose(found["wheel.FR.v"].values, [21 * 2 * np.pi / 60 * RADIUS / 17.7])
    assert (found["wheel.FR.u"].values[0], found["cmd.v"].values[0]) == (0.5, 0.1)
    assert not found["wheel.FR.v"].guessed


def test_a_channel_that_is_given_is_guessed_for_nothing_else() -> None:
    names = [f"wheel_{w.lower()}" for w in MACHINE.wheels]
    second = joints({f"velocity[{n}]": np.full(200, 0.3) for n in names}, "/wheel_reference_speeds")
    assert "wheel.FR.v_ref" in mapped(*second).items  # by its topic's name alone
    machine = replace(
        MACHINE,
        signals={
            f"wheel.{w}.v_true": SignalSource(topic="/wheel_reference_speeds", field=f"velocity[{n}]", unit="rad/s")
            for w, n in zip(MACHINE.wheels, names, strict=True)
        },
    )
    found = mapped(*second, machine=machine)
    assert set(found.items) == {f"wheel.{w}.v_true" for w in MACHINE.wheels}
    assert "is given as wheel.FR.v_true" in found.missing["wheel.FR.v_ref"]


def test_a_given_signal_that_is_not_there_is_missing_with_similar_names() -> None:
    found = mapped(channel("MAIN.fSpeed", [1.0]), machine=given(cmd__v=SignalSource(symbol="MAIN.fSped", unit="m/s")))
    assert "cmd.v" not in found.items
    assert "no source holds; similar: MAIN.fSpeed" in found.missing["cmd.v"]


def test_the_source_pattern_picks_the_file() -> None:
    machine = given(cmd__v=SignalSource(column="v", source="plc*.csv"))
    logs = [log_of(channel("v", [1.0]), source="a/bag.mcap"), log_of(channel("v", [0.2]), source="a/plc_1.csv")]
    found = map_signals(logs, machine)
    assert (found.items["cmd.v"].values[0], found.items["cmd.v"].source) == (0.2, "a/plc_1.csv")
    assert "no source matches" in map_signals(logs[:1], machine).missing["cmd.v"]


def test_a_given_unit_of_another_quantity_is_refused() -> None:
    with pytest.raises(ConfigError, match="is a pressure; expected a speed"):
        mapped(channel("v", [1.0]), machine=given(cmd__v=SignalSource(column="v", unit="bar")))


def test_the_recorded_unit_is_used_where_none_is_given() -> None:
    machine = given(cmd__v=SignalSource(column="v"))
    assert mapped(channel("v", [200.0], unit="mm/s"), machine=machine).items["cmd.v"].values[0] == 0.2
    found = mapped(channel("v", [0.2], unit="furlong"), machine=machine)
    assert any("unit 'furlong' is not known" in n for n in found.notes)


@pytest.mark.parametrize(
    ("signal", "source", "values", "text"),
    [
        ("wheel.FR.v", SignalSource(column="x", unit="rad/s"), [14.92], 'measured at the motor (gear ratio 17.7): set at = "motor"'),
        ("cmd.v", SignalSource(column="x", unit="m/s"), [300.0], "833.3 times max_speed 0.36 m/s; check its unit"),
        (
            "wheel.FR.v",
            SignalSource(column="x", unit="m/s"),
            [1e25],
            "wheel.FR.v reaches 1e25 m/s, which nothing does: it is damaged, no speed, or has another unit or gain",
        ),
        ("wheel.FR.u", SignalSource(column="x", unit="1"), [85.0], "reaches 85 of full opening with unit '1'; it is probably %"),
        (
            "wheel.FR.u",
            SignalSource(column="x", unit="1"),
            [12.0, 4.0, 20.0, 18.0],
            "with unit '1'; it is probably a current of 4 to 20 mA",
        ),
        ("steer.front.phi", SignalSource(column="x", unit="rad"), [35.0], "reaches 35 rad with unit 'rad', max_steer is 0.785 rad; it is probably deg"),
    ],
)  # fmt: skip
def test_wrong_units_are_told_with_figures(signal: str, source: SignalSource, values: list[float], text: str) -> None:
    found = mapped(channel("x", values), machine=replace(MACHINE, signals={signal: source}))
    assert any(text in n for n in found.notes), found.notes


def test_stamps_become_strictly_increasing_and_the_changes_are_counted() -> None:
    found = mapped(channel("cmd.v", [0.1, 0.2, 0.3, 0.4], stamps=[10, 30, 30, 20]))
    assert found.items["cmd.v"].stamps.tolist() == [10, 20, 30]
    assert found.items["cmd.v"].values.tolist() == [0.1, 0.4, 0.3]
    assert any("ran backwards once" in n for n in found.notes)
    assert any("1 sample shares its stamp" in n for n in found.notes)


def test_derivatives_of_integer_counters_are_exact() -> None:
    machine = given(wheel__FR__v=SignalSource(column="n", unit="mm", derivative=True))
    counter = np.array([2**63 + 10, 2**63 + 11, 2**63 + 13], np.uint64)
    found = mapped(channel("n", counter), machine=machine).items["wheel.FR.v"]
    np.testing.assert_allclose(found.values, [0.1, 0.15, 0.2])


def test_slope_of_a_parabola_is_exact_between_even_neighbours() -> None:
    stamps = np.arange(5, dtype=np.int64) * 1_000_000_000
    np.testing.assert_allclose(slope(stamps, np.arange(5.0) ** 2), [1, 2, 4, 6, 7])
    assert np.isnan(slope(stamps[:1], np.zeros(1))).all()


def test_plans_leave_out_what_holds_no_signal_and_keep_what_is_given() -> None:
    topics = [
        TopicInfo("/image", "sensor_msgs/msg/Image", 9, "cdr"),
        TopicInfo("/scan", "sensor_msgs/msg/LaserScan", 9, "cdr"),
        TopicInfo("/joint_states", "sensor_msgs/msg/JointState", 9, "cdr"),
        TopicInfo("/plc", "acme_msgs/msg/Plc", 9, "cdr"),
        TopicInfo("/cmd_vel", "geometry_msgs/msg/Twist", 9, "cdr", (), "no definition"),
    ]
    summary = LogSummary("a", "mcap", 0, 1, tuple(topics))
    table = LogSummary("b", "csv", 0, 1, (TopicInfo("b", "table", 5, "table"),))
    machine = given(cmd__v=SignalSource(topic="scan", field="angle_min"))
    assert plan_topics([summary, table], machine) == {"a": ("/scan", "/joint_states", "/plc"), "b": None}


def test_real_simulated_robot(reference_data: Path) -> None:
    log = read_log(reference_data / "reference_logs" / "abitobot", SourceOptions())
    found = map_signals([log], MACHINE).items
    assert {f"wheel.{w}.v" for w in MACHINE.wheels} <= set(found)
    assert found["wheel.RL.v"].origin.field == "velocity[wheel_left_back_joint]"


@pytest.mark.parametrize("moves", [True, False])
def test_the_forward_acceleration_of_an_inertial_unit_unless_it_has_none(moves: bool) -> None:
    """Drivers without an accelerometer publish zeros."""
    values = np.sin(np.arange(50.0)) if moves else np.zeros(50)
    columns = {"angular_velocity.z": np.ones(50), "linear_acceleration.x": values, "linear_acceleration.y": values}
    found = mapped(*topic("/imu/data", "sensor_msgs/msg/Imu", columns)).items
    assert ("imu.acceleration" in found) is moves
    assert "imu.yaw_rate" in found
    if moves:
        assert found["imu.acceleration"].origin.field == "linear_acceleration.x"


def test_real_husky(reference_data: Path) -> None:
    log = read_log(reference_data / "reference_logs" / "robot_localization" / "test1.bag", SourceOptions())
    found = map_signals([log], MACHINE).items
    assert {
        "imu.yaw_rate",
        "imu.acceleration",
        "gnss.lat",
        "gnss.lon",
        "odom.x",
        "odom.y",
        "odom.yaw",
        "odom.v",
    } == set(found)
    assert np.abs(np.diff(found["odom.yaw"].values)).max() < 0.5


@pytest.mark.parametrize(("column", "unit"), [("left_wheel_current", "A"), ("left_duty", "%"), ("left_torque", "")])
def test_an_effort_has_the_unit_of_its_name(column: str, unit: str) -> None:
    assert _effort_unit(column) == unit
