from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from diagnosis.report.page import build_page
from diagnosis.report.tables import merged_caveats
from diagnosis.results.vocabulary import Verdict
from replay.errors import ConfigError
from tests import report_samples as samples
from tests.browser import evidence_samples
from tests.campaigns import campaign

SAMPLES: list[Callable[[], tuple[dict[str, Any], samples.Columns]]] = [
    samples.five_faults,
    samples.one_wheel,
    samples.no_faults,
    samples.six_wheels,
    samples.not_assessed,
    samples.hostile,
]


NBSP = "\u00a0"  # between a number and its unit


class Tree(HTMLParser):
    """Tags with attributes, and the text of scripts and of everything else."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[tuple[dict[str, str | None], str]] = []
        self.words: list[str] = []
        self._in = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._in = tag
        if tag == "script":
            self.scripts.append((dict(attrs), ""))

    def handle_endtag(self, tag: str) -> None:
        self._in = ""

    def handle_data(self, data: str) -> None:
        if self._in == "script":
            attrs, text = self.scripts[-1]
            self.scripts[-1] = (attrs, text + data)
        elif self._in != "style":
            self.words.append(data.replace(NBSP, " "))

    @property
    def text(self) -> str:
        return " ".join(self.words)


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda s: s.__name__)
def test_scripts_match_the_policy_and_nothing_is_fetched(sample: Callable[[], Any]) -> None:
    tree = Tree(build_page(*sample()))
    policy = next(a["content"] for t, a in tree.tags if t == "meta" and a.get("http-equiv")) or ""
    code = [text for attrs, text in tree.scripts if "type" not in attrs]
    packed = [text for attrs, text in tree.scripts if attrs.get("id") in ("main", "later") and text]
    assert len(code) == 2
    for text in [*code, *(zlib.decompress(base64.b64decode(p)).decode() for p in packed)]:
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert policy.endswith("img-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'")
    assert "eval" not in policy
    for tag, attrs in tree.tags:
        assert tag not in {"link", "iframe", "object", "embed", "base", "img", "form"}
        assert "src" not in attrs
        assert attrs.get("href", "#").startswith("#") or attrs["href"] == "report.json"  # type: ignore[union-attr]
        assert not any(name.startswith("on") for name in attrs)


@pytest.mark.parametrize("sample", campaign(SAMPLES, 2), ids=lambda s: s.__name__)
def test_same_input_gives_the_same_bytes(sample: Callable[[], Any]) -> None:
    assert build_page(*sample()) == build_page(*sample())


def test_page_tells_everything_without_javascript() -> None:
    report, columns = samples.five_faults()
    tree = Tree(build_page(report, columns))
    for words in (
        report["verdict"]["title"],
        report["verdict"]["text"],
        *report["verdict"]["caveats"],
        *(a["text"] for a in report["verdict"]["actions"]),
        *(e for f in report["intervals"] for e in f["evidence"]),
        *(f["advice"] for f in report["intervals"]),
        report["missing"][0]["cost"],
        report["log"]["files"][0]["sha256"],
        "opposed (fitted)",
        "Yang",
        "mfhca-replay 0.1.0",
    ):
        assert words in tree.text
    kinds = [a.get("class") or "" for _, a in tree.tags]
    assert kinds.count("spark") == 5
    assert sum(k.startswith("fb ") for k in kinds) == 5
    assert sum(k.startswith("mark ") for k in kinds) == 5
    assert "The linked plots need JavaScript" in tree.text


def test_hostile_names_are_shown_verbatim_and_inert() -> None:
    report, columns = samples.hostile()
    text = build_page(report, columns)
    tree = Tree(text)
    for name in samples.HOSTILE:
        shown = name.replace("\u202e", "\\u202e").replace("\x1b", "\\x1b")
        assert shown in tree.text
    assert "\u202e" not in text
    assert "\x1b" not in text
    assert not any(t == "img" for t, _ in tree.tags)
    assert "alert" not in "".join(s for a, s in tree.scripts if "type" not in a)
    view = json.loads(next(s for a, s in tree.scripts if a.get("id") == "view"))
    assert any("<script>alert(1)</script>" in c["name"] for c in view["channels"])


def test_report_without_anything_is_still_a_page() -> None:
    tree = Tree(build_page(*samples.not_assessed()))
    assert "Not assessed" in tree.text
    assert "Nothing could be judged" in tree.text


def test_a_clock_without_a_date_is_not_shown_as_1970() -> None:
    report, columns = samples.five_faults(60.0, 20.0)
    undated = {**report, "log": {**report["log"], "start_ns": 12 * 10**9}}
    text = Tree(build_page(undated, columns)).text
    assert "clock without a date" in text
    assert "Start (UTC)" not in text
    assert "Clock without a date, " in text
    dated = {**report, "log": {**report["log"], "start_ns": 1_793_000_000 * 10**9}}
    text = Tree(build_page(dated, columns)).text
    assert "Start (UTC)" in text
    assert re.search(r"2026-10-26 07:33:20 to 07:3\d:\d\d UTC, \d:\d\d ", " ".join(text.split()))


LISTS = ("readings", "intervals", "states", "phases", "coverage", "loss", "clearing", "signals", "missing", "quality")


@pytest.mark.parametrize("key", LISTS)
def test_every_list_of_the_report_may_be_empty(key: str) -> None:
    report, columns = samples.five_faults(60.0, 20.0)
    assert "</html>" in build_page({**report, key: []}, columns)


@pytest.mark.parametrize(
    ("key", "nothing"), [("epsilon", None), ("sat", None), ("hypotheses", []), ("evidence", []), ("advice", "")]
)
def test_parts_of_a_fault_may_be_unknown(key: str, nothing: object) -> None:
    report, columns = samples.one_wheel()
    report["intervals"] = [samples.fault(component="drive", **{key: nothing})]
    assert "drive speed sensor stuck" in Tree(build_page(report, columns)).text


def test_time_axis_in_single_precision() -> None:
    report, columns = samples.one_wheel()
    columns["t"] = np.arange(12_000, dtype=np.float32) / np.float32(100)
    assert "</html>" in build_page(report, columns)


def test_coverage_says_why_time_was_not_decided() -> None:
    report, columns = samples.one_wheel()
    report["states"] = [
        {"component": "drive", "side": "sensor", "state": "not_excited", "start_s": 0.0, "stop_s": 3.0, "reason": ""},
        {
            "component": "drive",
            "side": "sensor",
            "state": "masked",
            "start_s": 3.0,
            "stop_s": 9.0,
            "reason": "F1 hides it",
        },
    ]
    assert "F1 hides it (6.0 s); not excited (3.0 s)" in Tree(build_page(report, columns)).text


def test_caveats_stand_in_the_verdict() -> None:
    report, columns = samples.five_faults()
    text = build_page(report, columns)
    verdict = text[text.index('id="verdict"') : text.index('id="timeline"')]
    assert all(c in verdict for c in report["verdict"]["caveats"])


@pytest.mark.parametrize("status", Verdict)
def test_verdict_words(status: Verdict) -> None:
    report = samples.report_with(verdict={"status": status, "title": "x"})
    assert status.label in Tree(build_page(report, {})).text


def test_large_mission_keeps_to_the_size() -> None:
    report, columns = samples.five_faults(600.0, 200.0)
    assert len(build_page(report, columns)) > 2.6e6
    assert len(build_page(report, columns, max_size_mb=2.4)) < 2.5e6


def test_columns_must_fit_the_time_axis() -> None:
    with pytest.raises(ValueError, match="has shape"):
        build_page(samples.report_with(), {"t": np.arange(5.0), "wheel.FR.v": np.zeros(4)})
    with pytest.raises(ValueError, match="not uniform"):
        build_page(samples.report_with(), {"t": np.array([0.0, 1.0, 9.0]), "wheel.FR.v": np.zeros(3)})


def test_own_bundle_of_plotly(tmp_path: Path) -> None:
    bundle = tmp_path / "plotly.min.js"
    bundle.write_text("/*\n* plotly.js v9.8.7\n*/ window.Plotly = {};", encoding="utf-8")
    report, columns = samples.one_wheel()
    text = build_page(report, columns, plotlyjs=bundle)
    assert len(text) < 4e5
    assert re.search(r"<dt>plotly\.js</dt><dd>9\.8\.7</dd>", text)
    with pytest.raises(ConfigError, match="cannot be read"):
        build_page(report, columns, plotlyjs=tmp_path / "none.js")


def test_injected_faults_are_announced_above_the_verdict() -> None:
    report, columns = samples.one_wheel()
    report["log"]["open_loop"] = True
    text = build_page(report, columns)
    assert text.index('class="banner"') < text.index('id="verdict"')
    report["log"]["open_loop"] = False
    assert 'class="banner"' not in build_page(report, columns)


def test_a_loss_that_may_be_anything_is_given_as_not_known() -> None:
    report, columns = samples.one_wheel()
    report["intervals"][0] |= {"epsilon": {"value": 0.571, "low": 0.0, "high": 1.0}, "mode": "noisy"}
    words = " ".join(Tree(build_page(report, columns)).text.split())
    assert "ε̂ not known" in words
    assert "0.571" not in words


def test_table_and_evidence_tell_the_delay_and_what_a_fault_rests_on() -> None:
    report, columns = samples.one_wheel()
    report["intervals"][0] |= {"detected_s": 30.25, "tier": "signal", "evidence": ["wheel.drive.v stood still."]}
    words = " ".join(Tree(build_page(report, columns)).text.split())
    assert "detected +250 ms" in words
    assert "detected 250 ms after onset" in words
    assert "Rests on channel alone: wheel.drive.v" in words


def test_unlikely_explanations_are_named_without_a_bar() -> None:
    report, columns = samples.one_wheel()
    report["intervals"][0]["hypotheses"] = [
        {"side": "sensor", "mode": "stuck", "p": 0.9995},
        {"side": "sensor", "mode": "noisy", "p": 1e-300},
    ]
    text = build_page(report, columns)
    assert "Below 0.1&nbsp;%: speed sensor noisy." in text
    assert text.count('<b class="noisy"') == 0
    assert "--limit:90%" in text


def test_cells_of_stacked_tables_carry_their_headings() -> None:
    report, columns = samples.one_wheel()
    text = build_page(report, columns)
    assert '<th scope="row" data-h="Wheel">drive</th>' in text
    assert '<td data-h="Check">' in text


def test_thousands_of_faults_stay_within_the_size() -> None:
    report, columns = evidence_samples.many_faults(1500, 50_000)
    text = build_page(report, columns, max_size_mb=7.0)
    assert len(text.encode()) < 7.0e6
    tree = Tree(text)
    kinds = [a.get("class") or "" for _, a in tree.tags]
    assert kinds.count("fault") == 1500
    assert sum(k.startswith("fb ") for k in kinds) == 120
    shown = [a["data-ev"] for t, a in tree.tags if t == "article" and "data-ev" in a]
    assert len(shown) == 120
    assert all(int(str(name)[1:]) % 10 == 1 for name in shown)
    assert "that of all 1\u202f500 is in" in tree.text


def test_faults_beyond_the_table_are_counted() -> None:
    report, _ = evidence_samples.many_faults(5200, 10)
    tree = Tree(build_page(report, {}))
    assert sum(a.get("class") == "fault" for _, a in tree.tags) == 5000
    assert "200 less severe faults are not in this table" in tree.text


def test_every_column_is_in_the_page() -> None:
    report, columns = samples.one_wheel()
    columns["gnss.speed"], columns["imu.yaw_rate"] = np.ones(12_000), np.full(12_000, np.nan)
    tree = Tree(build_page(report, columns))
    view = json.loads(next(s for a, s in tree.scripts if a.get("id") == "view"))
    names = {c["name"] for c in view["channels"]}
    assert set(columns) - names == {"t", "imu.yaw_rate"}
    assert "imu.yaw_rate" in tree.text


def test_extremes_of_long_missions_are_named_and_not_drawn_as_samples() -> None:
    report, columns = samples.five_faults()
    report["log"]["rate_hz"] = 3200.0
    tree = Tree(build_page(report, columns))
    assert json.loads(next(s for a, s in tree.scripts if a.get("id") == "view"))["dt"] == pytest.approx(1 / 3200)
    assert "the smallest and largest of every 64 samples are kept" in tree.text
    assert "one mark for each sample" not in tree.text


def test_caveats_that_say_the_same_are_one_line() -> None:
    same = "judged for 6.5 s of driving, of 10 s needed."
    caveats = [f"FR speed sensor: {same}", "The log is damaged: a hole", f"FL speed sensor: {same}", "No colon here"]
    assert merged_caveats(caveats) == [
        f"FR speed sensor, FL speed sensor: {same}",
        "The log is damaged: a hole",
        "No colon here",
    ]


def test_whether_the_machine_may_go_out_again_is_said_plainly() -> None:
    report, columns = samples.not_assessed()
    assert "May it go out again? <b>No</b>, it must be checked first." in build_page(report, columns)
    report, columns = samples.five_faults()
    assert "May it go out again? <b>No</b>, not before repair." in build_page(report, columns)


def test_loss_over_the_mission_stands_with_the_coverage() -> None:
    report, columns = samples.five_faults()
    assert "Loss ε̂ over the whole mission" not in build_page(report, columns)
    epsilon = {"value": 0.123, "low": 0.1, "high": 0.15}
    first = report["coverage"][0]
    loss = [
        {"component": first["component"], "side": first["side"], "epsilon": epsilon, "seconds": 40.0, "relative": False}
    ]
    page = build_page({**report, "loss": loss}, columns)
    assert "Loss ε̂ over the whole mission" in page
    assert "0.123 (0.100 to 0.150)" in page


def test_the_paper_s_numbers_are_said_in_the_verdict_behind_its_answer() -> None:
    report, columns = samples.no_faults()
    assert 'id="assumed"' not in build_page(report, columns)
    machine = {**report["machine"], "source": "paper defaults", "assumed": ["gear ratio 17.7"]}
    page = build_page({**report, "machine": machine}, columns)
    assert page.index('id="verdict"') < page.index("<h1>") < page.index("gear ratio 17.7") < page.index('class="facts"')
    assert f"{machine['name']} (assumed)" in page


def test_a_fault_of_unclear_kind_has_the_symbol_of_none() -> None:
    """A red square says *stuck*, of which the title would not speak with a probability of 0.23."""
    report, columns = samples.one_wheel()
    clear = build_page(report, columns)
    assert "Faulty, kind unclear" not in clear
    report["intervals"][0]["hypotheses"] = [
        {"side": "sensor", "mode": "stuck", "p": 0.4},
        {"side": "sensor", "mode": "no_signal", "p": 0.35},
        {"side": "sensor", "mode": "noisy", "p": 0.25},
    ]
    text = build_page(report, columns)
    row = text.partition('<tr class="fault"')[2].partition("</tr>")[0]
    assert '<span class="ic warning"' in row
    assert "Faulty, kind unclear" in row
    assert 'class="fb warning' in text
    assert 'class="fb warning' not in clear
    assert "</svg></span>Faulty, kind unclear</span>" in text.partition('id="timeline"')[2].partition("</section>")[0]


def test_a_check_of_the_data_that_passes_with_an_effect_has_no_tick() -> None:
    report, columns = samples.no_faults()
    open_ = {"check": "Scale of speeds", "result": "not checked", "effect": "an error would not show", "ok": True}
    page = build_page({**report, "quality": [*report["quality"], open_]}, columns)  # type: ignore[typeddict-item]
    shown = {
        name: sign
        for sign, name in re.findall(
            r'class="ic (\w+)" aria-hidden="true"><svg(?:(?!<td).)*</svg></span>([^<]+)</span></td>', page
        )
    }
    assert (shown["Scale of speeds"], shown["Sample rate"]) == ("not_assessed", "healthy")
