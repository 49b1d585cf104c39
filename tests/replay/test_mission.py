"""From files to one timeline."""

from __future__ import annotations

import dataclasses
import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from replay.errors import LogError
from replay.log.content_hash import content_hash
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.config import haulotte
from replay.mission import load_mission, read_signals, source_options
from replay.progress import Progress, Stage

START = 1_760_000_000_000_000_000


def write_table(path: Path, name: str, values: np.ndarray, step_ns: int = 10_000_000, start: int = START) -> Path:
    rows = "".join(f"{start + i * step_ns},{v!r}\n" for i, v in enumerate(values.tolist()))
    path.write_text(f"time_ns,{name}\n{rows}")
    return path


def test_a_file_whose_clock_is_unknown_is_left_out(tmp_path: Path) -> None:
    a = write_table(tmp_path / "a.csv", "wheel.FR.v", np.linspace(0.0, 0.3, 200))
    b = write_table(tmp_path / "b.csv", "wheel.FR.u", np.linspace(0.0, 0.2, 100), step_ns=20_000_000)
    mission = load_mission([a, b], haulotte())
    assert list(mission.timeline.signals) == ["wheel.FR.v"]
    assert [f.left_out for f in mission.files] == [False, True]
    assert "b.csv was left out: its clock could not be compared with a.csv" in mission.files[1].summary.damage[0]
    assert mission.signals.missing["wheel.FR.u"] == "b.csv was left out"


def test_two_files_become_one_mission(tmp_path: Path) -> None:
    speed, command = np.linspace(0.0, 0.3, 200), np.linspace(0.0, 0.2, 100)
    a = write_table(tmp_path / "a.csv", "wheel.FR.v", speed)
    b = write_table(tmp_path / "b.csv", "wheel.FR.u", command, step_ns=20_000_000)
    published: list[Progress] = []
    machine = dataclasses.replace(haulotte(), sources={"b.csv": SourceOptions(clock="as recorded")})
    mission = load_mission([a, b], machine, progress=published.append)
    assert [(f.path, f.format, f.bytes) for f in mission.files] == [
        (a, "csv", a.stat().st_size),
        (b, "csv", b.stat().st_size),
    ]
    assert mission.files[0].sha256 == hashlib.sha256(a.read_bytes()).hexdigest()
    assert (mission.timeline.start_ns, mission.timeline.step_ns, mission.timeline.size) == (START, 10_000_000, 200)
    np.testing.assert_allclose(mission.timeline.signals["wheel.FR.v"], speed)
    assert mission.timeline.sources == {"wheel.FR.v": str(a), "wheel.FR.u": str(b)}
    assert Progress(Stage.READING, "a.csv") in published
    assert Progress(Stage.READING, "b.csv") in published


def test_a_part_of_a_mission(tmp_path: Path) -> None:
    log = write_table(tmp_path / "a.csv", "wheel.FR.v", np.arange(200.0) / 1000)
    timeline = load_mission([log], haulotte(), start_s=0.5, stop_s=1.0).timeline
    assert timeline.start_ns == START + 500_000_000
    np.testing.assert_allclose(timeline.signals["wheel.FR.v"], np.arange(50, 101) / 1000)


def test_without_wheels_the_error_names_the_file(tmp_path: Path) -> None:
    log = write_table(tmp_path / "a.csv", "oil_level", np.arange(200.0))
    _, signals = read_signals([log], haulotte())
    assert "wheel.FR.v" in signals.missing
    with pytest.raises(LogError, match=r"a\.csv: no wheel signal"):
        load_mission([log], haulotte())


def test_a_machine_file_for_another_format_is_told_from_a_log_without_wheels(tmp_path: Path) -> None:
    log = write_table(tmp_path / "a.csv", "wheel.FR.v", np.arange(200.0))
    topic = SignalSource(topic="/joint_states", field="velocity[FR]", unit="rad/s")
    machine = replace(haulotte(), signals={"wheel.FR.v": topic})
    with pytest.raises(
        LogError, match=r"a\.csv: no wheel signal: wheel\.FR\.v: the machine file names .* leave \[signals\] out"
    ):
        load_mission([log], machine)


def test_a_slow_table_that_holds_nothing_of_a_machine_is_no_log(tmp_path: Path) -> None:
    log = tmp_path / "oil.csv"
    log.write_text("date,iron_ppm\n2026-10-04,12\n2026-10-11,13\n2026-10-18,15\n")
    with pytest.raises(LogError, match=r"oil\.csv: no log of a machine: no column .*iron_ppm"):
        load_mission([log], haulotte())


def test_a_list_without_times_is_no_log(tmp_path: Path) -> None:
    log = tmp_path / "inventory.csv"
    log.write_text("number;name;stock\n4711;filter;3\n4712;spool;1\n")
    with pytest.raises(LogError, match=r"inventory\.csv: no log of a machine: no column .*stock.* fewer than 20 rows"):
        load_mission([log], haulotte())


def test_files_of_different_days_are_refused(tmp_path: Path) -> None:
    a = write_table(tmp_path / "a.csv", "wheel.FR.v", np.arange(200.0) / 1000)
    b = write_table(tmp_path / "b.csv", "wheel.FR.u", np.arange(200.0) / 1000, start=START + 86_400 * 10**9)
    with pytest.raises(LogError, match="do not overlap in time"):
        load_mission([a, b], haulotte())


def test_the_first_fitting_pattern_gives_the_options() -> None:
    first, second = SourceOptions(separator=";"), SourceOptions(separator=",")
    machine = dataclasses.replace(haulotte(), sources={"plc*.csv": first, "*.csv": second})
    assert source_options(Path("deep/plc-1.csv"), machine) is first
    assert source_options(Path("other.csv"), machine) is second
    assert source_options(Path("drive.mcap"), machine) == SourceOptions()


def test_options_of_a_source_are_used(tmp_path: Path) -> None:
    log = tmp_path / "plc.csv"
    log.write_text("tick,wheel.FR.v\n" + "".join(f"{i * 10},{i / 1000}\n" for i in range(100)))
    options = SourceOptions(time="tick", time_unit="ms", epoch="2025-10-09T08:53:20")
    machine = dataclasses.replace(haulotte(), sources={"plc.csv": options})
    timeline = load_mission([log], machine).timeline
    assert (timeline.start_ns, timeline.step_ns) == (START, 10_000_000)


def test_the_hash_of_a_folder_knows_names_contents_and_their_borders(tmp_path: Path) -> None:
    def folder(name: str, **files: str) -> Path:
        (tmp_path / name / "sub").mkdir(parents=True)
        for key, text in files.items():
            (tmp_path / name / "sub" / key).write_text(text)
        return tmp_path / name

    one = content_hash(folder("one", a="12", b="3"))
    assert one == content_hash(folder("same", b="3", a="12"))
    assert one[1] == 3
    others = [folder("two", a="1", b="23"), folder("three", a="12", c="3"), folder("four", a="12")]
    assert len({one[0], *(content_hash(f)[0] for f in others)}) == 4


def test_the_hash_of_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="cannot be read"):
        content_hash(tmp_path / "absent")
