"""A diagnosis as ROS messages: read by rosbags and by mcap-ros2-support, message by message."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from diagnosis.ros.records import diagnosis_records, unmoved
from diagnosis.ros.statuses import Level, courses
from replay.export.clips.mcap import Definitions, write_clip
from tests.whole_documents import whole_report

START = 1_760_000_000_250_000_000
SECOND = 10**9


def coverage(component: str, side: str, tier: str = "direct") -> dict[str, Any]:
    return {
        "component": component, "side": side, "tier": tier, "seconds": {}, "driving_s": 9.0, "decided_driving_s": 9.0,
    }  # fmt: skip


def state(component: str, side: str, name: str, start: float, stop: float, reason: str = "") -> dict[str, Any]:
    return {"component": component, "side": side, "state": name, "start_s": start, "stop_s": stop, "reason": reason}


def fault(
    number: int, side: str, mode: str, span: tuple[float, float], severity: str, epsilon: float | None
) -> dict[str, Any]:
    size = None if epsilon is None else {"value": epsilon, "low": epsilon - 0.05, "high": epsilon}
    return {
        "id": f"F{number}", "component": "FR", "side": side, "mode": mode, "start_s": span[0], "stop_s": span[1],
        "start_ns": START + round(span[0] * SECOND), "stop_ns": START + round(span[1] * SECOND), "epsilon": size,
        "probability": 0.97, "severity": severity, "evidence": ["Stayed at 0.3 m/s.", "Größe ε."], "tier": "direct",
        "advice": "Repair it.",
    }  # fmt: skip


def report(faults: list[dict[str, Any]] | None = None, duration: float = 10.0) -> Any:
    known = [
        state("FR", "sensor", "not_excited", 0.0, 2.5, "nothing moves"),
        state("FR", "sensor", "healthy", 2.5, 4.0),
        state("FR", "sensor", "stuck", 4.0, 6.125),
        state("FR", "sensor", "healthy", 6.125, 10.0),
        state("FR", "actuator", "masked", 0.0, 5.0),
        state("FR", "actuator", "noisy", 5.0, 7.0),
        # … of the rest nothing is known
        state("front", "sensor", "no_data", 0.0, 10.0, "not logged"),
    ]
    return whole_report(
        {
            "log": {"files": [{"path": "drive.mcap"}], "start_ns": START, "duration_s": duration, "open_loop": False},
            "machine": {"id": "H-07", "wheels": ["FR"], "axles": ["front"]},
            "verdict": {"status": "stop", "title": "FR was stuck", "text": "", "caveats": [], "actions": []},
            "intervals": [fault(1, "sensor", "stuck", (4.0, 6.125), "high", 1.0)] if faults is None else faults,
            "states": known,
            "coverage": [coverage("FR", "sensor"), coverage("FR", "actuator"), coverage("front", "sensor", "none")],
        }
    )


def written(folder: Path, document: Any, places: Any = unmoved, **part: int) -> Path:
    definitions, path = Definitions(), folder / "result.mcap"
    write_clip(path, definitions, diagnosis_records(document, definitions, places, **part), {})
    return path


def store_of(definition: str, name: str) -> Typestore:
    """Type store that knows nothing but what the file's own definition says."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, name))
    return store


def by_rosbags(path: Path) -> dict[str, list[tuple[int, Any]]]:
    out: dict[str, list[tuple[int, Any]]] = {}
    stores: dict[int, Typestore] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None
            store = stores.setdefault(schema.id, store_of(schema.data.decode(), schema.name))
            out.setdefault(channel.topic, []).append(
                (message.log_time, store.deserialize_cdr(message.data, schema.name))
            )
    return out


def by_mcap_ros2(path: Path) -> dict[str, list[tuple[int, Any]]]:
    out: dict[str, list[tuple[int, Any]]] = {}
    with path.open("rb") as file:
        for decoded in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            out.setdefault(decoded.channel.topic, []).append((decoded.message.log_time, decoded.decoded_message))
    return out


def plain(message: Any) -> Any:
    """Fields of a message of either decoder, as plain values."""
    if isinstance(message, str | int | float):
        return message
    if isinstance(message, list | tuple):
        return [plain(m) for m in message]
    if isinstance(message, bytes):
        return list(message)
    names = getattr(message, "__slots__", None) or list(vars(message))
    return {n: plain(getattr(message, n)) for n in names if not n.startswith("_") and not n.isupper()}


