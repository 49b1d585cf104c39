"""Tables of constants in machine files: every field, finite numbers, and a clear sentence where that is not so."""

from __future__ import annotations

from pathlib import Path

import pytest

from replay.errors import ConfigError
from replay.machine.effort_model import EffortModel, effort_from_table, effort_table
from replay.machine.toml_file import load_machine

MODEL = EffortModel(0.0, 1.0, 2.0, 3.0, 0.0, 0.0, 4.0, (0.1, 0.2, 0.3), 1.0, 0.5, 0.1, 3.0)


def test_a_table_is_what_it_was_written_from() -> None:
    assert effort_from_table("effort.FR", effort_table(MODEL)) == MODEL


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"friction": float("nan")}, "effort.FR.friction = nan; expected a finite number"),
        ({"off": [0.1, float("inf"), 0.3]}, "expected a list of finite numbers"),
        ({"off": 0.1}, "expected a list of finite numbers"),
        ({"inertia": True}, "expected a finite number"),
        ({"more": 1.0}, "effort.FR.more is not known"),
    ],
)
def test_what_is_no_finite_number_is_refused(change: dict[str, object], says: str) -> None:
    with pytest.raises(ConfigError, match=says.replace("[", r"\[")):
        effort_from_table("effort.FR", {**effort_table(MODEL), **change})


def test_a_field_that_is_missing_is_named(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text('[machine]\nname = "m"\n[effort.FR]\noffset = 0.0\n')
    with pytest.raises(ConfigError, match=r"effort\.FR\.friction is missing; run `mfhca fit` again"):
        load_machine(path)
