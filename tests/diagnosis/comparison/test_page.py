"""The page of a comparison: everything in words, nothing fetched, nothing run."""

from __future__ import annotations

import re
from typing import Any

from diagnosis.comparison.compare import compare_reports, comparison_json
from diagnosis.comparison.page import build_compare_page
from tests.whole_documents import whole_report

HOSTILE = "</style><script>alert(1)</script>\u202e"


def report(wheel: str, machine: str, *faults: dict[str, Any], decided: float = 90.0) -> dict[str, Any]:
    rows = [
        {
            "component": wheel,
            "side": side,
            "tier": "direct",
            "seconds": {"healthy": decided},
            "driving_s": 100.0,
            "decided_driving_s": decided,
        }
        for side in ("sensor", "actuator")
    ]
    return {
        "log": {"files": [{"path": wheel}], "start_ns": 0, "duration_s": 100.0},
        "machine": {"name": machine, "id": machine, "wheels": [wheel]},
        "verdict": {"status": "watch", "title": machine},
        "intervals": list(faults),
        "coverage": rows,
        "states": [],
    }


def fault(wheel: str, mode: str = "stuck") -> dict[str, Any]:
    epsilon = {"value": 0.42, "low": 0.4, "high": 0.44}
    common = {"id": "F1", "component": wheel, "kind": "wheel", "side": "sensor", "mode": mode, "epsilon": epsilon}
    return common | {"start_s": 1.0, "stop_s": 3.5, "probability": 0.97, "severity": "high", "tier": "direct"}


def page(older: dict[str, Any], newer: dict[str, Any]) -> str:
    return build_compare_page(
        comparison_json(compare_reports(whole_report(older), whole_report(newer), ("monday", "tuesday")))
    )


def words(text: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", text.partition("</style>")[2]))


def test_the_page_says_what_became_of_each_fault() -> None:
    seen = words(page(report("FR", "M", fault("FR")), report("FR", "M", fault("FR", "noisy"), decided=50.0)))
    for sentence in (
        "Nothing new or worse, faults stand",
        "1 changed",
        "FR speed sensor",
        "Stuck",
        "Noisy",
        "ε̂ 0.42 (0.40–0.44)",
    ):
        assert sentence in seen
    assert "no longer judged long enough" in seen
    gone = words(page(report("FR", "M", fault("FR")), report("FR", "M", decided=50.0)))
    assert "Not seen again, no repair shown (1)" in gone
    assert (
        "In the newer mission the speed sensor was judged for 50.0 s of 100.0 s driving, which is too little." in gone
    )
    assert "Resolved (" not in gone


def test_no_fault_is_said_with_what_it_does_not_mean() -> None:
    assert "Parts that were not judged may have faults" in words(page(report("FR", "M"), report("FR", "M")))


def test_names_are_text_and_the_page_runs_and_fetches_nothing() -> None:
    text = page(report(HOSTILE, HOSTILE), report(HOSTILE, HOSTILE, fault(HOSTILE)))
    assert "<script" not in text
    assert "\u202e" not in text
    assert text.count("</style>") == 1
    assert not re.search(r"https?:|src=|@import", text)
    assert "default-src &#39;none&#39;" in text


def test_the_same_input_gives_the_same_page() -> None:
    pages = {page(report("FR", "M"), report("FR", "M", fault("FR"))) for _ in range(2)}
    assert len(pages) == 1


def test_faults_that_count_as_one_are_said_to() -> None:
    older, newer = report("FR", "HX-1", fault("FR"), {**fault("FR"), "id": "F2"}), report("FR", "HX-1", fault("FR"))
    assert "Faults, each part and kind once: 1 unchanged" in words(page(older, newer))
    assert "Faults: 1 unchanged" in words(page(newer, newer))
