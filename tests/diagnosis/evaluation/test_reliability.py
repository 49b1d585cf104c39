"""Brier score, calibration error and bins of a few reports, by hand."""

from __future__ import annotations

import pytest

from diagnosis.evaluation.counts import ReportOutcome
from diagnosis.evaluation.reliability import probability_bins, reliability


def told(p: float, outcome: str, tier: str = "direct", side: str = "sensor") -> ReportOutcome:
    return ReportOutcome("F1", "A", side, "stuck", "high", 0.0, 1.0, p, outcome, False, tier)


def test_scores_over_all_and_per_tier_and_side() -> None:
    reports = [
        told(0.9, "right"),
        told(0.9, "surplus"),
        told(1.0, "right", side="actuator"),
        told(0.6, "wrong_mode", tier="model"),
        told(0.2, "ignored"),  # counts nothing
    ]
    found = {(r["tier"], r["side"]): r for r in reliability(reports)}
    assert list(found) == [("all", "all"), ("direct", "actuator"), ("direct", "sensor"), ("model", "sensor")]
    both = found["direct", "sensor"]
    assert (both["reported"], both["right"]) == (2, 1)
    assert both["brier"] == pytest.approx((0.1**2 + 0.9**2) / 2)
    assert both["ece"] == pytest.approx(0.4)  # stated 0.9, right 0.5
    whole = found["all", "all"]
    assert whole["brier"] == pytest.approx((0.1**2 + 0.9**2 + 0.0 + 0.6**2) / 4)
    # bin 0.9–1: stated (0.9 + 0.9 + 1)/3, right 2/3, weight 3/4; bin 0.6–0.7: stated 0.6, right 0, weight 1/4
    assert whole["ece"] == pytest.approx(0.75 * (2.8 / 3 - 2 / 3) + 0.25 * 0.6)
    assert found["model", "sensor"]["ece"] == pytest.approx(0.6)


def test_certain_and_right_is_perfect() -> None:
    (found, one) = reliability([told(1.0, "right")])
    assert (found["brier"], found["ece"]) == (0.0, 0.0)
    assert one["bins"] == found["bins"]


def test_nothing_reported_has_no_scores() -> None:
    (found,) = reliability([told(0.9, "ignored")])
    assert (found["reported"], found["brier"], found["ece"]) == (0, None, None)
    assert all(b["probability"] is None for b in found["bins"])


def test_bins_hold_their_lower_end_and_the_last_one_both() -> None:
    bins = probability_bins([told(p, "right") for p in (0.0, 0.1, 0.15, 0.99, 1.0)])
    assert [b["reported"] for b in bins] == [1, 2, 0, 0, 0, 0, 0, 0, 0, 2]
    assert bins[1]["probability"] == pytest.approx(0.125)
