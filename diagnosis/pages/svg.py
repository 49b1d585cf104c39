"""Pictures that need no JavaScript: symbols, thumbnails of faults and the driven path."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

from diagnosis.pages.labels import number
from diagnosis.results.document import IntervalRow
from diagnosis.results.fault_rows import LOOKS

_LINE = 'fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" stroke-linejoin="round"'
#: Symbol of what is no state.
_WARNING = f'<path d="M6 2v4.6M6 9.6v.2" {_LINE}/>'
_MARKS = 24
_UNKNOWN = f'<path d="M3.6 4a2.4 2.2 0 1 1 3.4 2c-.8.4-1 .8-1 1.4M6 10v.1" {_LINE}/>'


def _glyph(state: str) -> Markup:
    look = LOOKS.get(state)
    shape = _WARNING if state == "warning" else "" if look is None else look.glyph
    return Markup(shape or _UNKNOWN)


def icon(state: str) -> Markup:
    """Symbol of a state for running text; decoration only, its words stand beside it."""
    shape = '<span class="ic {}" aria-hidden="true"><svg viewBox="0 0 12 12">{}</svg></span>'
    return Markup(shape).format(state, _glyph(state))


def badge(state: str, x: float, y: float, size: float) -> Markup:
    """Symbol of a state inside another picture, centred at (x, y)."""
    inner = size * 0.6 / 12
    return Markup(
        '<g class="bg {}" transform="translate({:.1f},{:.1f})"><rect width="{:.1f}" height="{:.1f}" rx="{:.1f}"/>'
        '<g class="gl" transform="translate({:.1f},{:.1f}) scale({:.2f})">{}</g></g>'
    ).format(state, x - size / 2, y - size / 2, size, size, size / 4, size * 0.2, size * 0.2, inner, _glyph(state))


def extremes(y: NDArray[np.floating], count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Smallest and largest value in each of `count` stretches of a series; NaN where a stretch is empty."""
    edges = np.linspace(0, len(y), count + 1).astype(int)
    starts = np.minimum(edges[:-1], len(y) - 1)
    low = np.fmin.reduceat(y.astype(np.float64), starts)
    high = np.fmax.reduceat(y.astype(np.float64), starts)
    return low, high


def _polyline(low: NDArray[np.float64], high: NDArray[np.float64], height: float, bottom: float, top: float) -> str:
    scale = (height - 6) / (top - bottom if top > bottom else 1.0)
    out, pen = [], "M"
    for k, (a, b) in enumerate(zip(low, high, strict=True)):
        if not math.isfinite(a):
            pen = "M"
            continue
        ya, yb = height - 3 - (a - bottom) * scale, height - 3 - (b - bottom) * scale
        first, second = (ya, yb) if k % 2 else (yb, ya)
        out.append(f"{pen}{k + 1},{first:.1f}")
        if abs(ya - yb) >= 0.05 or pen == "M":
            out.append(f"L{k + 1},{second:.1f}")
        pen = "L"
    return "".join(out)


def thumbnail(
    fault: IntervalRow,
    measured: NDArray[np.floating],
    commanded: NDArray[np.floating] | None,
    start: float,
    step: float,
) -> Markup:
    """Measured (dark) and commanded (grey) around one fault, its interval shaded.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    measured, commanded : NDArray[np.floating], shape (n,)
        Whole columns.
    start, step : float
        Time of the first sample and sample time [s].
    """
    width, height = 104, 36
    pad = max(0.5, 0.5 * (fault["stop_s"] - fault["start_s"]))
    first = max(0, int((fault["start_s"] - pad - start) / step))
    last = min(len(measured), int((fault["stop_s"] + pad - start) / step) + 2)
    if last - first < 2:
        return Markup("")
    curves = [extremes(c[first:last], width - 2) for c in (commanded, measured) if c is not None]
    values = np.concatenate([v[np.isfinite(v)] for pair in curves for v in pair])
    if not len(values):
        return Markup("")
    bottom, top = float(values.min()), float(values.max())
    paths = [_polyline(low, high, height, bottom, top) for low, high in curves]
    seconds = (last - first) * step
    x0, x1 = (
        1 + (width - 2) * min(1.0, max(0.0, (fault[k] - start - first * step) / seconds)) for k in ("start_s", "stop_s")
    )
    extra = Markup('<path class="cmd" d="{}"/>').format(paths[0]) if commanded is not None else Markup("")
    return Markup(
        '<svg class="spark" viewBox="0 0 {w} {h}" role="img" aria-label="Signal around {id}">'
        '<rect class="f {m}" x="{x:.1f}" y="0" width="{d:.1f}" height="{h}"/>'
        '<rect class="e {m}" x="{x:.1f}" y="0" width="{d:.1f}" height="2.5"/>{extra}<path class="sig" d="{p}"/></svg>'
    ).format(w=width, h=height, id=fault["id"], m=fault["mode"], x=x0, d=max(1.5, x1 - x0), extra=extra, p=paths[-1])


def _path_d(x: NDArray[np.floating], y: NDArray[np.floating]) -> str:
    out, pen = [], "M"
    for a, b in zip(x, y, strict=True):
        if math.isfinite(a) and math.isfinite(b):
            out.append(f"{pen}{a:.1f},{b:.1f}")
            pen = "L"
        else:
            pen = "M"
    return "".join(out)


