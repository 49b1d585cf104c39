"""Drive models in machine files."""

from __future__ import annotations

from pathlib import Path

import pytest

from replay.errors import ConfigError
from replay.machine.config import Machine
from replay.machine.drive_model import DriveModel, EffortMap, InverseController
from replay.machine.toml_file import load_machine
from replay.machine.toml_text import dump_machine

ECHO = InverseController((0.1, -20.0, 1 / 3), 0, 1.2, 0.05, 0.01, 3.4, 0.63, 0.27, 0.016)
EFFORT = EffortMap(6.3, 0.07, 1.1, 0.06, 0.17, 100.0, 300.0)


def load(folder: Path, text: str) -> Machine:
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return load_machine(path)


@pytest.mark.parametrize("model", [DriveModel(ECHO, EFFORT), DriveModel(echo=ECHO), DriveModel(effort=EFFORT)])
def test_round_trip(tmp_path: Path, model: DriveModel) -> None:
    machine = Machine("rig", "", ("M 1",), None, drives={"M 1": model})
    assert load(tmp_path, dump_machine(machine)) == machine


def test_without_drives_nothing_is_written() -> None:
    assert "[drive]" not in dump_machine(Machine("rig", "", ("M",), None))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Q = { }", "no wheel 'Q'|'Q': no such wheel"),
        ("M = { echoes = { } }", r"drive\.M\.echoes is not known; expected echo or effort"),
        ("M = { effort = 3 }", r"drive\.M\.effort = 3 is no table"),
        ("M = { effort = { offset = 1.0 } }", r"drive\.M\.effort\.slope is missing; run `mfhca fit` again"),
        ("M = { effort = { ofset = 1.0 } }", r"drive\.M\.effort\.ofset is not known; expected offset"),
        (
            'M = { effort = { offset = "1", slope = 1, between = 1, drift = 1, noise = 1 } }',
            r"drive\.M\.effort\.offset = '1'; expected a finite number",
        ),
        (
            "M = { effort = { offset = 1, slope = 1, between = -1, drift = 1, noise = 1, slowest = 1, fastest = 2 } }",
            r"drive\.between",
        ),
        (
            "M = { echo = { gains = 3, first = 0, memory_s = 1, memory_std_s = 0, setpoint = 0, noise = 1, exact = 1, core = 1, step_s = 1 } }",
            r"drive\.M\.echo\.gains = 3; expected a list of finite numbers",
        ),
        (
            "M = { echo = { gains = [3], first = 0.5, memory_s = 1, memory_std_s = 0, setpoint = 0, noise = 1, exact = 1, core = 1, step_s = 1 } }",
            r"drive\.M\.echo\.first = 0\.5; expected a whole number of steps",
        ),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        load(tmp_path, f'[machine]\nwheels = ["M"]\n[drive]\n{text}\n')
