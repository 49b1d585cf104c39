"""Small pictures of a fault's evidence that need no JavaScript: its edges sample by sample, and its course."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from diagnosis.pages.axes import Frame, label, limits
from diagnosis.pages.labels import number
from diagnosis.report.edges import Edge, time_words
from diagnosis.report.rows import Columns, Row
from diagnosis.report.thumbnail import extremes
from diagnosis.results.document import IntervalRow
from replay.arrays.runs import runs_of

Array = NDArray[np.float64]

_WIDTH = 360.0
_EDGE_HEIGHT, _COURSE_HEIGHT = 176.0, 98.0
_HEAD = 17.0
_SCALES = 44.0
_LETTER = 6.2  # width of one of bold words, at most
_STRETCHES = 150
#: Class of the line by the part that a curve plays; see `Trace`.
_STYLES = {"measured": "m", "reference": "r"}


def edge_picture(edge: Edge, fault: IntervalRow) -> Markup:
    """Samples around one edge as dots, those of the reference as ticks, with the shift beside the noise at the right.

    Parameters
    ----------
    edge : Edge
        The samples.
    fault : IntervalRow
        One of the report's intervals.
    """
    span = limits(edge.y, edge.reference, np.array(edge.shift or ()), least=8 * (edge.noise or 0.0))
    if span is None:
        return Markup("")
    room = _SCALES if edge.shift else 8.0
    frame = Frame(_WIDTH, _EDGE_HEIGHT, (float(edge.t[0]), float(edge.t[-1])), span, room, _HEAD)
    mode, onset = fault["mode"], edge.name == "onset"
    in_seconds = edge.reach >= 2.0
    parts = [
        frame.axes(*(("s", 1.0) if in_seconds else ("ms", 1e3))),
        frame.shade(fault["start_s"] - edge.at, fault["stop_s"] - edge.at, mode),
        frame.line(0.0, f"mk {mode}"),
        label(float(frame.px(0.0)) + (-4 if onset else 4), frame.top - 5, edge.name, "fin" if onset else "beg"),
        _detected(edge, fault, frame),
        _marks(edge.t, edge.reference, frame, "ref", "v5", -2.5),
        _marks(edge.t, edge.y, frame, "smp", "h0", 0.0),
        _scales(edge, frame),
    ]
    return _picture(_EDGE_HEIGHT, f"Samples around the {edge.name} of {fault['id']}", parts)


def _marks(t: Array, y: Array, frame: Frame, style: str, shape: str, down: float) -> Markup:
    """One mark for each sample."""
    use = np.isfinite(y)
    if not use.any():
        return Markup("")
    places = zip(frame.px(t[use]).tolist(), (frame.py(y[use]) + down).tolist(), strict=True)
    d = "".join(f"M{a:.1f} {b:.1f}{shape}" for a, b in places)
    return Markup(f'<path class="{style}" d="{d}"/>')


def _detected(edge: Edge, fault: IntervalRow, frame: Frame) -> Markup:
    """Line at the causal detection, or at the border a word that it came later."""
    detected = fault["detected_s"]
    if detected is None:
        return Markup("")
    at, delay = detected - edge.at, detected - fault["start_s"]
    words = f"detected +{time_words(delay)}" if delay > 0 else "detected at once"
    if frame.x[0] <= at <= frame.x[1]:
        place = float(frame.px(at))
        room = place + 4 + _LETTER * len(words) <= _WIDTH
        words_at = (
            label(place + 4, frame.top - 5, words, "beg b") if room else label(place - 4, frame.top + 9, words, "fin b")
        )
        return frame.line(at, "det") + words_at
    if edge.name == "onset" and at > 0:
        return label(frame.right, frame.top - 5, words + " →", "fin b")
    return Markup("")


def _scales(edge: Edge, frame: Frame) -> Markup:
    """Two rulers beside the samples: from where the faulty sample should have been to where it is, and ±σ there."""
    if edge.shift is None:
        return Markup("")
    a, b = (float(v) for v in frame.py(np.array(edge.shift)))
    x = frame.right + 11
    parts = [
        Markup('<path class="gap" d="M{:.1f} {:.1f}h-6m3 0V{:.1f}m-3 0h6"/>').format(x + 3, a, b),
        label(x, frame.bottom + 14, "gap", "mid"),
    ]
    if edge.noise is not None:
        low, high = (float(frame.py(edge.shift[0] + k * edge.noise)) for k in (-1, 1))
        middle = (low + high) / 2
        low, high = max(low, middle + 0.75), min(high, middle - 0.75)
        parts += [
            Markup('<rect class="sig" x="{:.1f}" y="{:.1f}" width="7" height="{:.1f}"/>').format(
                x + 14, high, low - high
            ),
            label(x + 18, frame.bottom + 14, "±σ", "mid"),
        ]
    return Markup("").join(parts)


def course_picture(row: Row, fault: IntervalRow, columns: Columns, axis: tuple[float, float]) -> Markup:
    """One row of a figure around its fault, as extremes per stretch; empty where it holds no sample there.

    Parameters
    ----------
    row : Row
        From `diagnosis.report.plot_rows.course_rows`.
    fault : IntervalRow
        One of the report's intervals.
    columns : Columns
        Whole columns, those of the row among them.
    axis : tuple[float, float]
        Time of the first sample and sample time [s].
    """
    start, step = axis
    size = len(columns[row.traces[0].column])
    pad = max(0.5, 0.35 * (fault["stop_s"] - fault["start_s"]))
    first = max(0, int((fault["start_s"] - pad - start) / step))
    last = min(size, int((fault["stop_s"] + pad - start) / step) + 2)
    if last - first < 2:
        return Markup("")
    count = min(_STRETCHES, last - first)
    curves = [(_STYLES[t.role], *_scaled(extremes(columns[t.column][first:last], count), t.scale)) for t in row.traces]
    band = None if row.threshold is None else extremes(columns[row.threshold][first:last], count)[1] * row.band_scale
    values = [v for _, low, high in curves for v in (low, high)] + ([] if band is None else [band, -band])
    span = row.limits or limits(*values)
    if span is None:
        return Markup("")
    frame = Frame(_WIDTH, _COURSE_HEIGHT, (start + first * step, start + last * step), span)
    t = start + (first + (np.arange(count) + 0.5) * (last - first) / count) * step
    parts = [frame.axes("s"), frame.shade(fault["start_s"], fault["stop_s"], fault["mode"])]
    if band is not None:
        parts.append(_band(t, band, frame))
    parts += [_curve(t, low, high, frame, style) for style, low, high in curves]
    if row.level is not None:
        y = float(frame.py(row.level))
        parts.append(Markup('<path class="lim" d="M{:.1f} {:.1f}H{:.1f}"/>').format(frame.left, y, frame.right))
        parts.append(label(frame.right, y + 11, f"limit {number(row.level)}", "fin"))
    return _picture(_COURSE_HEIGHT, f"{row.title} around {fault['id']}", parts)


def _scaled(both: tuple[Array, Array], scale: float) -> tuple[Array, Array]:
    return both[0] * scale, both[1] * scale


def _curve(t: Array, low: Array, high: Array, frame: Frame, style: str) -> Markup:
    """Line through the extremes of each stretch, broken where a stretch is empty."""
    out, pen = [], "M"
    for x, a, b in zip(*(v.tolist() for v in (frame.px(t), frame.py(low), frame.py(high))), strict=True):
        if not math.isfinite(a):
            pen = "M"
            continue
        out.append(f"{pen}{x:.1f} {a:.1f}" + (f"V{b:.1f}" if abs(a - b) >= 0.1 or pen == "M" else ""))
        pen = "L"
    d = "".join(out)
    return Markup(f'<path class="{style}" d="{d}"/>')


def _band(t: Array, half: Array, frame: Frame) -> Markup:
    """Area within the threshold, in one piece for each stretch of time that has one."""
    out = []
    for a, b in runs_of(np.isfinite(half)):
        x, top, low = (v.tolist() for v in (frame.px(t[a:b]), frame.py(half[a:b]), frame.py(-half[a:b])))
        upper = "L".join(f"{p:.1f} {q:.1f}" for p, q in zip(x, top, strict=True))
        lower = "L".join(f"{p:.1f} {q:.1f}" for p, q in zip(x[::-1], low[::-1], strict=True))
        out.append(f"M{upper}L{lower}Z")
    d = "".join(out)
    return Markup(f'<path class="band" d="{d}"/>')


def _picture(height: float, name: str, parts: list[Markup]) -> Markup:
    return Markup('<svg class="panel" viewBox="0 0 {:.0f} {:.0f}" role="img" aria-label="{}">{}</svg>').format(
        _WIDTH, height, name, Markup("").join(parts)
    )