def levels(path: Path) -> dict[str, list[tuple[float, int]]]:
    """Level of each part where it changes, by seconds of the mission."""
    out: dict[str, list[tuple[float, int]]] = {}
    for _, m in by_rosbags(path)["/mfhca/diagnostics"]:
        t = (m.header.stamp.sec * SECOND + m.header.stamp.nanosec - START) / SECOND
        for status in m.status:
            course = out.setdefault(status.name, [])
            if not course or course[-1][1] != status.level:
                course.append((t, status.level))
    return out


def test_two_independent_decoders_read_the_same(tmp_path: Path) -> None:
    path = written(tmp_path, report())
    one, other = by_rosbags(path), by_mcap_ros2(path)
    assert set(one) == set(other) == {"/mfhca/diagnostics", "/mfhca/events"}
    for topic, messages in one.items():
        assert [plain(m) for _, m in messages] == [plain(m) for _, m in other[topic]]
        assert [t for t, _ in messages] == [t for t, _ in other[topic]]
    array = plain(one["/mfhca/diagnostics"][0][1])
    assert array["header"]["stamp"] == {"sec": 1_760_000_000, "nanosec": 250_000_000}
    assert [s["name"] for s in array["status"]] == ["FR speed sensor", "FR drive valve", "front steering sensor"]


def test_the_definition_is_whole(tmp_path: Path) -> None:
    with written(tmp_path, report()).open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    texts = {s.name: s.data.decode() for s in summary.schemas.values()}
    assert {s.encoding for s in summary.schemas.values()} == {"ros2msg"}
    for part in ("diagnostic_msgs/DiagnosticStatus", "diagnostic_msgs/KeyValue", "std_msgs/Header"):
        assert f"MSG: {part}\n" in texts["diagnostic_msgs/msg/DiagnosticArray"]
    assert "MSG: builtin_interfaces/Time\n" in texts["rcl_interfaces/msg/Log"]


def test_ok_only_where_judged_healthy(tmp_path: Path) -> None:
    ok, warn, error, stale = (int(level) for level in Level)
    assert levels(written(tmp_path, report())) == {
        "FR speed sensor": [(0.0, stale), (2.5, ok), (4.0, error), (6.125, ok)],
        "FR drive valve": [(0.0, stale), (5.0, warn), (7.0, stale)],
        "front steering sensor": [(0.0, stale)],
    }


@pytest.mark.parametrize(("severity", "level"), [("info", 1), ("low", 1), ("medium", 1), ("high", 2)])
def test_a_fault_is_a_warning_and_a_severe_one_an_error(tmp_path: Path, severity: str, level: int) -> None:
    path = written(tmp_path, report([fault(1, "sensor", "stuck", (4.0, 6.125), severity, 1.0)]))
    assert (4.0, level) in levels(path)["FR speed sensor"]


def test_a_fault_of_either_side_is_shown_on_both(tmp_path: Path) -> None:
    path = written(tmp_path, report([fault(1, "sensor_or_actuator", "inefficient", (3.0, 3.5), "high", 0.4)]))
    for part in ("FR speed sensor", "FR drive valve"):
        assert (3.0, 2) in levels(path)[part]


def test_key_values_say_what_was_found(tmp_path: Path) -> None:
    found = by_rosbags(written(tmp_path, report()))["/mfhca/diagnostics"]
    at = {(t - START) / SECOND: {s.name: s for s in m.status} for t, m in found}
    sensor = at[4.0]["FR speed sensor"]
    assert (sensor.hardware_id, sensor.message) == ("H-07", "Stuck, ε 1.00, p 0.97, high (F1)")
    assert {v.key: v.value for v in sensor.values} == {
        "level": "2", "state": "stuck", "row": "sensor stuck", "fault": "F1", "severity": "high", "p": "0.97",
        "epsilon": "1", "epsilon_low": "0.95", "epsilon_high": "1", "evidence": "direct: Stayed at 0.3 m/s. Größe ε.",
        "advice": "Repair it.",
    }  # fmt: skip
    unknown = at[0.0]["front steering sensor"]
    assert {v.key: v.value for v in unknown.values} == {
        "level": "3", "state": "no_data", "reason": "not logged", "evidence": "none"
    }  # fmt: skip
    assert "not logged" in unknown.message


def test_a_size_that_is_not_known_is_left_out(tmp_path: Path) -> None:
    path = written(tmp_path, report([fault(1, "sensor", "stuck", (4.0, 6.125), "high", None)]))
    found = next(m for t, m in by_rosbags(path)["/mfhca/diagnostics"] if t == START + 4 * SECOND)
    assert not any(v.key.startswith("epsilon") for v in found.status[0].values)


