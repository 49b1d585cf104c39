"""Faults cut out of their mission, with layouts whose curves are really in the clip."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from mcap.reader import make_reader

from diagnosis.clips.write import Clips, chosen_faults, clip_name, write_clips
from diagnosis.pipeline import diagnose, diagnose_mission
from diagnosis.results.result import MissionResult
from replay.errors import OutputError
from replay.log.source_options import SourceOptions
from replay.machine.config import haulotte
from replay.mission import Mission, load_mission
from replay.readers.registry import read_log
from tests.clip_samples import drive, judged, with_log_stamps


def fault(number: int = 1, severity: str = "high", start: float = 1.0, component: str = "FR") -> dict[str, Any]:
    return {
        "id": f"F{number}",
        "component": component,
        "side": "sensor",
        "mode": "stuck",
        "severity": severity,
        "start_s": start,
    }


def cut(mission: tuple[Mission, MissionResult], folder: Path, **options: Any) -> Clips:
    return write_clips(*mission, haulotte(), folder, **options)


def contents(path: Path) -> dict[str, list[int]]:
    """Log stamps by topic."""
    out: dict[str, list[int]] = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            out.setdefault(channel.topic, []).append(message.log_time)
    return out


def test_the_worst_faults_come_first_and_the_rest_is_counted() -> None:
    faults = [fault(1, "low"), fault(2, "high", 9.0), fault(3, "info"), fault(4, "high", 2.0), fault(5, "medium")]
    chosen, left = chosen_faults(faults, 3)
    assert ([f["id"] for f in chosen], left) == (["F4", "F2", "F5"], 1)


@pytest.mark.parametrize("component", ["../../etc", "a/b\\c:d*e?", "\x1b[31m\u202e", "", "." * 300])
def test_names_are_safe(component: str) -> None:
    name = clip_name(fault(component=component))
    assert re.fullmatch(r"F1[\w.+ -]*", name)
    assert len(name) <= 80
    assert Path(name).name == name
    assert name.startswith("F1")


def test_a_clip_holds_the_messages_around_its_fault_and_what_was_replayed(
    mission: tuple[Mission, MissionResult], tmp_path: Path
) -> None:
    clips = cut(mission, tmp_path / "clips", margin_s=2.0)
    assert [p.name for p in clips.paths] == ["F1 FR sensor stuck.mcap"]
    assert (clips.left_out, clips.notes) == (0, ())
    assert len(list((tmp_path / "clips").iterdir())) == 3
    found = contents(clips.paths[0])
    start = mission[1].report["intervals"][0]["start_ns"] - 2 * 10**9
    stop = mission[1].report["intervals"][0]["stop_ns"] + 2 * 10**9
    original = contents(mission[0].files[0].path)
    for topic, stamps in original.items():
        wanted = [t for t in stamps if start <= t < stop]
        assert len(set(wanted) ^ set(found[topic])) <= 2, topic  # header and log stamps differ by less than a step
    assert [found["/mfhca/diagnostics"][k] for k in (0, -1)] == [start, stop]
    assert found["/mfhca/events"] == [start, start + 2 * 10**9, stop - 2 * 10**9]
    for topic in ("/mfhca/mapped_1", "/mfhca/evidence", "/mfhca/v_ref", "/mfhca/u_replayed"):
        assert min(found[topic]) >= start
        assert max(found[topic]) < stop
        assert len(found[topic]) == pytest.approx((stop - start) / 1e7, abs=2)


def test_the_mapped_signals_and_the_loop_are_those_of_the_mission(
    mission: tuple[Mission, MissionResult], tmp_path: Path
) -> None:
    log = read_log(cut(mission, tmp_path).paths[0], SourceOptions())
    speed = mission[0].signals.items["wheel.FR.v"]
    channel = log.channels["/mfhca/mapped_1.position[wheel.FR.v]"]
    rows = np.searchsorted(speed.stamps, channel.stamps)
    assert np.array_equal(speed.stamps[rows], channel.stamps)
    assert np.array_equal(speed.values[rows], channel.values)
    difference = log.channels["/mfhca/u_difference.position[FR]"].values
    assert np.isfinite(difference).mean() > 0.9


def test_a_clip_can_be_diagnosed_again(mission: tuple[Mission, MissionResult], tmp_path: Path) -> None:
    clip = cut(mission, tmp_path).paths[0]
    again = [(f["component"], f["side"], f["mode"]) for f in diagnose([clip], haulotte()).report["intervals"]]
    assert again == [("FR", "sensor", "stuck")]


def test_every_curve_of_the_layouts_is_in_the_clip(mission: tuple[Mission, MissionResult], tmp_path: Path) -> None:
    clip = cut(mission, tmp_path).paths[0]
    channels = read_log(clip, SourceOptions()).channels
    joints: dict[str, list[str]] = {}
    for name in channels:
        if match := re.fullmatch(r"(/mfhca/\w+)\.position\[(.+)\]", name):
            joints.setdefault(match[1], []).append(match[2])
    layout = json.loads((tmp_path / "F1 FR sensor stuck.foxglove.json").read_text(encoding="utf-8"))
    named = []
    for panel in layout["configById"].values():
        for path in panel["paths"]:
            match = re.fullmatch(r"(/mfhca/\w+)\.position\[(\d+)\]", path["value"])
            assert match is not None
            named.append(f"{match[1]}/{joints[match[1]][int(match[2])]}/position")
    root = ElementTree.parse(tmp_path / "F1 FR sensor stuck.plotjuggler.xml").getroot()
    drawn = [curve.attrib["name"] for curve in root.iter("curve")]
    assert drawn == named
    for name in (
        "mapped_1/wheel.FR.v",
        "v_ref/FR",
        "evidence/FR.sensor.residual",
        "u_replayed/FR",
        "mapped_1/wheel.FR.u",
    ):
        assert f"/mfhca/{name}/position" in drawn


def test_logs_of_other_formats_give_signals_and_loop_alone(tmp_path: Path) -> None:
    clips = cut(judged(tmp_path, "csv"), tmp_path / "clips")
    assert all(topic.startswith("/mfhca/") for topic in contents(clips.paths[0]))
    assert "cannot be copied into MCAP" in clips.notes[0]


def test_messages_of_a_rosbag2_recording_in_mcap_are_copied(
    mission: tuple[Mission, MissionResult], tmp_path: Path
) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    (folder / "bag_0.mcap").write_bytes(mission[0].files[0].path.read_bytes())
    again = load_mission([folder], haulotte())
    assert again.files[0].format == "rosbag2"
    clips = cut((again, diagnose_mission(again, haulotte())), tmp_path / "clips")
    plain = cut(mission, tmp_path / "plain")
    assert clips.notes == ()
    assert contents(clips.paths[0]) == contents(plain.paths[0])


def test_of_a_long_mission_the_clips_have_every_step(
    mission: tuple[Mission, MissionResult], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("replay.arrays.envelope.FULL_STEPS", 500)
    monkeypatch.setattr("replay.arrays.envelope._BUCKETS", 500)
    long = diagnose_mission(mission[0], haulotte())
    assert long.columns["t"].size < mission[0].timeline.size
    found = contents(cut((mission[0], long), tmp_path / "long").paths[0])
    plain = contents(cut(mission, tmp_path / "plain").paths[0])
    assert 0 < len(found["/mfhca/evidence"]) < len(plain["/mfhca/evidence"])
    assert found["/mfhca/u_replayed"] == plain["/mfhca/u_replayed"]


def test_a_long_fault_is_cut_to_its_beginning(
    mission: tuple[Mission, MissionResult], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("diagnosis.clips.write._LONGEST_NS", 10**9)
    clips = cut(mission, tmp_path, margin_s=0.5)
    stamps = contents(clips.paths[0])["/mfhca/mapped_1"]
    assert (stamps[-1] - stamps[0]) * 1e-9 == pytest.approx(2.0, abs=0.03)
    assert clips.notes == ("F1: lasts 4 s; its clip holds the first 1 s.",)


def test_clips_of_injected_faults_say_so(mission: tuple[Mission, MissionResult], tmp_path: Path) -> None:
    marked = replace(
        mission[0],
        signals=replace(mission[0].signals, open_loop=True),
        timeline=replace(mission[0].timeline, open_loop=True),
    )
    clip = cut((marked, mission[1]), tmp_path).paths[0]
    assert load_mission([clip], haulotte()).open_loop


def test_own_clips_are_replaced_and_others_left_alone(mission: tuple[Mission, MissionResult], tmp_path: Path) -> None:
    first = cut(mission, tmp_path)
    before = first.paths[0].read_bytes()
    first.paths[0].rename(tmp_path / "F9 RL sensor noisy.mcap")
    (tmp_path / "mine.mcap").write_bytes(b"mine")
    second = cut(mission, tmp_path)
    assert second.paths[0].read_bytes() == before
    assert not (tmp_path / "F9 RL sensor noisy.mcap").exists()
    assert (tmp_path / "mine.mcap").read_bytes() == b"mine"


def test_a_foreign_file_is_never_replaced(mission: tuple[Mission, MissionResult], tmp_path: Path) -> None:
    foreign = tmp_path / "F1 FR sensor stuck.foxglove.json"
    foreign.write_text("{}")
    with pytest.raises(OutputError, match="is not a clip of this tool"):
        cut(mission, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == [foreign.name]
    assert foreign.read_text() == "{}"


def test_a_mission_without_faults_has_no_clips(mission: tuple[Mission, MissionResult], tmp_path: Path) -> None:
    calm = replace(mission[1], report={**mission[1].report, "intervals": []})
    assert write_clips(mission[0], calm, haulotte(), tmp_path / "clips") == Clips((), 0, ())
    assert not (tmp_path / "clips").exists()


def test_log_stamps_of_another_clock_are_followed(tmp_path: Path) -> None:
    """A recorder an hour ahead of the headers: messages are found by their headers, and all stands on its clock."""
    hour = 3600 * 10**9
    later = tmp_path / "later.mcap"
    with_log_stamps(drive(tmp_path), later, lambda ns: ns + hour)
    mission = load_mission([later], haulotte())
    clips = cut((mission, diagnose_mission(mission, haulotte())), tmp_path / "clips", margin_s=1.0)
    found = contents(clips.paths[0])
    moments = [t for stamps in found.values() for t in stamps]
    assert (max(moments) - min(moments)) * 1e-9 == pytest.approx(6.0, abs=0.1)
    assert len(found["/joint_states"]) == pytest.approx(600, abs=3)
    assert "from the mission's clock" in clips.notes[0]
