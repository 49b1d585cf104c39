"""The page of an evaluation: everything in words, nothing fetched, nothing run."""

from __future__ import annotations

import re
from dataclasses import asdict
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

from diagnosis.evaluation.counts import COLUMNS, TRUE_STATES, Counts, FaultOutcome, ReportOutcome, add
from diagnosis.evaluation.page import build_scores_page
from diagnosis.evaluation.plots import distribution, reliability_diagram
from diagnosis.evaluation.scores import figures
from diagnosis.results.result import to_json


class Tree(HTMLParser):
    """Tags with attributes, and the text of everything but the style."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self._in = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._in = tag

    def handle_endtag(self, tag: str) -> None:
        self._in = ""

    def handle_data(self, data: str) -> None:
        if self._in != "style":
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))


def counted(wheel: str = "FR") -> Counts:
    """100 s: a stuck sensor found after 20 ms, a missed valve, and a false alarm."""
    seconds = {side: np.zeros((5, 7)) for side in ("sensor", "actuator")}
    seconds["sensor"][0, [0, 4]] = 88.0, 2.0
    seconds["sensor"][1, [1, COLUMNS.index("undecided")]] = 9.0, 1.0
    seconds["actuator"][0, 0] = 95.0
    seconds["actuator"][TRUE_STATES.index("inefficient"), 0] = 5.0
    right = FaultOutcome(
        wheel, "sensor", "stuck", 10.0, 20.0, 1.0, 1.0, "right", "F1", 0.99, 0.004, -0.03, 0.0, 0.02, 0.2, 0.0
    )
    missed = FaultOutcome(wheel, "actuator", "inefficient", 30.0, 35.0, 0.25, 1.0, "missed")
    good = ReportOutcome("F1", wheel, "sensor", "stuck", "high", 10.0, 20.0, 0.97, "right", False, "direct", 1.0)
    false = ReportOutcome("F2", wheel, "sensor", "noisy", "low", 50.0, 52.0, 0.6, "surplus", True, "model", 0.1)
    return Counts(seconds, (right, missed), (good, false), 85.0)


def document(*missions: tuple[str, Counts], left_out: tuple[str, ...] = ()) -> dict[str, Any]:
    """What the command prints as JSON."""
    results = [
        {
            "result": name,
            "truth": "truth.json",
            "left_out": list(left_out),
            "not_driven": [],
            "wheel": figures(c)
            | {"faults": [to_json(asdict(f)) for f in c.faults], "reported": [to_json(asdict(r)) for r in c.reports]},
        }
        for name, c in missions
    ]
    return {
        "schema": "mfhca-evaluation/1",
        "results": results,
        "all": {"wheel": figures(add([c for _, c in missions]))},
    }


def test_nothing_is_run_or_fetched() -> None:
    page = build_scores_page(document(("drive", counted())))
    tree = Tree(page)
    policy = next(a["content"] for t, a in tree.tags if t == "meta" and a.get("http-equiv")) or ""
    assert policy.startswith("default-src 'none'; style-src 'unsafe-inline';")
    assert "script-src" not in policy
    for tag, attrs in tree.tags:
        assert tag not in {"script", "link", "iframe", "object", "embed", "base", "img", "form"}
        assert "src" not in attrs
        assert (attrs.get("href") or "#").startswith("#")
        assert not any(name.startswith("on") for name in attrs)
    assert "url(" not in page
    assert "@import" not in page


def test_links_lead_somewhere_and_pictures_have_words() -> None:
    tree = Tree(build_scores_page(document(("drive", counted()))))
    ids = {a["id"] for _, a in tree.tags if "id" in a}
    assert {(a["href"] or "")[1:] for t, a in tree.tags if t == "a"} <= ids
    plots = [a for t, a in tree.tags if t == "svg" and str(a.get("class")).startswith("plot")]
    assert len(plots) == 3 + 3  # three distributions; reliability over all and of two tiers
    assert all(a.get("role") == "img" and a.get("aria-label") for a in plots)


def test_confusion_has_shares_seconds_and_signs() -> None:
    text = Tree(build_scores_page(document(("drive", counted())))).text
    for words in ("97.8 % ✓ 88 s", "2.2 % ✗ 2 s", "90.0 % ✓ 9 s", "10.0 % ? 1 s", "100.0 % ✗ 5 s"):
        assert words in text


def test_leading_figures() -> None:
    text = Tree(build_scores_page(document(("drive", counted())))).text
    assert "1 of 2 right; precision 0.500, recall 0.500" in text
    assert "detection delay, median 20 ms 95 %: 20 ms, over 1 fault" in text
    assert "onset error, median 4 ms" in text
    assert "true detection r_td, sensor 0.900" in text
    assert "false alarms per healthy hour 42.4" in text  # 1 in 85 s
    assert "1 of 2 right; Brier 0.180, ECE 0.315" in text  # (0.03² + 0.6²)/2, (0.03 + 0.6)/2


def test_what_was_not_right_is_listed_with_its_time() -> None:
    text = Tree(build_scores_page(document(("drive", counted())))).text
    assert "drive 1 of 2 right, 1 false alarm" in text
    assert "30.00–35.00" in text
    assert "FR drive inefficient ○ missed ε 0.25" in text
    assert "50.00–52.00" in text
    assert "FR speed sensor noisy ! false alarm probability 0.60, severity low, tier model F2" in text


def test_severity_and_excitation() -> None:
    text = Tree(build_scores_page(document(("drive", counted())))).text
    assert "Wheels by row of the tables" in text
    assert "ε 0.2–0.4" in text
    assert "The results do not hold the commanded speed" in text
    assert "masked" in text


def test_many_missions_are_folded_and_counted() -> None:
    page = build_scores_page(document(*((f"drive {k}", counted()) for k in range(7))))
    assert page.count("<details>") == 7
    assert "7 missions against the truth" in page
    assert build_scores_page(document(("a", counted()))).count("<details open>") == 1


def test_missions_without_faults_or_driving() -> None:
    page = build_scores_page(document(("calm", Counts(healthy_s=60.0)), left_out=("FL",)))
    text = Tree(page).text
    assert "Wheels: no fault was injected or reported." in text
    assert "Nothing was reported." in text
    assert "Every fault was identified correctly" in text
    assert "calm: FL" in text
    assert "nan" not in text.lower().split()


def test_names_from_files_are_inert() -> None:
    page = build_scores_page(document(("<img src=x onerror=alert(1)>\u202e", counted("<b>FR</b>"))))
    assert "<img" not in page
    assert "<b>FR" not in page
    assert "\u202e" not in page


def test_same_input_gives_the_same_text_in_light_and_dark() -> None:
    one = document(("drive", counted()))
    page = build_scores_page(one)
    assert page == build_scores_page(one)
    assert "@media (prefers-color-scheme: dark) { :root {" in page
    assert "data-theme" not in page


def test_distribution_steps_at_every_time() -> None:
    assert distribution("x", {"sensor": [], "actuator": []}) == ""
    picture = distribution("Onset error", {"sensor": [0.0, -0.1], "actuator": [50.0]})
    sensor, actuator = re.findall(r'class="line \w+" d="([^"]+)"', picture)
    width = 360 - 40 - 14
    low, tenth, high = 40.0, 40 + width / 2, 40.0 + width  # 1 ms and less, 0.1 s, 10 s and more
    half, all_ = 196 - 34 - 152 / 2, 10.0
    assert sensor == f"M{low},162.0H{low}V{half}H{tenth}V{all_}H{high}"
    assert actuator == f"M{low},162.0H{high}V{all_}H{high}"


@pytest.mark.parametrize(("right", "y"), [(1.0, 11.0), (0.0, 143.0)])
def test_reliability_diagram_places_a_bin(right: float, y: float) -> None:
    picture = reliability_diagram("all", [{"reported": 4, "probability": 0.5, "right": right}])
    assert f'<path class="miss" d="M96.0,{y}V77.0"/>' in picture  # from the point to the diagonal
    assert f'cx="96.0" cy="{y}" r="8.5"' in picture
    assert "4 stated 0.50" in picture
