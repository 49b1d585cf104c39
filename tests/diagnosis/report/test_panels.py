from __future__ import annotations

import re

import numpy as np

from diagnosis.pages.axes import Frame, limits, ticks
from diagnosis.report.edges import Edge
from diagnosis.report.panels import course_picture, edge_picture
from diagnosis.report.rows import Row, Trace
from tests import report_samples as samples

FAULT = samples.fault(start_s=5.0, stop_s=6.0, detected_s=5.02)
RESIDUAL = Row(
    "residual", "Residual", "m/s", (Trace("residual", "residual", "measured"),), threshold="threshold", level=0.05
)
T = np.arange(-30, 31) * 0.005


def edge(y: np.ndarray) -> Edge:
    return Edge("onset", T, y, np.full(T.size, np.nan), 5.0, 0.005, (1.0, 0.5), 0.5, 0.01)


def test_one_dot_for_each_sample_and_none_in_a_gap() -> None:
    y = np.where(T < 0, 1.0, 0.5)
    y[40:45] = np.nan
    text = edge_picture(edge(y), FAULT)
    (dots,) = re.findall(r'class="smp" d="([^"]*)"', text)
    assert dots.count("M") == dots.count("h0") == 56
    assert 'class="ref"' not in text
    assert "detected +20 ms" in text


def test_detection_outside_the_window_and_at_once() -> None:
    y = np.ones(T.size)
    assert "detected +2 s →" in edge_picture(edge(y), {**FAULT, "detected_s": 7.0})
    assert "detected at once" in edge_picture(edge(y), {**FAULT, "detected_s": 5.0})
    assert "detected" not in edge_picture(edge(y), {**FAULT, "detected_s": None})


def test_no_samples_no_picture() -> None:
    assert edge_picture(Edge("onset", T, T * np.nan, T * np.nan, 5.0, 0.005, None, np.nan, None), FAULT) == ""
    nothing = {name: np.full(2000, np.nan) for name in ("residual", "threshold")}
    assert course_picture(RESIDUAL, FAULT, nothing, (0.0, 0.005)) == ""


def test_course_breaks_at_gaps_and_shows_band_and_limit() -> None:
    residual = np.zeros(2000)
    residual[1050:1100] = np.nan
    threshold = np.full(2000, 0.1)
    threshold[1150:1250] = np.nan
    text = course_picture(RESIDUAL, FAULT, {"residual": residual, "threshold": threshold}, (0.0, 0.005))
    (line,) = re.findall(r'class="m" d="([^"]*)"', text)
    (band,) = re.findall(r'class="band" d="([^"]*)"', text)
    assert line.count("M") == 2
    assert band.count("Z") == 2
    assert "limit 0.05" in text


def test_ticks_are_round_and_few() -> None:
    assert ticks(-150.0, 150.0, 5) == [-100.0, 0.0, 100.0]
    assert ticks(0.0, 1.0, 4) == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert ticks(2.0, 2.0, 4) == [2.0]


def test_range_has_a_least_height() -> None:
    low, high = limits(np.array([1.0, np.nan, 1.0]), least=0.4) or (0.0, 0.0)
    np.testing.assert_allclose([low, high], [0.8, 1.2])
    assert limits(np.array([np.nan])) is None


def test_places() -> None:
    frame = Frame(100.0, 50.0, (0.0, 10.0), (0.0, 1.0))
    assert (float(frame.px(0.0)), float(frame.px(10.0))) == (frame.left, frame.right)
    assert (float(frame.py(-5.0)), float(frame.py(2.0))) == (frame.bottom, frame.top)


def test_the_word_at_a_late_detection_is_not_cut_off() -> None:
    late = edge_picture(edge(np.ones(T.size)), {**FAULT, "detected_s": 5.14})
    assert re.search(r'class="fin b"[^>]*>detected \+140 ms<', late)
    early = edge_picture(edge(np.ones(T.size)), FAULT)
    assert re.search(r'class="beg b"[^>]*>detected \+20 ms<', early)
