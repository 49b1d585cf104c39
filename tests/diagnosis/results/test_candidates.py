"""What a fault may be called, before and behind the rounding of a document."""

from __future__ import annotations

from diagnosis.results.candidates import candidates

HALF = (
    ("actuator", "inefficient", 0.5),
    ("actuator", "outside_table", 0.4),
    ("actuator", "noisy", 0.1 - 2 * 0.002068296808),
    ("actuator", "stuck", 0.002068296808),
    ("actuator", "no_signal", 0.002068296808),
)


def test_a_document_that_rounds_calls_a_fault_what_its_sentence_calls_it() -> None:
    rounded = [(side, mode, float(f"{p:.9g}")) for side, mode, p in HALF]
    assert sum(p for *_, p in rounded) != sum(p for *_, p in HALF)
    assert candidates("actuator", HALF) == candidates("actuator", rounded) == ()


def test_a_row_that_lacks_half_by_more_than_that_gives_no_name() -> None:
    less = (("actuator", "inefficient", 0.49), *HALF[1:])
    assert candidates("actuator", less) == ("inefficient", "outside_table")
