"""A fault is resolved only by a later, whole mission in which it would have shown; what is unclear is of any row that it may be."""

from __future__ import annotations

from typing import Any

import pytest

from tests.diagnosis.comparison.test_compare import compared, fault, later, only, report


def shown(mode: str, for_s: float | None, size: float | None, share: float | None, places: int = 20) -> dict[str, Any]:
    row = {"component": "FR", "side": "sensor", "deviation": mode, "for_s": for_s, "size": size, "unit": "1"}
    return row | {"share": share, "places": places, "told": "sensor"}


def after(*rows: dict[str, Any]) -> dict[str, Any]:
    return later() | {"detectability": {"rows": list(rows), "traces": []}}


@pytest.mark.parametrize(
    ("mode", "rows", "status"),
    [
        ("stuck", [], "resolved"),  # an older report does not say
        ("stuck", [shown("stuck", 2.0, 1.0, 0.9), shown("stuck", 10.0, 1.0, 1.0)], "resolved"),
        ("stuck", [shown("stuck", 2.0, None, 0.2), shown("stuck", 10.0, 1.0, 1.0)], "not_seen_again"),
        ("stuck", [shown("stuck", 2.0, None, None, 0)], "not_seen_again"),
        ("stuck", [shown("inefficient", 2.0, None, 0.0)], "resolved"),
        ("inefficient", [shown("inefficient", 2.0, 0.3, 0.0)], "resolved"),  # of .5
        ("inefficient", [shown("inefficient", 2.0, 0.8, 0.1)], "not_seen_again"),
        ("noisy", [shown("noisy", 2.0, 0.04, None)], "resolved"),
        ("noisy", [shown("noisy", 2.0, None, None)], "not_seen_again"),
    ],
)
def test_what_the_newer_mission_would_have_missed_is_not_resolved(
    mode: str, rows: list[dict[str, Any]], status: str
) -> None:
    gone = only(compared(report(fault("FR", "sensor", mode)), after(*rows)))
    assert gone.status == status
    assert ("missed than shown such a fault of 5.0 s" in gone.note) == (status == "not_seen_again")


@pytest.mark.parametrize(
    ("start_s", "words"), [(-86_400.0, "does not come after"), (50.0, "does not come after"), (0.0, "same log")]
)
def test_a_mission_that_is_no_later_one_resolves_nothing(start_s: float, words: str) -> None:
    gone = only(compared(report(fault("FR", "sensor", "stuck")), report(start_s=start_s)))
    assert gone.status == "not_seen_again"
    assert words in gone.note


def unclear(mode: str, **rows: float) -> dict[str, Any]:
    named = [{"side": "sensor", "mode": row, "p": p} for row, p in rows.items()]
    return fault("FR", "sensor", mode, hypotheses=named, probability=rows[mode])


def test_a_fault_whose_kind_is_unclear_is_no_other_one_than_a_row_that_it_may_be() -> None:
    older = report(unclear("stuck", stuck=0.4, inefficient=0.4, noisy=0.2))
    same = only(compared(older, later(fault("FR", "sensor", "inefficient"))))
    assert (same.status, same.changes) == ("unchanged", ())
    assert same.older is not None
    assert same.older.rows == ("stuck", "inefficient", "noisy")
    other = only(compared(older, later(fault("FR", "sensor", "no_signal"))))
    assert other.changes == ("row",)


def test_a_severe_fault_that_is_gone_stands_beside_a_mission_that_is_ready() -> None:
    older = report(fault("FR", "sensor", "stuck", severity="high"))
    newer = report(start_s=-86_400.0) | {"verdict": {"status": "ready", "title": "t"}}
    assert any("not shown to be repaired, and is open" in note for note in compared(older, newer).notes)
    assert not any("is open" in note for note in compared(older, later()).notes)
