"""Two results side by side: what is new, worse, resolved, and what nobody looked at."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import pytest

from diagnosis.comparison.compare import Comparison, compare_reports, comparison_json
from diagnosis.comparison.faults import FaultChange
from diagnosis.comparison.words import coverage_words
from replay.errors import ConfigError
from tests.whole_documents import whole_report

WHEELS = ("FR", "FL")
START = 1_760_000_000_000_000_000


def fault(component: str, side: str, mode: str, seconds: float = 5.0, **more: Any) -> dict[str, Any]:
    return {
        "id": "F1",
        "component": component,
        "kind": "wheel",
        "side": side,
        "mode": mode,
        "start_s": 10.0,
        "stop_s": 10.0 + seconds,
        "epsilon": {"value": 0.5, "low": 0.45, "high": 0.55},
        "probability": 0.99,
        "severity": "medium",
        "tier": "direct",
    } | more


def report(*faults: dict[str, Any], start_s: float = 0.0, **sides: dict[str, Any]) -> dict[str, Any]:
    """100 s of driving, every side judged for 95 s of it; `sides` changes single ones, as ``FR_sensor={...}``."""
    rows = []
    for wheel in WHEELS:
        for side in ("sensor", "actuator"):
            row = {
                "component": wheel,
                "side": side,
                "tier": "direct",
                "seconds": {"healthy": 95.0, "slip": 5.0},
                "driving_s": 100.0,
                "decided_driving_s": 95.0,
            }
            rows.append(row | sides.get(f"{wheel}_{side}", {}))
    figures = {
        "tracking_error": {"mission": 0.02, "driving": 0.03},
        "control_effort": {"mission": 0.2, "driving": None},
    }
    return {
        "schema": "mfhca-report/1",
        "tool": {"version": "1"},
        "log": {
            "files": [{"path": "a.mcap", "sha256": f"{start_s}"}],
            "start_ns": START + int(start_s * 1e9),
            "duration_s": 110.0,
        },
        "machine": {"name": "M", "id": "M-1", "wheels": list(WHEELS), "axles": []},
        "verdict": {"status": "watch", "title": "t"},
        "intervals": list(faults),
        "coverage": rows,
        "metrics": {"wheels": {"FR": figures}, "average": figures},
        "limits": {"min_assessed": 10.0},
    }


def compared(older: dict[str, Any], newer: dict[str, Any], **options: Any) -> Comparison:
    return compare_reports(whole_report(older), whole_report(newer), ("a", "b"), **options)


def only(found: Comparison) -> FaultChange:
    (change,) = found.faults
    return change


def later(*faults: dict[str, Any], **sides: dict[str, Any]) -> dict[str, Any]:
    return report(*faults, start_s=86_400.0, **sides)


NOTHING = {"tier": "none", "decided_driving_s": 0.0, "seconds": {"not_assessed": 100.0}}


def test_nothing_in_either() -> None:
    found = compared(report(), later())
    assert (found.worse, found.faults, found.notes) == (False, (), ())
    assert set(found.counts.values()) == {0}


def test_the_same_fault_at_another_time_is_unchanged() -> None:
    found = compared(
        report(fault("FR", "sensor", "noisy")), later(fault("FR", "sensor", "noisy", start_s=50.0, stop_s=55.0))
    )
    assert (only(found).status, found.worse) == ("unchanged", False)


@pytest.mark.parametrize(("severity", "worse"), [("info", False), ("low", True)])
def test_a_new_fault_is_worse_from_low_severity_on(severity: str, worse: bool) -> None:
    found = compared(report(), later(fault("FL", "actuator", "noisy", severity=severity)))
    assert (only(found).status, only(found).note, found.worse) == ("new", "", worse)


def test_a_new_fault_of_a_part_that_was_not_assessed_before_says_so() -> None:
    found = compared(report(FL_actuator=NOTHING), later(fault("FL", "actuator", "noisy")))
    assert only(found).status == "new"
    assert "the fault may be older" in only(found).note
    assert [c.change for c in found.coverage if c.component == "FL" and c.side == "actuator"] == ["gained"]


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (NOTHING, "This part was not judged in the older"),
        ({"decided_driving_s": 44.0}, "This part was hardly judged (44.0 of 100.0 s of driving) in the older"),
        ({"decided_driving_s": 79.0}, "This part was only partly judged (79.0 of 100.0 s of driving) in the older"),
    ],
)
def test_how_far_the_part_of_a_new_fault_was_assessed_before(row: dict[str, Any], words: str) -> None:
    older = report(fault("FL", "actuator", "stuck"), FL_actuator=row)
    found = compared(older, later(fault("FL", "actuator", "stuck"), fault("FL", "actuator", "noisy")))
    new = next(c for c in found.faults if c.status == "new")
    assert new.note == f"{words} mission: the fault may be older."


def test_the_side_of_a_new_fault_of_either_side_that_was_not_assessed_before_is_named() -> None:
    found = compared(report(FL_actuator=NOTHING), later(fault("FL", "sensor_or_actuator", "inefficient")))
    assert only(found).note == "The drive valve was not judged in the older mission: the fault may be older."


@pytest.mark.parametrize(
    ("older", "newer", "words"),
    [
        ({}, {}, ""),
        ({}, NOTHING, "no longer judged"),
        ({}, {"decided_driving_s": 9.0}, "no longer judged long enough"),
        (NOTHING, {}, "judged now"),
        ({"decided_driving_s": 9.0}, {}, "judged long enough now"),
        (NOTHING, NOTHING, "judged in neither"),
        ({"decided_driving_s": 9.0}, NOTHING, "judged long enough in neither"),
    ],
)
def test_words_of_what_was_assessed(older: dict[str, Any], newer: dict[str, Any], words: str) -> None:
    rows = comparison_json(compared(report(FL_actuator=older), later(FL_actuator=newer)))["coverage"]
    (row,) = [r for r in rows if (r["component"], r["side"]) == ("FL", "actuator")]
    assert coverage_words(row) == words


def test_gone_and_assessed_is_resolved() -> None:
    found = compared(report(fault("FR", "sensor", "stuck")), later())
    assert (only(found).status, found.worse) == ("resolved", False)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (NOTHING, "not judged"),
        ({"decided_driving_s": 79.0}, "79.0 s of 100.0 s driving, which is too little"),
        ({"driving_s": 9.0, "decided_driving_s": 9.0}, "9.0 s of 9.0 s driving, which is too little"),
        ({"tier": "tracking"}, "tracking alone"),
    ],
)
def test_gone_while_nobody_looked_is_never_resolved(row: dict[str, Any], words: str) -> None:
    found = compared(report(fault("FR", "sensor", "noisy")), later(FR_sensor=row))
    assert only(found).status == "not_seen_again"
    assert words in only(found).note
    assert found.counts["resolved"] == 0


def test_a_part_that_the_newer_result_leaves_out_is_not_resolved() -> None:
    newer = later()
    newer["coverage"] = [r for r in newer["coverage"] if r["component"] != "FR"]
    found = compared(report(fault("FR", "sensor", "stuck")), newer)
    assert (only(found).status, only(found).note) == (
        "not_seen_again",
        "The newer result does not hold the speed sensor.",
    )


@pytest.mark.parametrize(
    ("side", "low", "status"),
    [
        ("sensor", 0.2, "not_seen_again"),
        ("sensor", 0.4, "resolved"),
        ("actuator", 0.4, "not_seen_again"),
        ("actuator", 0.6, "resolved"),
    ],
)
def test_a_model_does_not_resolve_a_small_loss(side: str, low: float, status: str) -> None:
    small = {"value": low + 0.02, "low": low, "high": low + 0.04}
    older = report(fault("FR", side, "inefficient", epsilon=small))
    gone = only(compared(older, later(**{f"FR_{side}": {"tier": "model"}})))
    assert gone.status == status
    if status == "not_seen_again":
        assert f"below about {25 if side == 'sensor' else 50} % there" in gone.note


def test_either_side_is_resolved_only_where_both_are_assessed() -> None:
    older = report(fault("FR", "sensor_or_actuator", "inefficient"))
    assert only(compared(older, later())).status == "resolved"
    assert only(compared(older, later(FR_actuator=NOTHING))).status == "not_seen_again"


def test_a_row_that_is_gone_from_a_part_with_another_fault_says_so() -> None:
    older = report(fault("FR", "sensor", "stuck"), fault("FR", "sensor", "noisy"))
    found = compared(older, later(fault("FR", "sensor", "noisy")))
    gone = next(c for c in found.faults if c.status == "resolved")
    assert gone.note == "The part is not healthy: in the newer mission it is noisy."


@pytest.mark.parametrize(
    ("change", "names", "trend"),
    [
        ({"severity": "high"}, ("severity",), "worse"),
        ({"severity": "low"}, ("severity",), "better"),
        ({"epsilon": {"value": 0.7, "low": 0.6, "high": 0.8}}, ("epsilon",), "worse"),
        ({"epsilon": {"value": 0.3, "low": 0.2, "high": 0.4}}, ("epsilon",), "better"),
        ({"epsilon": {"value": 0.7, "low": 0.4, "high": 1.0}}, (), ""),
        ({"epsilon": {"value": 0.56, "low": 0.551, "high": 0.569}}, ("epsilon",), "worse"),
        ({"epsilon": {"value": 0.54, "low": 0.53, "high": 0.55}}, (), ""),
        ({"epsilon": None}, (), ""),
        ({"stop_s": 25.0}, ("duration",), "worse"),
        ({"stop_s": 12.0}, ("duration",), "better"),
        ({"stop_s": 19.0}, (), ""),
        ({"mode": "inefficient"}, ("row",), "other"),
        ({"mode": "stuck", "severity": "high"}, ("row", "severity"), "worse"),
        ({"severity": "high", "stop_s": 12.0}, ("severity", "duration"), "worse"),
    ],
)
def test_what_counts_as_changed(change: dict[str, Any], names: tuple[str, ...], trend: str) -> None:
    found = only(compared(report(fault("FR", "sensor", "noisy")), later(fault("FR", "sensor", "noisy") | change)))
    assert (found.changes, found.trend) == (names, trend)
    assert found.status == ("changed" if names else "unchanged")


def test_twice_the_time_in_twice_the_mission_is_no_change() -> None:
    long = {"seconds": {"healthy": 380.0}, "driving_s": 400.0, "decided_driving_s": 380.0}
    found = compared(
        report(fault("FR", "sensor", "noisy", 5.0)), later(fault("FR", "sensor", "noisy", 20.0), FR_sensor=long)
    )
    assert only(found).status == "unchanged"


def test_several_faults_of_one_row_count_once() -> None:
    found = compared(
        report(fault("FR", "sensor", "noisy", 2.0), fault("FR", "sensor", "noisy", 3.0, id="F2")),
        later(fault("FR", "sensor", "noisy", 5.0)),
    )
    older = only(found).older
    assert older is not None
    assert (older.ids, older.seconds) == (("F1", "F2"), 5.0)
    assert only(found).status == "unchanged"


def test_a_side_that_is_told_apart_now_is_the_same_fault() -> None:
    found = compared(
        report(fault("FR", "sensor_or_actuator", "inefficient")), later(fault("FR", "actuator", "inefficient"))
    )
    assert (only(found).changes, only(found).side) == (("side",), "actuator")


def test_sensor_and_valve_are_never_one_fault() -> None:
    found = compared(report(fault("FR", "sensor", "stuck")), later(fault("FR", "actuator", "stuck")))
    assert [(c.status, c.side) for c in found.faults] == [("new", "actuator"), ("resolved", "sensor")]


@pytest.mark.parametrize(("tier", "noted"), [("model", True), ("direct", False)])
def test_a_model_may_tell_the_same_fault_as_one_of_the_other_side(tier: str, noted: bool) -> None:
    older = report(fault("FR", "sensor", "noisy", tier=tier))
    found = compared(older, later(fault("FR", "actuator", "inefficient", tier=tier)))
    gone = next(c for c in found.faults if c.status == "resolved")
    assert ("the FR drive valve is inefficient" in gone.note) == noted


def test_narrow_bounds_do_not_make_a_small_difference_a_change() -> None:
    narrow = [{"value": v, "low": v - 0.001, "high": v + 0.001} for v in (0.40, 0.41)]
    a, b = (fault("FR", "sensor", "inefficient", epsilon=e) for e in narrow)
    assert only(compared(report(a), later(b))).status == "unchanged"


def test_swapping_the_missions_swaps_new_and_resolved() -> None:
    a, b = report(fault("FR", "sensor", "stuck")), later(fault("FL", "actuator", "noisy"))
    there, back = compared(a, b), compared(b, a)
    assert [c.status for c in there.faults] == ["new", "resolved"]
    assert (back.faults[0].component, back.faults[1].component) == ("FR", "FL")
    assert "swapped" in back.notes[0]
    assert not there.notes


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"id": "M-2"}, "b: is of machine M-2, a of machine M-1"),
        ({"wheels": ["L", "R"]}, "wheels L, R, a of one with FR, FL"),
    ],
)
def test_another_machine_is_refused_unless_forced(change: dict[str, Any], words: str) -> None:
    newer = later()
    newer["machine"] |= change
    with pytest.raises(ConfigError, match=words) as caught:
        compared(report(), newer)
    assert "--force" in str(caught.value)
    assert words in compared(report(), newer, force=True).notes[0]


def test_a_machine_without_an_id_is_compared_with_a_word_about_it() -> None:
    newer = later()
    newer["machine"]["id"] = ""
    newer["machine"]["wheels"] = list(reversed(WHEELS))
    assert "b states no machine id" in compared(report(), newer).notes[0]


def test_notes_on_the_same_log_other_limits_versions_and_injected_faults() -> None:
    newer = deepcopy(report())
    newer["limits"] = {"min_assessed": 5.0}
    newer["tool"]["version"] = "2"
    newer["log"]["open_loop"] = True
    notes = compared(report(), newer).notes
    assert len(notes) == 4
    for words, note in zip(("same log", "injected", "versions", "min_assessed 10.0 and 5.0"), notes, strict=True):
        assert words in note


def test_overlapping_missions_have_no_order() -> None:
    assert "overlap in time" in compared(report(), report(start_s=50.0)).notes[0]


def test_figures_are_those_of_driving_and_unknown_ones_stay_unknown() -> None:
    fr, average = compared(report(), later()).metrics
    assert (fr.wheel, average.wheel) == ("FR", "average")
    assert (fr.tracking_error_older, fr.tracking_error_newer, fr.control_effort_newer) == (0.03, 0.03, None)


def test_the_document_is_plain_json() -> None:
    document = comparison_json(compared(report(fault("FR", "sensor", "stuck")), later()))
    assert document["schema"] == "mfhca-compare/1"
    assert document["faults"][0]["older"]["ids"] == ["F1"]
    assert document["faults"][0]["newer"] is None
    assert document["coverage"][0]["newer"]["assessed"] is True


def test_gone_in_a_part_of_a_mission_or_beside_an_open_check_is_not_resolved() -> None:
    older = report(fault("FR", "sensor", "stuck"))
    window = later()
    window["verdict"]["scope"] = ["only 29.5 s of 60.0 s of the log were judged"]
    window["verdict"]["cuts"] = [{"kind": "log", "components": []}]
    open_check = {
        "component": "FR",
        "side": "sensor_or_actuator",
        "check": "response",
        "asked": "speed per opening",
        "worst": 0.5,
        "limit": 0.3,
        "start_s": 1.0,
        "stop_s": 4.0,
        "shows": 0.3,
        "passed": False,
        "text": "the speed of FR falls",
    }
    unsure = {**later(), "clearing": [open_check]}
    for newer in (window, unsure):
        found = compared(older, newer)
        assert found.counts["resolved"] == 0
        assert "not cleared" in only(found).note
    assert only(compared(older, later())).status == "resolved"
