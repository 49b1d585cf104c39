"""Wheels without a drive in a machine file: read back as written, with no signals of a drive, and every contradiction named."""

from __future__ import annotations

from pathlib import Path

import pytest

from replay.errors import ConfigError
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.machine.toml_text import dump_machine
from replay.machine.unpowered import drive_in_log, is_contradicted

TRUCK = """
[machine]
wheels = ["FR", "FL", "RR", "RL"]
unpowered = ["RR", "RL"]
"""


def load(folder: Path, text: str) -> Machine:
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return load_machine(path)


def test_it_is_read_back_as_it_is_written(tmp_path: Path) -> None:
    machine = load(tmp_path, TRUCK)
    assert machine.unpowered == ("RR", "RL")
    assert machine.driven == ("FR", "FL")
    assert load(tmp_path, dump_machine(machine)) == machine
    assert "unpowered" not in dump_machine(load(tmp_path, ""))


def test_it_has_speeds_and_nothing_of_a_drive(tmp_path: Path) -> None:
    names = load(tmp_path, TRUCK).canonical_signals()
    assert [n for n in names if n.startswith("wheel.RR.")] == [
        "wheel.RR.v_ref", "wheel.RR.v", "wheel.RR.v_true", "wheel.RR.v_position",
    ]  # fmt: skip
    assert "wheel.FR.u" in names


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('[signals]\n"wheel.RR.u" = { column = "u" }', "machine.unpowered says that RR has none"),
        ("[plant]\nRR = { K = 2.0, tau = 0.2 }", "[plant] 'RR' is the model of a drive"),
    ],
)
def test_what_names_a_drive_of_it_contradicts_it(tmp_path: Path, more: str, said: str) -> None:
    with pytest.raises(ConfigError) as error:
        load(tmp_path, TRUCK + more)
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ('["XX"]', "no wheel 'XX'"),
        ('["FR", "FL", "RR", "RL"]', "leaves no wheel with a drive"),
        ('"RR"', 'must be a list of wheels that have no drive, such as ["RR", "RL"]'),
        ("[1]", "must be a list"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, value: str, said: str) -> None:
    with pytest.raises(ConfigError) as error:
        load(tmp_path, TRUCK.replace('["RR", "RL"]', value))
    assert said in str(error.value)


def test_a_log_with_what_drives_it_is_told() -> None:
    found = {"wheel.RR.u": "u_RR", "wheel.RR.u_applied": "pos_RR", "wheel.FR.u": "u_FR", "wheel.RL.v": "v_RL"}
    (note,) = drive_in_log(found, ("RR", "RL"))
    assert (
        note
        == "RR by machine.unpowered has no drive, and the log has what would be its drive's (u_RR): correct the machine file"
    )
    assert is_contradicted(note)
    assert drive_in_log(found, ()) == ()
