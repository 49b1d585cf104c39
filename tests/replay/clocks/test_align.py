"""One clock for the files of a mission: offset and drift from signals that both recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.clocks.align import align_clocks, estimate
from replay.clocks.source_clock import SourceClock
from replay.errors import ConfigError, LogError
from replay.export.recording import write_recording
from replay.log.raw_log import Channel, LogSummary, RawLog
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.config import haulotte
from replay.machine.toml_file import load_machine
from replay.machine.toml_text import dump_machine
from replay.mission import load_mission, read_signals
from replay.signals.signal import Signal, Signals

Array = NDArray[np.float64]

T0 = 1_760_000_000_000_000_000
DURATION = 120.0


def drive(seed: int = 3, duration: float = DURATION) -> Callable[[Array], Array]:
    """Speed of a random drive [m/s] over time [s]: levels held for seconds, entered with a lag."""
    rng = np.random.default_rng(seed)
    edges = np.cumsum(rng.uniform(0.8, 4.0, int(duration)))
    levels = rng.uniform(-0.3, 0.3, edges.size + 1)
    fine = np.arange(-1.0, duration + 1.0, 0.005)
    speed = np.zeros(fine.size)
    goal = levels[np.searchsorted(edges, fine)]
    for i in range(1, fine.size):
        speed[i] = speed[i - 1] + (goal[i] - speed[i - 1]) * 0.005 / 0.3
    return lambda t: np.interp(t, fine, speed)


def signal(name: str, t: Array, values: Array, source: str = "") -> Signal:
    return Signal(name, T0 + np.rint(t * 1e9).astype(np.int64), values, SignalSource(column=name), source, True)


def recorded(f: Callable[[Array], Array], t: Array, seed: int, std: float = 0.003) -> Array:
    noisy = f(t) + std * np.random.default_rng(seed).standard_normal(t.size)
    return np.round(noisy / 0.001) * 0.001


PLC = np.arange(0.0, DURATION, 0.001)
ROS = np.arange(4.0, DURATION - 3.0, 0.01)


def two_clocks(
    f: Callable[[Array], Array], offset: float, drift: float, wheels: tuple[str, ...] = ("FR", "FL")
) -> tuple[dict[str, Signal], dict[str, Signal]]:
    own = ROS + offset + drift * (ROS - ROS[0])
    names = [f"wheel.{w}.v" for w in wheels]
    plc = {n: signal(n, PLC, recorded(f, PLC, i)) for i, n in enumerate(names)}
    ros = {n: signal(n, own, recorded(f, ROS, 10 + i)) for i, n in enumerate(names)}
    return plc, ros


def worst(plc: dict[str, Signal], ros: dict[str, Signal]) -> tuple[float, SourceClock]:
    """Largest error of a moved stamp [s], and what is stated."""
    clock, line, between = estimate(plc, ros, ("plc.csv", "bag.mcap"))
    assert line is not None, clock.reason
    stamps = ros["wheel.FR.v"].stamps
    since = (stamps - stamps[0]) * 1e-9
    moved = (stamps - T0 + between) * 1e-9 + line.lag(since)
    return float(np.abs(moved - ROS).max()), clock


@pytest.mark.parametrize(
    ("offset", "drift"),
    [(0.319, 50e-6), (-0.319, -50e-6), (3600.0, 0.0), (-7199.8, 200e-6), (0.06, -200e-6), (-T0 / 1e9, 20e-6)],
)
def test_offset_and_drift_are_found_at_every_time(offset: float, drift: float) -> None:
    error, clock = worst(*two_clocks(drive(), offset, drift))
    assert clock.method == "estimated"
    assert clock.uncertainty_s is not None
    assert error < 1e-3
    assert error < clock.uncertainty_s < 3e-3
    assert clock.drift_ppm == pytest.approx(-drift * 1e6, abs=15)
    assert clock.overlap_s == pytest.approx(ROS[-1] - ROS[0], abs=0.1)
    assert "moved onto the clock of plc.csv" in clock.sentence


def test_faults_in_one_copy_do_not_move_it() -> None:
    plc, ros = two_clocks(drive(), 0.319, 50e-6)
    values = ros["wheel.FR.v"].values.copy()
    values[2000:4000] = values[2000]  # stuck for 20 s
    values[6000:7000] = np.nan  # silent for 10 s
    other = plc["wheel.FL.v"].values.copy()
    other[70_000:90_000] *= 0.6
    other[20_000:30_000] = 0.0
    ros["wheel.FR.v"] = replace(ros["wheel.FR.v"], values=values)
    plc["wheel.FL.v"] = replace(plc["wheel.FL.v"], values=other)
    error, clock = worst(plc, ros)
    assert error < 2e-3
    assert clock.uncertainty_s is not None
    assert error < clock.uncertainty_s


def test_a_common_clock_is_left_alone() -> None:
    _, clock = worst(*two_clocks(drive(), 0.0, 0.0))
    assert clock.method == "common"
    assert abs(clock.offset_s) < 2e-3
    assert "share one clock" in clock.sentence


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (lambda t: 0 * t + 0.2, "no shift makes them agree"),
        (lambda t: 0.2 * np.sin(2 * np.pi * t / 8.0), "periodic"),
        (lambda t: 0.2 * np.sign(np.sin(2 * np.pi * t / 20.0)), "periodic"),
        (lambda t: 0.3 / (1 + np.exp(-(t - 60.0) * 4)), "no shift makes them agree"),
    ],
)
def test_what_tells_no_moment_moves_nothing(shape: Callable[[Array], Array], words: str) -> None:
    clock, line, _ = estimate(*two_clocks(shape, 0.319, 0.0), ("plc.csv", "bag.mcap"))
    assert line is None
    assert clock.method == "as recorded"
    assert words in clock.reason
    assert "Set clock_offset and clock_drift" in clock.sentence


def test_other_drives_do_not_match() -> None:
    plc, _ = two_clocks(drive(3), 0.0, 0.0)
    _, ros = two_clocks(drive(4), 0.0, 0.0)
    clock, line, _ = estimate(plc, ros)
    assert line is None
    assert clock.reason


def test_days_between_clocks_that_were_set_are_told_and_not_bridged() -> None:
    clock, line, _ = estimate(*two_clocks(drive(), 3 * 86_400.0, 0.0))
    assert line is None
    assert "−3.0 days" in clock.reason


@pytest.mark.parametrize("step", [0.02, 0.3, 2.0, 3600.0])
def test_a_clock_that_jumps_is_told(step: float) -> None:
    plc, ros = two_clocks(drive(), 0.319, 0.0)
    jumped = {n: replace(s, stamps=s.stamps + np.where(ROS > 90.0, int(step * 1e9), 0)) for n, s in ros.items()}
    clock, line, _ = estimate(plc, jumped)
    assert line is None
    assert clock.method == "as recorded"
    assert clock.reason


def test_a_slow_command_that_a_fast_table_repeats() -> None:
    """The PLC holds what it receives at 10 Hz and records it at 1 kHz: its values are not late by half a period."""
    sent = np.arange(0.0, DURATION, 0.1)
    command = np.round(drive()(sent), 6)
    held = command[np.searchsorted(sent, PLC + 1e-9, side="right") - 1]
    ros = {"cmd.v": signal("cmd.v", sent + 0.5, command)}
    clock, line, _ = estimate({"cmd.v": signal("cmd.v", PLC, held)}, ros)
    assert line is not None
    assert clock.offset_s == pytest.approx(-0.5, abs=2e-3)


def test_a_bridge_that_publishes_the_newest_samples_of_the_plc() -> None:
    plc, _ = two_clocks(drive(), 0.0, 0.0, ("FR",))
    sent = ROS + np.random.default_rng(8).uniform(0.0, 0.002, ROS.size)
    newest = np.searchsorted(PLC, sent, side="right") - 1
    own = sent + 0.319 + 50e-6 * sent
    ros = {"wheel.FR.v": signal("wheel.FR.v", own, plc["wheel.FR.v"].values[newest] / 0.427 * 0.427)}
    clock, line, between = estimate(plc, ros)
    assert line is not None
    stamps = ros["wheel.FR.v"].stamps
    error = (stamps - T0 + between) * 1e-9 + line.lag((stamps - stamps[0]) * 1e-9) - sent
    assert clock.uncertainty_s is not None
    assert np.abs(error).max() < 3e-4 < clock.uncertainty_s < 2e-3


def test_two_sensors_stand_in_with_a_wider_bound() -> None:
    f = drive()
    plc = {"wheel.FR.v": signal("wheel.FR.v", PLC, recorded(f, PLC, 1))}
    ros = {"wheel.FR.v_true": signal("wheel.FR.v_true", ROS + 2.5, recorded(f, ROS, 2))}
    clock, line, _ = estimate(plc, ros)
    assert line is not None
    assert clock.signals == ("wheel.FR.v with wheel.FR.v_true",)
    assert clock.uncertainty_s is not None
    assert 0.02 < clock.uncertainty_s < 0.03


def test_a_gyro_beside_odometry() -> None:
    rate = drive(5)
    plc = {"imu.yaw_rate": signal("imu.yaw_rate", PLC, recorded(rate, PLC, 1))}
    yaw = np.cumsum(rate(PLC)) * 0.001
    ros = {"odom.yaw": signal("odom.yaw", ROS + 40.0, np.interp(ROS, PLC, yaw))}
    clock, line, _ = estimate(plc, ros)
    assert line is not None
    assert clock.offset_s == pytest.approx(-40.0, abs=0.01)


def as_signals(items: dict[str, Signal]) -> Signals:
    return Signals(items, {})


@pytest.fixture
def mission(tmp_path: Path) -> tuple[Path, Path]:
    """A bag with the true clock, and a PLC table an hour and 0.319 s ahead that drifts by 50 ppm."""
    f = drive(3, 60.0)
    slow, fast = np.arange(2.0, 58.0, 0.01), np.arange(0.0, 60.0, 0.002)
    own = fast + 3600.319 + 50e-6 * fast
    speeds = {n: signal(n, slow, recorded(f, slow, i)) for i, n in enumerate(("wheel.FR.v", "wheel.FL.v"))}
    table = {n: signal(n, own, recorded(f, fast, 5 + i)) for i, n in enumerate(speeds)}
    table["wheel.FR.u"] = signal("wheel.FR.u", own, np.round(np.sin(fast), 6))
    speeds["cmd.omega"] = signal("cmd.omega", slow, np.cos(slow))
    bag, plc = tmp_path / "bag.mcap", tmp_path / "plc.csv"
    write_recording(as_signals(speeds), bag, "mcap")
    write_recording(as_signals(table), plc, "csv")
    return bag, plc


def test_files_whose_wall_clocks_do_not_overlap(mission: tuple[Path, Path]) -> None:
    bag, plc = mission
    loaded = load_mission([bag, plc], haulotte())
    first, second = (f.clock for f in loaded.files)
    assert first is not None
    assert second is not None
    assert (first.method, second.method) == ("reference", "estimated")
    assert second.offset_s == pytest.approx(-3600.319, abs=3e-3)
    moved = loaded.signals.items["wheel.FR.u"]
    assert np.abs((moved.stamps - T0) * 1e-9 - np.arange(0.0, 60.0, 0.002)).max() < 3e-3
    assert any("plc.csv: its stamps were moved" in n for n in loaded.signals.notes)
    turned = load_mission([plc, bag], haulotte())
    assert turned.files[1].clock is not None
    assert turned.files[1].clock.offset_s == pytest.approx(3600.319, abs=3e-3)


def test_the_machine_file_switches_off_or_fixes(mission: tuple[Path, Path], tmp_path: Path) -> None:
    bag, plc = mission
    file = tmp_path / "machine.toml"
    file.write_text('[sources]\n"*.csv" = { clock = "as recorded" }\n')
    with pytest.raises(LogError, match="do not overlap in time"):
        load_mission([bag, plc], load_machine(file))
    file.write_text('[sources]\n"*.csv" = { clock_offset = -3600.319, clock_drift = -50 }\n')
    machine = load_machine(file)
    files, signals = read_signals([bag, plc], machine)
    assert files[1].clock is not None
    assert files[1].clock.method == "given"
    assert np.abs((signals.items["wheel.FR.u"].stamps - T0) * 1e-9 - np.arange(0.0, 60.0, 0.002)).max() < 1e-5
    assert any("as the machine file says" in n for n in signals.notes)
    again = tmp_path / "again.toml"
    again.write_text(dump_machine(machine))
    assert load_machine(again).sources == machine.sources


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('clock = "guess"', "expected estimate or as recorded"),
        ("clock_offset = 1e11", "clock_offset"),
        ("clock_drift = -2e6", "ppm"),
        ('clock = "as recorded", clock_offset = 1.0', "contradicts"),
    ],
)
def test_settings_are_checked(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "machine.toml"
    file.write_text(f'[sources]\n"*.csv" = {{ {text} }}\n')
    with pytest.raises(ConfigError, match=words):
        load_machine(file)


def test_files_without_a_match_say_why_when_they_are_refused(mission: tuple[Path, Path], tmp_path: Path) -> None:
    late = np.arange(0.0, 60.0, 0.01) + 86_400.0
    other = tmp_path / "other.csv"
    write_recording(as_signals({"wheel.RR.u": signal("wheel.RR.u", late, np.sin(late))}), other, "csv")
    with pytest.raises(LogError, match=r"do not overlap in time.*no moving signal is recorded in both"):
        load_mission([mission[0], other], haulotte())


def raw(source: str, items: dict[str, Signal]) -> RawLog:
    channels = {n: Channel(n, "", n, s.stamps, s.values, None, "f8") for n, s in items.items()}
    return RawLog(source, "csv", "header", channels, LogSummary(source, "csv", 0, 0, ()))


def test_a_third_file_is_placed_through_the_second() -> None:
    f, g = drive(3), drive(4)
    a = {"wheel.FR.v": signal("wheel.FR.v", PLC, recorded(f, PLC, 1))}
    b = {
        "wheel.FR.v": signal("wheel.FR.v", ROS + 20.0, recorded(f, ROS, 2)),
        "wheel.RR.v": signal("wheel.RR.v", ROS + 20.0, recorded(g, ROS, 3)),
    }
    c = {"wheel.RR.v": signal("wheel.RR.v", ROS - 7.0, recorded(g, ROS, 4))}
    logs = [raw("a.csv", a), raw("c.csv", c), raw("b.csv", b)]
    moved, clocks = align_clocks(logs, haulotte(), [SourceOptions()] * 3)
    assert [x.method for x in clocks] == ["reference", "estimated", "estimated"]
    assert [x.reference for x in clocks] == ["", "b.csv", "a.csv"]
    for log in moved[1:]:
        stamps = log.channels["wheel.RR.v"].stamps
        assert np.abs((stamps - T0) * 1e-9 - ROS).max() < 5e-3
    assert moved[2].channels["wheel.FR.v"].stamps is not moved[2].channels["wheel.RR.v"].stamps


def test_channels_go_on_sharing_their_stamps() -> None:
    _, ros = two_clocks(drive(), 5.0, 0.0)
    stamps = ros["wheel.FR.v"].stamps
    shared = {n: replace(s, stamps=stamps) for n, s in ros.items()}
    moved, _ = align_clocks(
        [raw("a.csv", two_clocks(drive(), 0.0, 0.0)[0]), raw("b.csv", shared)], haulotte(), [SourceOptions()] * 2
    )
    assert moved[1].channels["wheel.FR.v"].stamps is moved[1].channels["wheel.FL.v"].stamps


def test_hours_at_a_high_rate_are_bounded() -> None:
    f = drive(6, 5400.0)
    fast, slow = np.arange(0.0, 5400.0, 0.002), np.arange(60.0, 5000.0, 0.02)
    plc = {"wheel.FR.v": signal("wheel.FR.v", fast, recorded(f, fast, 1))}
    ros = {"wheel.FR.v": signal("wheel.FR.v", slow * (1 - 180e-6) - 900.0, recorded(f, slow, 2))}
    clock, line, between = estimate(plc, ros)
    assert line is not None
    stamps = ros["wheel.FR.v"].stamps
    error = (stamps - T0 + between) * 1e-9 + line.lag((stamps - stamps[0]) * 1e-9) - slow
    assert np.abs(error).max() < 2e-3
    assert clock.uncertainty_s is not None
    assert np.abs(error).max() < clock.uncertainty_s
