"""The section that compares with another mission of the machine."""

from __future__ import annotations

from typing import Any

from diagnosis.comparison.previous import with_previous
from diagnosis.report.page import build_page
from diagnosis.report.previous import previous_section
from diagnosis.results.document import ReportDocument
from tests import report_samples as samples
from tests.coverage_changes import changed_coverage, judged_side
from tests.whole_documents import whole_report


def earlier(**changes: Any) -> ReportDocument:
    report, _ = samples.five_faults()
    log = {**report["log"], "start_ns": report["log"]["start_ns"] - 10**13, "files": [{"path": "monday.mcap"}]}
    return whole_report({**report, "log": log, **changes})


def test_nothing_is_said_without_a_comparison() -> None:
    report, columns = samples.five_faults()
    page = build_page(report, columns)
    assert previous_section(report) is None
    assert 'id="previous"' not in page
    assert "#previous" not in page


def test_new_and_resolved_faults() -> None:
    report, columns = samples.five_faults()
    first, *rest = report["intervals"]
    page = build_page(with_previous(whole_report({**report, "intervals": rest}), earlier(intervals=[first])), columns)
    section = page[page.index('id="previous"') :].partition("</section>")[0]
    assert "Against the previous mission" in section
    assert "monday.mcap" in section
    assert f'data-f="{rest[0]["id"]}"' in section
    assert f"{len(rest)} new" in section
    assert f"{len(rest)} new" in page[: page.index('id="timeline"')], "also on the first screen"


def test_a_later_mission_is_called_so() -> None:
    report, _ = samples.five_faults()
    section = previous_section(with_previous(earlier(), whole_report(report)))
    assert section is not None
    assert section["title"] == "Against a later mission"
    assert section["own"] == 0


def test_words_from_the_other_log_stay_text() -> None:
    report, columns = samples.five_faults()
    other = earlier(log={**earlier()["log"], "files": [{"path": "<script>alert(1)</script>\u202e"}]})
    page = build_page(with_previous(whole_report(report), other), columns)
    assert "<script>alert(1)" not in page
    assert "\u202e" not in page


def test_losses_are_listed_where_they_differ() -> None:
    def loss(*values: float) -> list[dict[str, Any]]:
        return [
            {
                "component": c,
                "side": "actuator",
                "epsilon": {"value": v, "low": v - 0.01, "high": v + 0.01},
                "seconds": 9.0,
                "relative": False,
            }
            for c, v in zip(("FL", "FR"), values, strict=True)
        ]

    report, _ = samples.five_faults()
    section = previous_section(
        with_previous(whole_report({**report, "loss": loss(0.3, -0.0002)}), earlier(loss=loss(0.1, 0.0)))
    )
    assert section is not None
    assert section["loss"] == [
        {"part": "FL drive valve", "cells": ["0.100 (0.090 to 0.110)", "0.300 (0.290 to 0.310)"], "change": "+0.200"}
    ]
    assert section["same_loss"] == 1


def test_parts_that_were_judged_in_both_missions_are_not_said_to_be_judged_in_one() -> None:
    checked = judged_side(assessed=False, shown=False)
    brief = judged_side(assessed=False, long_enough=False, decided_s=9.0)
    report = with_previous(earlier(), earlier())
    for newer, head, words in (
        ([checked], "Judged in both missions, its checks passed in one only", "a check is open now"),
        ([brief], "Judged long enough in one mission only", "no longer judged long enough"),
        (
            [brief, checked],
            "Judged long enough, or its checks passed, in one mission only",
            "no longer judged long enough",
        ),
    ):
        report["previous"]["coverage"] = [changed_coverage(x) for x in newer]  # type: ignore[typeddict-item]
        section = previous_section(report)
        assert section is not None
        assert section["coverage_head"] == head
        assert section["coverage"][0]["words"] == words
        assert section["coverage"][-1]["cells"][1].endswith("a check open") is (newer[-1] is checked)
