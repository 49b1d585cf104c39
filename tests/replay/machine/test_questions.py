"""What a draft of a machine file asks is read back, until its lines are deleted."""

from __future__ import annotations

from pathlib import Path

from replay.machine.questions import questions_of
from replay.machine.toml_file import load_machine

TEXT = """# What is marked QUESTION the log does not tell: check it.
# QUESTION: how large are the wheels? Nothing in the log tells it; 0.1 m radius
# stands in.
# QUESTION: which of these wheels that are named alike is the
# left one? Either may be.
[machine]
name = "robot"
"""


def test_questions_are_read_up_to_their_mark() -> None:
    assert questions_of(TEXT) == (
        "how large are the wheels?",
        "which of these wheels that are named alike is the left one?",
    )
    assert questions_of('[machine]\nname = "QUESTION: none?"\n') == ()


def test_a_machine_has_the_questions_of_its_file(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(TEXT, encoding="utf-8")
    assert load_machine(tmp_path / "m.toml").questions[0] == "how large are the wheels?"
