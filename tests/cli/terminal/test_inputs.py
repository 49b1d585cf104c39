"""Words of the command line become paths, wheels and times."""

from __future__ import annotations

import io
import os
from pathlib import Path

import pytest

from cli.terminal.inputs import check_output, check_times, check_wheels, find_logs, machine_of, mission_paths
from replay.errors import ConfigError, LogError
from replay.machine.config import haulotte


def make(folder: Path, *names: str) -> None:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x")


def test_a_folder_gives_its_logs_sorted_and_counts_the_rest(tmp_path: Path) -> None:
    make(tmp_path, "b.mcap", "a.bag", "notes.md", "deep/c.CSV", "rec/metadata.yaml", "rec/rec_0.db3", ".x/d.mcap")
    found = find_logs([str(tmp_path)])
    assert [p.relative_to(tmp_path).as_posix() for p in found.paths] == ["a.bag", "b.mcap", "deep/c.CSV", "rec"]
    assert (found.left_aside, found.missing) == (1, [])


def test_a_saved_result_is_no_log(tmp_path: Path) -> None:
    make(tmp_path, "m-report/report.json", "m-report/report.parquet", "plain/report.parquet")
    assert [p.parent.name for p in find_logs([str(tmp_path)]).paths] == ["plain"]


def test_globs_stdin_and_repetitions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make(tmp_path, "a.mcap", "sub/b.mcap", "c [1].mcap")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO("sub/b.mcap\n\nc [1].mcap\n"))
    found = find_logs(["**/*.mcap", "a.mcap", "-"])
    assert sorted(p.as_posix() for p in found.paths) == ["a.mcap", "c [1].mcap", "sub/b.mcap"]


def test_nothing_found_is_said(tmp_path: Path) -> None:
    make(tmp_path, "empty/readme.md")
    found = find_logs([str(tmp_path / "no.mcap"), str(tmp_path / "*.bag"), str(tmp_path / "empty")])
    assert found.paths == []
    assert [m.partition(": ")[2][:13] for m in found.missing] == ["no such file", "matches no fi", "holds no log "]


def test_links_to_folders_are_not_followed(tmp_path: Path) -> None:
    make(tmp_path, "logs/a.mcap")
    (tmp_path / "logs" / "loop").symlink_to(tmp_path / "logs", target_is_directory=True)
    assert [p.name for p in find_logs([str(tmp_path / "logs")]).paths] == ["a.mcap"]


def test_files_of_one_mission(tmp_path: Path) -> None:
    make(tmp_path, "a.mcap", "b.csv")
    paths = [tmp_path / "a.mcap", tmp_path / "b.csv"]
    assert mission_paths(paths) == paths
    with pytest.raises(ConfigError, match="given twice"):
        mission_paths([paths[0], tmp_path / "." / "a.mcap"])
    with pytest.raises(LogError, match=r"no\.mcap: no such file"):
        mission_paths([tmp_path / "no.mcap"])


def test_a_folder_of_separate_logs_is_no_mission(tmp_path: Path) -> None:
    make(tmp_path, "many/monday.mcap", "many/tuesday.mcap", "split/r_0.mcap", "split/r_1.mcap")
    make(tmp_path, "rec/metadata.yaml", "rec/a.db3", "rec/b.db3")
    assert mission_paths([tmp_path / "split", tmp_path / "rec"])
    with pytest.raises(LogError, match="folder of 2 logs"):
        mission_paths([tmp_path / "many"])


@pytest.mark.parametrize(
    ("start", "end"), [(-1.0, None), (float("nan"), None), (None, float("inf")), (5.0, 5.0), (5.0, 2.0)]
)
def test_impossible_times(start: float | None, end: float | None) -> None:
    with pytest.raises(ConfigError, match="--"):
        check_times(start, end)


def test_possible_times() -> None:
    check_times(None, None)
    check_times(0.0, 1.0)


def test_wheels_in_any_spelling_and_order() -> None:
    machine = haulotte()
    assert check_wheels(["rl", "FR"], machine) == ("FR", "RL")
    assert check_wheels(None, machine) is None
    with pytest.raises(ConfigError, match="FR, FL, RR, RL"):
        check_wheels(["left"], machine)


def test_machine_and_its_name(tmp_path: Path) -> None:
    file = tmp_path / "crane.toml"
    file.write_text('[machine]\nname = "Crane"\n')
    machine, source = machine_of(file)
    assert (machine.name, source) == ("Crane", "crane.toml")
    assert machine_of(None)[1] == "paper defaults"


def test_results_never_replace_a_log_or_stand_in_a_recording(tmp_path: Path) -> None:
    make(tmp_path, "a.mcap", "rec/metadata.yaml")
    check_output(
        [tmp_path / "b.mcap", tmp_path / "rec-report" / "report.html"], [tmp_path / "a.mcap", tmp_path / "rec"]
    )
    for output in ("a.mcap", "x/../a.mcap", "rec/report/report.html"):
        with pytest.raises(ConfigError, match="would be changed"):
            check_output([tmp_path / output], [tmp_path / "a.mcap", tmp_path / "rec"])


def test_a_pipe_is_no_file_of_a_mission(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.mcap")
    with pytest.raises(LogError, match="is not a regular file"):
        mission_paths([tmp_path / "a.mcap"])
