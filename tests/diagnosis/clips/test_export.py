"""A whole diagnosis as one MCAP file: beside its log on the recorder's clock, also under simulation time."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from diagnosis.clips.export import Contents, check_same_mission, is_own, write_export
from diagnosis.pipeline import diagnose_mission
from diagnosis.results.result import MissionResult
from diagnosis.ros.statuses import courses
from replay.errors import LogError, OutputError
from replay.log.source_options import SourceOptions
from replay.machine.config import haulotte
from replay.mission import Mission, load_mission
from replay.readers.registry import read_log
from tests.clip_samples import drive, judged, with_log_stamps

Diagnosed = tuple[Mission, MissionResult]


def decoded(path: Path) -> dict[str, list[tuple[int, object]]]:
    out: dict[str, list[tuple[int, object]]] = {}
    with path.open("rb") as file:
        for d in make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            out.setdefault(d.channel.topic, []).append((d.message.log_time, d.decoded_message))
    return out


def test_the_file_holds_diagnosis_loop_and_log_as_asked(mission: Diagnosed, tmp_path: Path) -> None:
    path = tmp_path / "all.mcap"
    done = write_export(path, mission[0], mission[1].report, haulotte(), Contents(loop=True, log=True))
    found, own = decoded(path), decoded(mission[0].files[0].path)
    assert done.messages == sum(map(len, found.values()))
    assert done.notes == ()
    assert {t: [ns for ns, _ in m] for t, m in found.items() if t in own} == {
        t: [ns for ns, _ in m] for t, m in own.items()
    }
    assert {"/mfhca/diagnostics", "/mfhca/events", "/mfhca/u_replayed"} <= set(found)
    write_export(path, mission[0], mission[1].report, haulotte(), Contents())
    assert set(decoded(path)) == {"/mfhca/diagnostics", "/mfhca/events"}
    assert is_own(path)


def test_under_simulation_time_events_stand_beside_the_messages_of_their_moment(tmp_path: Path) -> None:
    """Headers count from 5 s on, the recorder's clock says 2025 and runs slower by a tenth."""
    wall = 1_760_000_000 * 10**9
    later = tmp_path / "later.mcap"
    with_log_stamps(drive(tmp_path, start_ns=5 * 10**9), later, lambda ns: wall + ns * 10 // 9)
    mission = load_mission([later], haulotte())
    result = diagnose_mission(mission, haulotte())
    done = write_export(tmp_path / "r.mcap", mission, result.report, haulotte(), Contents())
    assert "their headers keep the mission's" in done.notes[0]
    found = decoded(tmp_path / "r.mcap")
    begins = next((t, m) for t, m in found["/mfhca/events"] if "begins" in m.msg)  # type: ignore[attr-defined]
    stamp = begins[1].stamp.sec * 10**9 + begins[1].stamp.nanosec  # type: ignore[attr-defined]
    assert stamp == pytest.approx(13 * 10**9, abs=10**8)
    for messages in found.values():
        for log_time, m in messages:
            stamp = m.header.stamp if hasattr(m, "header") else m.stamp  # type: ignore[attr-defined]
            assert log_time == pytest.approx(wall + (stamp.sec * 10**9 + stamp.nanosec) * 10 / 9, abs=2e7)


def test_without_an_mcap_log_the_mission_s_clock_stands_in(tmp_path: Path) -> None:
    mission, result = judged(tmp_path, "csv")
    done = write_export(tmp_path / "r.mcap", mission, result.report, haulotte(), Contents(log=True))
    assert "No MCAP log" in done.notes[0]
    assert "only those of MCAP" in done.notes[1]
    first = min(t for t, _ in decoded(tmp_path / "r.mcap")["/mfhca/events"])
    assert first == result.report["log"]["start_ns"]


def test_the_tool_reads_the_file_beside_its_log(mission: Diagnosed, tmp_path: Path) -> None:
    path = tmp_path / "all.mcap"
    write_export(path, mission[0], mission[1].report, haulotte(), Contents(log=True))
    again = diagnose_mission(load_mission([path], haulotte()), haulotte()).report
    assert [f["component"] for f in again["intervals"]] == ["FR"]
    assert "/mfhca/events" in {t.name for t in read_log(path, SourceOptions()).summary.topics}


def test_every_path_of_the_layouts_is_in_the_file(mission: Diagnosed, tmp_path: Path) -> None:
    done = write_export(tmp_path / "r.mcap", mission[0], mission[1].report, haulotte(), Contents())
    assert [p.name for p in done.paths] == ["r.mcap", "r.foxglove.json", "r.plotjuggler.xml"]
    found = decoded(done.paths[0])
    status = found["/mfhca/diagnostics"][0][1].status  # type: ignore[attr-defined]
    layout = json.loads(done.paths[1].read_text(encoding="utf-8"))
    panels = layout["configById"]
    shown = panels["StateTransitions!mfhca"]["paths"]
    assert [p["value"] for p in shown] == [f"/mfhca/diagnostics.status[{i}].message" for i in range(len(status))]
    assert [p["label"] for p in shown] == [s.name for s in status] == [c.name for c in courses(mission[1].report)]
    assert panels["DiagnosticSummary!mfhca"]["topicToRender"] in found
    assert panels["RosOut!mfhca"]["topicToRender"] in found

    def leaves(node: object) -> list[str]:
        return [node] if isinstance(node, str) else leaves(node["first"]) + leaves(node["second"])  # type: ignore[index]

    assert sorted(leaves(layout["layout"])) == sorted(panels)
    names = {
        f"/mfhca/diagnostics/{s.hardware_id}/{s.name}/{v.key}"
        for _, m in found["/mfhca/diagnostics"]
        for s in m.status  # type: ignore[attr-defined]
        for v in s.values
    }
    root = ElementTree.parse(done.paths[2]).getroot()
    drawn = {c.attrib["name"] for c in root.iter("curve")}
    assert drawn <= names  # PlotJuggler asks about a curve that is not there
    assert {n.rpartition("/")[2] for n in drawn} == {"level", "epsilon", "p"}
    assert any(n.endswith("FR speed sensor/epsilon") for n in drawn)


def test_a_result_of_other_logs_is_refused(mission: Diagnosed) -> None:
    files = [{**f, "sha256": "0" * 64} for f in mission[1].report["log"]["files"]]
    other = {**mission[1].report, "log": {**mission[1].report["log"], "files": files}}
    with pytest.raises(LogError, match="is not a log of monday-report"):
        check_same_mission(other, mission[0], "monday-report")  # type: ignore[arg-type]
    check_same_mission(mission[1].report, mission[0], "monday-report")


def test_a_clock_beyond_ros_is_refused(mission: Diagnosed, tmp_path: Path) -> None:
    log = {**mission[1].report["log"], "start_ns": 2**32 * 10**9}
    result = replace(mission[1], report={**mission[1].report, "log": log})  # type: ignore[typeddict-item]
    with pytest.raises(OutputError, match="1970 to 2106"):
        write_export(tmp_path / "r.mcap", mission[0], result.report, haulotte(), Contents())
    assert list(tmp_path.iterdir()) == []
