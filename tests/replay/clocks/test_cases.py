"""What clocks do in logs, case by case: what becomes of the stamps, and what is said. Values are true times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from replay.export.formats.message_layout import Layout
from replay.log.raw_log import Clock
from replay.log.source_options import SourceOptions
from replay.log.stamp_order import spread_ticks
from replay.machine.config import haulotte
from replay.mission import load_mission, read_signals
from replay.signals.signal import Signals

Stamps = NDArray[np.int64]

T0 = 1_760_000_000_000_000_000
S = 1_000_000_000
HOUR = 3600 * S
N, STEP = 600, 20_000_000
TRUE = np.arange(N, dtype=np.int64) * STEP
LATE = 800_000 + 1000 * (np.arange(N, dtype=np.int64) * 7 % 60)  # from header to log
STORE = get_typestore(Stores.ROS2_HUMBLE)


def write_log(path: Path, header: Stamps, log: Stamps, publish: Stamps | None = None) -> Path:
    """wheel.FR.v with header stamps, and wheel.FL.v in messages that have none; both hold the true time [s]."""
    joint, plain = Layout("cdr"), Layout("cdr")
    joint.varying("sec", "i4")
    joint.varying("nanosec", "u4")
    joint.text("")
    joint.constant("I", 1)
    joint.text("wheel.FR.v")
    joint.doubles("position", 1)
    joint.doubles(None)
    joint.doubles(None)
    plain.varying("data", "f8")
    rows = np.tile(joint.template, (len(header), 1)), np.tile(plain.template, (len(header), 1))
    true = np.arange(len(header)) * STEP / S
    fields = rows[0].view(joint.dtype)[:, 0], rows[1].view(plain.dtype)[:, 0]
    fields[0]["sec"], fields[0]["nanosec"] = header // S, header % S
    fields[0]["position"] = true[:, None]
    fields[1]["data"] = true
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        ids = []
        for topic, kind in (("/joints", "sensor_msgs/msg/JointState"), ("/wheel/FL/v", "std_msgs/msg/Float64")):
            text = STORE.generate_msgdef(kind, ros_version=2)[0]
            ids.append(writer.register_channel(topic, "cdr", writer.register_schema(kind, "ros2msg", text.encode())))
        for i in range(len(header)):
            at = int(log[i])
            for channel, data in zip(ids, rows, strict=True):
                writer.add_message(channel, at, data[i].tobytes(), at if publish is None else int(publish[i]))
        writer.finish()
    return path


def write_table(path: Path, stamps: Stamps) -> Path:
    rows = "".join(f"{t},{i * STEP / S}\n" for i, t in enumerate(stamps.tolist()))
    path.write_text(f"time_ns,wheel.FR.v\n{rows}")
    return path


def read(path: Path, **options: object) -> tuple[Signals, tuple[str, ...]]:
    """Signals, and all that is said about the file."""
    machine = replace(haulotte(), sources={"*": SourceOptions(**options)})  # type: ignore[arg-type]
    files, signals = read_signals([path], machine)
    return signals, (*files[0].summary.notes, *files[0].summary.damage, *signals.notes)


def worst(signals: Signals, name: str = "wheel.FR.v", zero: int = T0) -> float:
    """Largest distance of a stamp from the true time of its value [ms]."""
    signal = signals.items[name]
    return float(np.abs(signal.stamps - zero - np.rint(signal.values * S)).max()) / 1e6


def after(seconds: float, size: int) -> Stamps:
    """A step of that size from that time on."""
    return np.where(seconds * S <= TRUE, size, 0)


def at(rows: list[int], values: list[int]) -> Callable[[Stamps], Stamps]:
    def change(stamps: Stamps) -> Stamps:
        out = stamps.copy()
        out[rows] = values
        return out

    return change


GOOD = T0 + TRUE
# Header stamps; words that are said; largest error of the stamps [ms].
HEADERS: dict[str, tuple[Stamps, list[str], float]] = {
    "in order": (GOOD, [], 0.0),
    "an hour ahead from 5 s on": (GOOD + after(5, HOUR), ["/joints", "jump once", "+3600.000 s after 5.0 s"], 0.0),
    "an hour back from 5 s on": (GOOD + after(5, -HOUR), ["jump once", "−3600.000 s"], 0.0),
    "set by NTP after 3 s": (GOOD + after(3, 300_000_000), ["jump once", "+0.300 s after 3.0 s", "taken out"], 0.1),
    "set twice": (GOOD + after(3, -400_000_000) + after(8, 150_000_000), ["jump 2 times"], 0.1),
    "unset until 4 s": (np.where(TRUE < 4 * S, TRUE, GOOD), ["jump once", "days"], 1.0),
    "32 bits of nanoseconds": (GOOD % 2**32, ["32-bit counter", "every 4.295 s"], 0.0),
    "32 bits of microseconds": (
        (GOOD // 1000 + 2**32 - (T0 // 1000 % 2**32) - 6_000_000) % 2**32 * 1000,
        ["32-bit counter", "every 4294.967 s", "1 wraps"],
        0.1,  # one stamp is zero
    ),
    "zero now and then": (at([10, 300], [0, 0])(GOOD), ["2 of 600 header stamps are zero"], 1.0),
    "2^62 and before 1970": (at([50, 51], [2**62 // S * S, -2_000_000 * S])(GOOD), ["2 of 600", "deviate from the course"], 1.0),
    "10 s back for one message": (at([200], [T0 + TRUE[200] - 10 * S])(GOOD), ["1 of 600", "deviate from the course"], 1.0),
    "backwards among neighbours": (at([100, 101], [T0 + TRUE[101], T0 + TRUE[100]])(GOOD), ["ran backwards once"], 20.0),
    "66 days before": (GOOD - 66 * 24 * HOUR, ["66.0 days before"], 0.0),
    "drifts by 200 ms": (GOOD + TRUE // 60, ["ppm", "+133 ms"], 201.0),
    "ticks of 100 ms": (GOOD // 100_000_000 * 100_000_000, ["ticks every 100 ms"], 0.1),
}  # fmt: skip


@pytest.mark.parametrize("case", HEADERS)
def test_header_clock(tmp_path: Path, case: str) -> None:
    header, words, error = HEADERS[case]
    signals, said = read(write_log(tmp_path / "a.mcap", header, GOOD + LATE))
    shift = int(header[0]) - T0 if case.startswith(("66", "32")) else 0  # what stays far from the log stays there
    assert len(signals.items["wheel.FR.v"].stamps) == N
    assert worst(signals, zero=T0 + shift) <= error
    assert worst(signals, "wheel.FL.v", T0 + shift) <= max(error, 1.0)
    for word in words:
        assert any(word in text for text in said), (word, said)
    if not words:
        assert not any("jump" in text or "drift" in text or "left out" in text for text in said)


LOGS: dict[str, Stamps] = {
    "an hour ahead": after(5, HOUR),
    "an hour back": after(5, -HOUR),
    "half a second back": after(5, -500_000_000),
}


@pytest.mark.parametrize("case", LOGS)
@pytest.mark.parametrize("clock", ["header", "log"])
def test_log_clock_jumps(tmp_path: Path, case: str, clock: Clock) -> None:
    path = write_log(tmp_path / "a.mcap", GOOD, GOOD + LATE + LOGS[case])
    signals, said = read(path, stamp=clock)
    base = 0 if worst(signals) < 2.0 else int(LOGS[case][-1])  # either part may be the one that stays
    assert worst(signals, zero=T0 + base) < 2.0
    assert any("log's stamps jump" in text for text in said)
    if clock == "header":
        assert worst(signals) == 0.0
        assert worst(signals, "wheel.FL.v") < 2.0


def test_a_header_clock_that_is_half_a_second_off(tmp_path: Path) -> None:
    signals, said = read(write_log(tmp_path / "a.mcap", GOOD + 500_000_000, GOOD + LATE))
    assert worst(signals, zero=T0 + 500_000_000) == 0.0
    assert worst(signals, "wheel.FL.v", T0 + 500_000_000) < 0.1
    assert any("moved from the log clock" in text for text in said)


def test_late_receipt_is_no_jump(tmp_path: Path) -> None:
    late = LATE.copy()
    for first in (100, 300, 500):  # messages pile up for 0.6 s and then come at once
        rows = slice(first, first + 30)
        late[rows] += TRUE[first + 30] - TRUE[rows]
    signals, said = read(write_log(tmp_path / "a.mcap", GOOD, GOOD + late))
    assert worst(signals) == 0.0
    assert not any("jump" in text or "deviate from the course" in text for text in said)


def test_slow_network_is_no_jump(tmp_path: Path) -> None:
    signals, said = read(write_log(tmp_path / "a.mcap", GOOD, GOOD + LATE + after(6, 400_000_000)))
    assert worst(signals) == 0.0
    assert worst(signals, "wheel.FL.v") <= 401.0  # one topic does not prove whose clock it was
    assert not any("taken out" in text for text in said)


@pytest.mark.parametrize("case", ["an hour ahead from 5 s on", "zero now and then", "in order"])
def test_publish_clock(tmp_path: Path, case: str) -> None:
    publish, _, error = HEADERS[case]
    signals, said = read(write_log(tmp_path / "a.mcap", GOOD, GOOD + LATE, publish), stamp="publish")
    for name in ("wheel.FR.v", "wheel.FL.v"):
        assert worst(signals, name) <= max(error, 1.0)
    assert any("publish stamps" in text for text in said) == (case != "in order")


def test_simulated_time_that_starts_again(tmp_path: Path) -> None:
    header = 5 * S + TRUE // 2  # half as fast as the log
    again = np.where(TRUE < 9 * S, header, header - 4 * S)
    signals, said = read(write_log(tmp_path / "a.mcap", again, GOOD + LATE))
    signal = signals.items["wheel.FR.v"]
    assert np.abs(signal.stamps - header).max() < 3e6
    assert np.abs(signals.items["wheel.FL.v"].stamps - header).max() < 3e6
    assert any("jump once" in text for text in said)
    assert any("days before" in text for text in said)


# Stamps of a table, which has no second clock; words; what is left out; largest error [ms].
TABLES: dict[str, tuple[Stamps, list[str], int, float]] = {
    "in order": (GOOD, [], 0, 0.0),
    "an hour back from 5 s on": (GOOD + after(5, -HOUR), ["set back once", "−3600"], 0, 0.0),
    "5 s back from 8 s on": (GOOD + after(8, -5 * S), ["set back once", "−5.000 s"], 0, 0.0),
    "an hour ahead from 5 s on": (GOOD + after(5, HOUR), ["jump ahead", "3600.020 s", "kept"], 0, 3.6e6),
    "zero now and then": (at([10, 300], [0, 0])(GOOD), ["2 of 600 stamps are far", "left out"], 2, 0.0),
    "2^62 and before 1970": (
        at([50, 51], [2**62, -2_000_000 * S])(GOOD),
        ["left out", "1 of 599 stamps are far"],
        2,
        0.0,
    ),
    "unset until 4 s": (np.where(TRUE < 4 * S, TRUE, GOOD), ["200 samples", "left out"], 200, 0.0),
    "twice the same": (np.repeat(GOOD[::2], 2), ["ticks every 40 ms"], 0, 0.1),
    "ticks of a second": (GOOD // S * S, ["ticks every 1000 ms"], 0, 0.1),
}


@pytest.mark.parametrize("case", TABLES)
def test_table_clock(tmp_path: Path, case: str) -> None:
    stamps, words, lost, error = TABLES[case]
    signals, said = read(write_table(tmp_path / "a.csv", stamps), time="time_ns", time_unit="ns")
    assert len(signals.items["wheel.FR.v"].stamps) == N - lost
    assert worst(signals) <= error
    for word in words:
        assert any(word in text for text in said), (word, said)


def test_both_clocks_unset_until_4_s(tmp_path: Path) -> None:
    header = np.where(TRUE < 4 * S, S + TRUE, GOOD)
    signals, said = read(write_log(tmp_path / "a.mcap", header, header + LATE))
    for name in ("wheel.FR.v", "wheel.FL.v"):
        assert len(signals.items[name].stamps) == 400
        assert worst(signals, name) <= 1.0
        assert signals.items[name].values[0] == 4.0
    assert sum("200 samples on the other side" in text for text in said) == 2


def test_both_clocks_set_back_within_the_log(tmp_path: Path) -> None:
    header = GOOD + after(8, -5 * S)
    signals, said = read(write_log(tmp_path / "a.mcap", header, header + LATE))
    for name in ("wheel.FR.v", "wheel.FL.v"):
        assert len(signals.items[name].stamps) == N
        assert worst(signals, name) <= 1.0
    assert sum("set back once" in text for text in said) == 2


def test_chunks_out_of_order_are_sorted(tmp_path: Path) -> None:
    order = np.concatenate([np.arange(0, 200), np.arange(400, 600), np.arange(200, 400)])
    stamps = GOOD[order]
    signals, said = read(write_log(tmp_path / "a.mcap", stamps, stamps + LATE))
    assert np.array_equal(signals.items["wheel.FR.v"].stamps, GOOD)
    assert np.array_equal(signals.items["wheel.FR.v"].values[200:400], np.arange(400, 600) * STEP / S)
    assert not any("set back" in text or "left out" in text for text in said)


def test_samples_left_out_are_damage(tmp_path: Path) -> None:
    path = write_table(tmp_path / "a.csv", at([10], [0])(GOOD))
    machine = replace(haulotte(), sources={"*": SourceOptions(time="time_ns", time_unit="ns")})
    mission = load_mission([path], machine)
    assert any("left out" in text for text in mission.files[0].summary.damage)
    assert mission.timeline.size == N


def test_equal_messages_are_not_spread() -> None:
    stamps = np.repeat(GOOD[::2], 2)
    assert spread_ticks(stamps, np.repeat(np.arange(N // 2), 2)) is None
    assert spread_ticks(GOOD, np.arange(N)) is None


def test_a_first_and_a_last_tick_that_are_cut_off() -> None:
    true = T0 + 730_000_000 + np.arange(1000, dtype=np.int64) * 10_000_000
    found = spread_ticks(true // S * S, np.arange(1000))
    assert found is not None
    assert found[1] == S
    assert np.abs(found[0] - true).max() <= 10_000_000


@pytest.mark.parametrize("every", [1, 4])
def test_bunches_that_a_gateway_hands_on_at_once_are_spread_over_the_time_before(every: int) -> None:
    """Also of a node that says each value `every` times."""
    true = T0 + np.arange(2000, dtype=np.int64) * 5_000_000
    handed = (true // 40_000_000 + 1) * 40_000_000
    found = spread_ticks(handed + np.arange(2000) % 8 * 7_000, np.arange(2000) // every)
    assert found is not None
    assert found[1] == pytest.approx(40_000_000, rel=0.01)
    assert np.all(np.diff(found[0]) > 0)
    assert np.abs(found[0] - true)[8:-8].max() <= 5_000_000


@pytest.mark.parametrize("name", ["gps_nav_ws/bag", "gps_nav_ws/bag2", "abitobot", "robot_localization/test2.bag"])
def test_recorded_logs(reference_data: Path, name: str) -> None:
    """Stamps 66 days before log time, simulated time, and bursty arrival: no stamp is repaired that is right."""
    signals, said = read(reference_data / "reference_logs" / name)
    assert not any(
        "taken out" in t or "deviate from the course" in t or "left out" in t or "set back" in t for t in said
    ), said
    spans = [(int(s.stamps[0]), int(s.stamps[-1])) for s in signals.items.values() if len(s.stamps) > 1]
    longest = max(b - a for a, b in spans)
    assert spans
    assert max(b for _, b in spans) - min(a for a, _ in spans) < 1.2 * longest  # all on one clock
