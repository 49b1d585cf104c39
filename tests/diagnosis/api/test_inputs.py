"""What was asked becomes paths, wheels and times, or a clear sentence."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from diagnosis.api.inputs import check_output, check_times, check_wheels, machine_of, mission_paths
from replay.errors import ConfigError, LogError
from replay.machine.config import haulotte


def make(folder: Path, *names: str) -> None:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x")


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
