"""Which machine file each mission of an audit gets."""

from __future__ import annotations

from pathlib import Path

import pytest

from diagnosis.audit.discovery.discover import discover
from diagnosis.audit.plan import AuditOptions, machine_notes, plan
from diagnosis.results.document import PAPER_DEFAULTS


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A log with a ``machine.toml`` beside it, one whose ``mission.toml`` names a machine file, and one with neither."""
    logs = tmp_path / "logs"
    for place in ("AX", "BX", "CX"):
        (logs / place).mkdir(parents=True)
        (logs / place / "m.mcap").write_bytes(b"")
    (logs / "AX/machine.toml").write_text('[machine]\nname = "A"\n')
    (logs / "BX/own.toml").write_text('[machine]\nname = "B"\n')
    (logs / "BX/mission.toml").write_text('machine = "own.toml"\n')
    (tmp_path / "given.toml").write_text('[machine]\nname = "given"\n')
    return logs


def names(tree: Path, machine: Path | None) -> dict[str, str]:
    found = discover([str(tree)]).missions
    return {one.mission.name: one.machine.name for one in plan(found, AuditOptions(tree / "out", machine))}


def test_each_mission_has_its_own_machine_file(tree: Path) -> None:
    planned = plan(discover([str(tree)]).missions, AuditOptions(tree / "out"))
    assert {one.mission.name: one.source for one in planned} == {
        "AX__m": "machine.toml",
        "BX": "own.toml",
        "CX__m": PAPER_DEFAULTS,
    }
    (tree / "machine.toml").write_text('[machine]\nname = "rest"\n')
    assert names(tree, None) == {"AX__m": "A", "BX": "B", "CX__m": "rest"}


def test_the_given_machine_file_counts_for_all_and_says_what_it_overrides(tree: Path) -> None:
    given = tree.parent / "given.toml"
    assert names(tree, given) == dict.fromkeys(("AX__m", "BX", "CX__m"), "given")
    found = discover([str(tree)]).missions
    (note,) = machine_notes(found, AuditOptions(tree / "out", given))
    assert note.startswith(f"-m {given} counts also for 2 of 3 missions, which have another machine file beside them: ")
    assert str(tree / "AX/machine.toml") in note
    assert str(tree / "BX/own.toml") in note
    assert machine_notes(found, AuditOptions(tree / "out")) == ()
    one = [m for m in found if m.name == "AX__m"]
    assert machine_notes(one, AuditOptions(tree / "out", tree / "AX/machine.toml")) == ()


def test_an_id_in_the_machine_files_of_several_folders_is_said_to_make_them_one_machine(tree: Path) -> None:
    for place in ("AX", "CX"):
        (tree / place / "machine.toml").write_text('[machine]\nid = "sample"\n')
    found = discover([str(tree)]).missions
    (note,) = machine_notes(found, AuditOptions(tree / "out"))
    assert "the id 'sample' makes one machine of the logs of 2 folders (AX, CX)" in note
    assert str(tree / "CX/machine.toml") in note
    assert machine_notes(found, AuditOptions(tree / "out", machine_id="all of one")) == ()
    assert machine_notes([m for m in found if m.name != "CX__m"], AuditOptions(tree / "out")) == ()


def test_drafted_machine_files_with_open_questions_are_named(tree: Path) -> None:
    found = discover([str(tree)]).missions
    asked = AuditOptions(tree / "out")
    draft = tree / "AX/machine.toml"
    answered = draft.read_text()
    draft.write_text(f"# QUESTION: is the track 1.5 m?\n{answered}")
    (note,) = machine_notes(found, asked)
    assert note.startswith(f"{draft}: drafted, with comments marked QUESTION; answer and remove them")
    assert machine_notes(found, AuditOptions(tree / "out", draft))[-1] == note
    draft.write_text(answered)
    assert machine_notes(found, asked) == ()