def test_a_fault_without_a_majority_has_candidates_and_no_row(tmp_path: Path) -> None:
    unclear = fault(1, "actuator", "stuck", (4.0, 6.125), "high", 0.9)
    rows = [("stuck", 0.45), ("inefficient", 0.4), ("noisy", 0.1)]
    unclear["hypotheses"] = [{"side": "actuator", "mode": mode, "p": p} for mode, p in rows]
    found = by_rosbags(written(tmp_path, report([unclear])))
    status = next(m for t, m in found["/mfhca/diagnostics"] if t == START + 4 * SECOND).status[1]
    assert status.message.startswith("Faulty, kind unclear, ε 0.90")
    values = {v.key: v.value for v in status.values}
    assert (values["state"], values["candidates"], "row" in values) == ("faulty", "stuck, inefficient", False)
    assert "FR drive valve faulty, kind unclear (stuck or inefficient)" in found["/mfhca/events"][1][1].msg


def test_each_second_and_each_change_has_a_message(tmp_path: Path) -> None:
    path = written(tmp_path, report())
    seconds = [(t - START) / SECOND for t, _ in by_rosbags(path)["/mfhca/diagnostics"]]
    assert seconds == sorted({*map(float, range(11)), 2.5, 6.125})


def test_events_tell_the_verdict_and_every_fault(tmp_path: Path) -> None:
    told = by_rosbags(written(tmp_path, report()))["/mfhca/events"]
    assert [((t - START) / SECOND, m.level, m.name) for t, m in told] == [
        (0.0, 40, "mfhca: verdict"),
        (4.0, 40, "mfhca: FR speed sensor stuck"),
        (6.125, 20, "mfhca: FR speed sensor stuck"),
    ]
    assert told[1][1].msg.startswith("F1 begins: FR speed sensor stuck, ε 1.00 (0.95–1.00), p 0.970, severity high.")
    assert told[2][1].msg == "F1 ends: FR speed sensor stuck, after 2.12 s"
    assert [(m.stamp.sec, m.stamp.nanosec) for _, m in told][1] == (1_760_000_004, 250_000_000)


@pytest.mark.parametrize(
    ("stop", "said"),
    [(10.0, "F1 lasts to the end of the log: FR speed sensor stuck, after 6.00 s"),
     (6.125, "F1 was last seen, not seen to end: FR speed sensor stuck, after 2.12 s")],
)  # fmt: skip
def test_a_fault_that_was_not_seen_to_end_keeps_its_level(tmp_path: Path, stop: float, said: str) -> None:
    document = report([fault(1, "sensor", "stuck", (4.0, stop), "high", 1.0)])
    document["states"] = [s for s in document["states"] if s["start_s"] < stop]
    _, _, last = by_rosbags(written(tmp_path, document))["/mfhca/events"]
    assert (last[1].level, last[1].msg) == (40, said)


def test_a_part_of_the_mission_tells_its_own_time_and_the_verdict(tmp_path: Path) -> None:
    part = {"start_ns": START + 5 * SECOND, "stop_ns": START + 7 * SECOND}
    found = by_rosbags(written(tmp_path, report(), **part))
    seconds = [(t - START) / SECOND for t, _ in found["/mfhca/diagnostics"]]
    assert seconds == [5.0, 6.0, 6.125, 7.0]
    assert [(t - START) / SECOND for t, _ in found["/mfhca/events"]] == [5.0, 6.125]


def test_headers_keep_the_mission_s_clock_and_log_stamps_are_the_recorder_s(tmp_path: Path) -> None:
    hour = 3600 * SECOND
    for topic, messages in by_rosbags(written(tmp_path, report(), lambda ns: ns + hour)).items():
        for log_time, m in messages:
            stamp = m.header.stamp if topic == "/mfhca/diagnostics" else m.stamp
            assert log_time - (stamp.sec * SECOND + stamp.nanosec) == hour


def test_hours_are_written_in_order(tmp_path: Path) -> None:
    with written(tmp_path, report(duration=3000.0)).open("rb") as file:
        messages = [m for _, _, m in make_reader(file).iter_messages(["/mfhca/diagnostics"], log_time_order=False)]
    stamps = np.array([m.log_time for m in messages])
    assert stamps.size == 3001 + 2
    assert (np.diff(stamps) > 0).all()


def test_a_course_merges_what_does_not_change() -> None:
    sensor, valve, steering = courses(report())
    assert [len(c.starts) for c in (sensor, valve, steering)] == [4, 3, 1]
    assert sensor.at(START - 5).level is Level.STALE