def path_picture(
    x: NDArray[np.floating], y: NDArray[np.floating], start: float, step: float, faults: Sequence[IntervalRow]
) -> Markup:
    """Driven path coloured by fault, equal axes, with a scale bar; empty where no position is known.

    The first faults are named on it.

    Parameters
    ----------
    x, y : NDArray[np.floating], shape (n,)
        Position [m], x to the right and y up in the picture.
    start, step : float
        Time of the first sample and sample time [s].
    faults : Sequence[IntervalRow]
        The report's intervals.
    """
    width, height, margin = 420.0, 300.0, 26.0
    good = np.isfinite(x) & np.isfinite(y)
    if good.sum() < 2:
        return Markup("")
    left, right = float(x.min(where=good, initial=np.inf)), float(x.max(where=good, initial=-np.inf))
    low, high = float(y.min(where=good, initial=np.inf)), float(y.max(where=good, initial=-np.inf))
    scale = min((width - 2 * margin) / max(right - left, 1e-3), (height - 2 * margin - 14) / max(high - low, 1e-3))
    px = (width - (right - left) * scale) / 2 + (x - left) * scale
    py = (height - 14 + (high - low) * scale) / 2 - (y - low) * scale
    every = max(1, len(x) // 1500)
    parts = [Markup('<path class="track" d="{}"/>').format(_path_d(px[::every], py[::every]))]
    marks: list[tuple[IntervalRow, list[float]]] = []
    for fault in faults:
        a = max(0, int((fault["start_s"] - start) / step))
        b = min(len(x), max(a + 2, int((fault["stop_s"] - start) / step) + 1))
        every = max(1, (b - a) // 400)
        d = _path_d(px[a:b:every], py[a:b:every])
        if not d:
            continue
        parts.append(Markup('<path class="leg {}" d="{}"/>').format(fault["mode"], d))
        if len(marks) >= _MARKS:
            continue
        here = np.flatnonzero(good[a:b]) + a
        middle = int(here[len(here) // 2])
        marks.append((fault, [float(px[middle]), float(py[middle])]))
    _spread([m[1] for m in marks], width, height)
    for fault, (cx, cy) in marks:
        parts.append(
            Markup(
                '<g class="mark {m}" data-f="{id}" data-scroll role="button" tabindex="0" aria-label="{id} on the path"'
                ' transform="translate({x:.1f},{y:.1f})"><circle class="area" r="20"/><circle class="ring" r="12"/><text y="3.6">{id}</text>{b}</g>'
            ).format(m=fault["mode"], id=fault["id"], x=cx, y=cy, b=badge(fault["mode"], 10, -9, 11))
        )
    first, last = np.flatnonzero(good)[[0, -1]].tolist()
    ends = [(float(px[k]), float(py[k])) for k in (first, last)]
    parts.append(_ends_and_scale(ends[0], ends[1], [m[1] for m in marks], scale, width, height))
    return Markup(
        '<svg class="map" viewBox="0 0 {} {}" role="group" aria-label="Driven path with the places of faults">{}</svg>'
    ).format(int(width), int(height), Markup("").join(parts))


def _ends_and_scale(
    start: tuple[float, float],
    end: tuple[float, float],
    marks: Sequence[Sequence[float]],
    scale: float,
    width: float,
    height: float,
) -> Markup:
    """Start (a dot) and end (a square) of the path, and a bar of a round length in metres."""
    bar = 10.0 ** math.floor(math.log10(max(width / 3 / scale, 1e-6)))
    bar *= max(m for m in (1, 2, 5) if m * bar * scale <= width / 3)
    right, length = width - 16, bar * scale
    near = math.hypot(end[0] - start[0], end[1] - start[1]) < 30
    shapes = Markup('<circle class="dot" cx="{:.1f}" cy="{:.1f}" r="4.5"/>').format(*start)
    shapes += Markup('<rect class="stop" x="{:.1f}" y="{:.1f}" width="8" height="8"/>').format(end[0] - 4, end[1] - 4)
    named = [(start, "start, end")] if near else [(start, "start"), (end, "end")]
    for place, words in named:
        shapes += _named(*place, words, marks, width, height)
    shapes += Markup('<path class="bar" d="M{:.1f},{:.0f}v4h{:.1f}v-4"/>').format(right - length, height - 12, length)
    return shapes + text(right - length / 2, height - 14, f"{number(bar)} m", "lbl mid")


def _named(x: float, y: float, words: str, marks: Sequence[Sequence[float]], width: float, height: float) -> Markup:
    """Name beside a place, inside the picture and as far from the marks as it can be."""
    length = 6.2 * len(words)
    corners = [(side, y + down) for side in (1, -1) for down in (15, -8)]
    fits = [(s, v) for s, v in corners if 4 < x + s * (9 + length) < width - 4 and 12 < v < height - 18] or corners

    def room(corner: tuple[int, float]) -> float:
        centre = x + corner[0] * (9 + length / 2)
        return min((math.hypot((centre - m[0]) / 1.5, corner[1] - 4 - m[1]) for m in marks), default=0.0)

    side, v = max(fits, key=room)
    return text(x + 9 * side, v, words, "lbl" if side > 0 else "lbl fin")


def _spread(points: list[list[float]], width: float, height: float) -> None:
    """Push labels apart until none overlaps (in place)."""
    for _ in range(120):
        moved = False
        for i, p in enumerate(points):
            for q in points[i + 1 :]:
                dx, dy = q[0] - p[0], q[1] - p[1]
                gap = math.hypot(dx, dy)
                if gap < 27:
                    ux, uy = (dx / gap, dy / gap) if gap > 0.1 else (0.8, 0.6)
                    p[0], p[1], q[0], q[1] = p[0] - ux, p[1] - uy, q[0] + ux, q[1] + uy
                    moved = True
        for p in points:
            p[0], p[1] = min(width - 12, max(12, p[0])), min(height - 30, max(12, p[1]))
        if not moved:
            return


def text(x: float, y: float, words: str, style: str) -> Markup:
    """Text inside a picture; `words` may come from a log."""
    return Markup('<text x="{:.1f}" y="{:.1f}" class="{}">{}</text>').format(x, y, style, escape(words))
