"""A document from outside is refused with its place, or whole and typed."""

from __future__ import annotations

from typing import Any

import pytest

from diagnosis.results.document import ReportDocument
from diagnosis.results.validation import report_of, validated
from diagnosis.results.vocabulary import Severity
from replay.errors import LogError
from replay.faults import FaultMode
from tests.whole_documents import whole_report


def document() -> dict[str, Any]:
    """One fault of one wheel, as plain JSON."""
    fault = {"id": "F1", "component": "FR", "side": "sensor", "mode": "stuck", "start_s": 1.0, "stop_s": 2.0}
    row = {"component": "FR", "side": "sensor", "tier": "direct", "driving_s": 30.0, "decided_driving_s": 30.0}
    given = {
        "log": {"files": [{"path": "a.mcap"}], "duration_s": 60.0},
        "machine": {"wheels": ["FR"]},
        "verdict": {"status": "watch"},
        "intervals": [fault | {"severity": "low"}],
        "coverage": [row | {"seconds": {"healthy": 30.0}}],
    }
    return dict(whole_report(given))


def test_words_become_members_and_keys_of_later_versions_stay() -> None:
    later = document()
    later["machine"] = {**later["machine"], "serial": "X"}
    found = report_of(later, "r.json")
    assert found["intervals"][0]["severity"] is Severity.LOW
    assert found["intervals"][0]["mode"] is FaultMode.STUCK
    assert found == later
    assert list(found) == list(later)


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("intervals", 0, "start_s"), "soon", "intervals[0].start_s: text found, float expected"),
        (("intervals", 0, "epsilon"), 0.5, "intervals[0].epsilon: float found, object or null expected"),
        (("intervals", 0, "severity"), "catastrophic", "intervals[0].severity: 'catastrophic' found"),
        (("intervals",), {}, "intervals: object found, array expected"),
        (("log", "duration_s"), None, "log.duration_s: null found, float expected"),
        (("coverage", 0, "seconds", "healthy"), "long", "coverage[0].seconds[...]: text found, float expected"),
        (("verdict",), [], "verdict: array found, object expected"),
        (("log",), None, "log: null found, object expected"),
    ],
)
def test_wrong_types_are_refused_with_their_place(place: tuple[Any, ...], value: Any, words: str) -> None:
    wrong = document()
    at: Any = wrong
    for key in place[:-1]:
        at = at[key]
    at[place[-1]] = value
    with pytest.raises(LogError) as caught:
        report_of(wrong, "r.json")
    assert str(caught.value).startswith(f"r.json: {words}")
    assert str(caught.value).endswith("; run `mfhca diagnose` on the log again")
    assert caught.value.exit_code == 3


@pytest.mark.parametrize("key", ["log", "machine", "verdict", "intervals", "states", "coverage", "limits"])
def test_what_every_version_wrote_is_required(key: str) -> None:
    broken = document()
    del broken[key]
    with pytest.raises(LogError, match=rf"^r.json: the document: key '{key}' expected, not found; run"):
        report_of(broken, "r.json")


@pytest.mark.parametrize("content", [None, 3, "report", [], {}, {"schema": "other/1"}])
def test_other_documents_are_refused_by_their_schema(content: object) -> None:
    with pytest.raises(LogError, match=r"^r.json: schema .* found, 'mfhca-report/1' expected; run"):
        report_of(content, "r.json")


def test_remedy_of_another_document() -> None:
    with pytest.raises(LogError, match=r"^x: tool\.version: int found, text expected; write it again$"):
        validated({**document(), "tool": {"name": "", "version": 1}}, ReportDocument, "x", "write it again")


@pytest.mark.parametrize(
    ("key", "value"), [("start_s", 1e308), ("stop_s", -1e10), ("probability", 7.0), ("probability", -0.5)]
)
def test_values_that_cannot_be_are_refused_with_their_place(key: str, value: float) -> None:
    wrong = document()
    wrong["intervals"][0][key] = value
    with pytest.raises(LogError, match=rf"r\.json: intervals\[0\]\.{key}"):
        report_of(wrong, "r.json")
