"""What is the same of many signals is told once, with the range of its numbers."""

from __future__ import annotations

from diagnosis.decision.alike_notes import alike_notes


def _back(signal: str, times: str) -> str:
    return f"{signal}: stamps ran backwards {times} and were sorted"


def test_one_note_of_many_signals() -> None:
    notes = [
        _back("cmd.v", "once"),
        "Another note.",
        *(_back(f"wheel.{w}.v", f"{k} times") for k, w in enumerate(("FR", "FL", "RR"), 2)),
    ]
    assert alike_notes(notes) == [
        "4 signals (cmd.v, wheel.FR.v, wheel.FL.v, …): stamps ran backwards 1 to 4 times and were sorted",
        "Another note.",
    ]


def test_few_signals_and_notes_that_differ_in_words_stay() -> None:
    notes = [_back("cmd.v", "once"), _back("cmd.omega", "2 times"), "wheel.FR.v: a unit", "wheel.FL.v: a scale"]
    assert alike_notes([*notes, notes[0]]) == notes


def test_numbers_that_are_alike_keep_their_form() -> None:
    notes = [f"wheel.W{k}.v: its clock ticks every 0.10 ms only" for k in range(5)]
    assert alike_notes(notes)[0].endswith("its clock ticks every 0.10 ms only")


def test_a_number_in_a_name_is_no_number() -> None:
    notes = [f"wheel.W{k}.v: GVL.aWheel[{k}].fSpeed and v{k} stop at {k}.5 s" for k in range(1, 6)]
    assert alike_notes(notes) == notes
