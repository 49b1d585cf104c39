"""Figures of a diagnosis: the page's rows, drawn with plotly."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import mfhca
from diagnosis.api.figure_style import COLOURS, STYLES, colour_of
from diagnosis.api.series import Series
from diagnosis.report.plot_rows import fault_rows
from diagnosis.results.machine_words import words_of
from diagnosis.results.result import Closeups
from replay.faults import State

ROOT = Path(__file__).parents[3]


def test_timeline_has_a_lane_for_every_part(result: mfhca.Diagnosis) -> None:
    figure: Any = result.plot()
    lanes = {lane for trace in figure.data for lane in trace.y}
    assert len(lanes) == len(result.coverage)
    assert "FR speed sensor" in lanes
    stuck = next(trace for trace in figure.data if trace.name == "Stuck")
    assert "F1" in stuck.text
    assert list(figure.layout.xaxis.range) == [0.0, 18.0]


def test_evidence_of_a_fault_is_that_of_the_page(result: mfhca.Diagnosis) -> None:
    report, first = result.report, result.report["intervals"][0]
    figure: Any = result.plot_fault("F1", margin_s=1.0)
    series = Series(report, result.columns)
    rows = fault_rows(
        first,
        report["machine"]["wheels"],
        series.columns,
        words_of(report["machine"]),
        report["limits"]["min_probability"],
    )
    titles = [a.text for a in figure.layout.annotations if a.xref == "paper"]
    assert titles[: len(rows)] == [f"{row.title} ({row.unit})" for row in rows]
    assert list(figure.layout.xaxis.range) == [first["start_s"] - 1, first["stop_s"] + 1]
    measured = next(trace for trace in figure.data if trace.name == "measured")
    inside = (measured.x >= first["start_s"]) & (measured.x < first["stop_s"])
    assert_array_equal(
        measured.y[inside], result.signals["wheel.FR.v"].to_numpy()[np.isin(result.signals.index, measured.x[inside])]
    )
    assert len({trace.legend for trace in figure.data}) == len(rows)


def test_groups_of_the_loop_and_columns(result: mfhca.Diagnosis) -> None:
    figure: Any = result.plot("speed", "cmd.v", start_s=2, stop_s=4)
    assert sum(a.xref == "paper" for a in figure.layout.annotations) >= 5
    assert all(trace.x.min() >= 2 and trace.x.max() <= 4.01 for trace in figure.data)
    angle: Any = result.plot("steer.front.phi")
    assert "°" in angle.layout.annotations[0].text
    assert_array_equal(angle.data[0].y, np.degrees(result.signals["steer.front.phi"]))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: r.plot("nothing"), "'nothing' is not known; this result has the groups speed, drive, steering, psi"),
        (lambda r: r.plot(start_s=5, stop_s=4), "stop_s must be later"),
        (lambda r: r.plot_fault("F99"), "no fault 'F99'; this result has F1"),
        (lambda r: r.plot_fault("F1", margin_s=-1), "expected 0 s or more"),
    ],
)
def test_what_cannot_be_drawn_is_said(result: mfhca.Diagnosis, call: Any, words: str) -> None:
    with pytest.raises(mfhca.ConfigError, match=words):
        call(result)


def test_many_samples_become_extremes_and_no_spike_is_lost(result: mfhca.Diagnosis) -> None:
    n = 100_000
    values = np.sin(np.arange(n) / 500)
    values[54_321] = 9.0
    report: Any = {**result.report, "log": {**result.report["log"], "rate_hz": 1000.0}, "intervals": []}
    series = Series(report, {"t": np.arange(n) / 1000, "x": values})
    thin = series.curve("x", (0.0, 100.0), 2.0, 1000)
    assert len(thin.t) == len(thin.y) <= 1000
    assert thin.stride > 1
    assert thin.y.max() == 18.0
    whole = series.curve("x", (54.0, 54.5), 1.0, 1000)
    assert (whole.stride, len(whole.t)) == (1, 501)


def test_closeups_stand_for_the_extremes_around_them(result: mfhca.Diagnosis) -> None:
    per, rows = 4, 100  # two rows for every four samples at 1 kHz
    report: Any = {**result.report, "log": {**result.report["log"], "rate_hz": 1000.0}, "intervals": []}
    t = np.arange(rows) * per / 2 / 1000
    step = np.arange(40, 60)
    series = Series(report, {"t": t, "x": np.zeros(rows)}, Closeups(step, {"x": np.arange(20.0)}))
    near = series.curve("x", (0.040, 0.0585), 1.0, 1000)
    assert near.stride == 1
    assert_allclose(near.t * 1000, step)
    assert_array_equal(near.y, np.arange(20.0))
    every = series.curve("x", (0.0, 1.0), 1.0, 1000)
    assert every.stride == per
    assert len(every.t) == rows - 10 + 20
    assert (np.diff(every.t) > 0).all()


def test_colours_and_styles_are_the_pages(result: mfhca.Diagnosis) -> None:
    css = (ROOT / "diagnosis" / "pages" / "style.css").read_text(encoding="utf-8").split("[data-theme=dark]")[0]
    assert {name: f"#{re.search(rf'--{name}: #([0-9a-f]+);', css)[1]}" for name in COLOURS} == COLOURS  # type: ignore[index]
    script = (ROOT / "diagnosis" / "report" / "assets" / "figure_looks.js").read_text(encoding="utf-8")
    for role, (colour, width, dash) in STYLES.items():
        drawn = re.search(rf'{role}: {{ colour: "([\w-]+)", width: ([\d.]+)(?:, dash: "(\w+)")?', script)
        assert drawn is not None
        assert (colour, width, dash) == (
            COLOURS.get(drawn[1]) or colour_of(drawn[1]),
            float(drawn[2]),
            drawn[3] or "solid",
        )
    assert all(re.fullmatch(r"#[0-9a-f]{6}", colour_of(state)) for state in State)


def test_a_result_without_time_series_says_so(result: mfhca.Diagnosis) -> None:
    bare = mfhca.Diagnosis(replace(result._result, columns={}))
    assert bare.plot() is not None
    with pytest.raises(mfhca.ConfigError, match="no time series of F1 was kept"):
        bare.plot_fault("F1")


def test_names_from_logs_are_shown_verbatim(result: mfhca.Diagnosis) -> None:
    report = result.report
    files = [{**report["log"]["files"][0], "path": "<b>%{y}</b>.mcap"}]
    odd: Any = {**report, "log": {**report["log"], "files": files}}
    figure: Any = mfhca.Diagnosis(replace(result._result, report=odd)).plot("cmd.v")
    assert figure.layout.title.text.startswith("&lt;b&gt;&#37;{y}&lt;/b&gt;.mcap<br>")


def test_thousands_of_faults_are_not_all_shaded(result: mfhca.Diagnosis) -> None:
    first = result.report["intervals"][0]
    many = [{**first, "id": f"F{i}", "start_s": i * 0.01, "stop_s": i * 0.01 + 0.005} for i in range(1, 1501)]
    crowded: Any = {**result.report, "intervals": many}
    figure: Any = mfhca.Diagnosis(replace(result._result, report=crowded)).plot("speed")
    assert "the 100 most severe of 1500 faults are shaded" in figure.layout.title.text
    assert len(figure.layout.shapes) == 100  # of one wheel, in its own row
