"""Documents of earlier versions are read with the keys that they do not have."""

from __future__ import annotations

from typing import Any

import pytest

from diagnosis.results.validation import report_of
from tests.whole_documents import whole_report


def earlier(status: str = "watch", decided_s: float = 30.0, damage: tuple[str, ...] = ()) -> dict[str, Any]:
    """As the first version wrote it: without any key that came later."""
    row = {"component": "FR", "side": "sensor", "decided_driving_s": decided_s, "seconds": {"healthy": decided_s}}
    given = {
        "log": {"files": [{"damage": list(damage)}], "duration_s": 60.0},
        "machine": {"wheels": ["FR"]},
        "verdict": {"status": status},
        "coverage": [row],
    }
    document: Any = whole_report(given)
    for rows, keys in (
        ([document], ("loss",)),
        ([document["log"]], ("open_loop",)),
        (document["log"]["files"], ("clock",)),
        ([document["verdict"]], ("cleared", "not_cleared")),
        (document["coverage"], ("tier", "driving_s")),
    ):
        for found in rows:
            for key in keys:
                del found[key]
    return dict(document)


def test_keys_that_came_later() -> None:
    found = report_of(earlier(), "r.json")
    assert (found["loss"], found["log"]["open_loop"], found["log"]["files"][0]["clock"]) == ([], False, None)
    assert (found["coverage"][0]["tier"], found["coverage"][0]["driving_s"]) == ("model", 30.0)
    assert report_of(earlier(decided_s=0.0), "r.json")["coverage"][0]["tier"] == "none"


@pytest.mark.parametrize(
    ("changes", "cleared", "doubt"),
    [
        ({}, True, ""),
        ({"status": "ready"}, True, ""),
        ({"status": "stop"}, False, ""),
        ({"status": "not_assessed"}, False, ""),
        ({"damage": ("cut off",)}, False, "the log is damaged"),
        ({"decided_s": 9.0}, False, "1 part was not judged long enough"),
    ],
)
def test_whether_the_machine_may_go_out(changes: dict[str, Any], cleared: bool, doubt: str) -> None:
    verdict = report_of(earlier(**changes), "r.json")["verdict"]
    assert (verdict["cleared"], verdict["not_cleared"]) == (cleared, doubt)


def test_a_document_that_says_it_is_left_alone() -> None:
    said = earlier()
    said["verdict"] |= {"cleared": False, "not_cleared": "a reason of its own"}
    assert report_of(said, "r.json")["verdict"]["not_cleared"] == "a reason of its own"
