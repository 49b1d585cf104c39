"""Picture of the driven path with the places of the faults."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from diagnosis.pages.labels import number
from diagnosis.pages.svg import badge, text
from diagnosis.results.candidates import symbol_of
from diagnosis.results.document import IntervalRow

_MARKS = 24


def unnamed_words(faults: Sequence[IntervalRow]) -> str:
    """That a path names the first faults alone, to follow the words on where it comes from; empty where it names all."""
    left = len(faults) - _MARKS
    if left <= 0:
        return ""
    more = "the other is" if left == 1 else f"the other {left} are"
    return f". Named are the {_MARKS} most severe of {len(faults)} faults drawn; {more} coloured without a name"


def _path_d(x: NDArray[np.floating], y: NDArray[np.floating]) -> str:
    out, pen = [], "M"
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        if math.isfinite(a) and math.isfinite(b):
            out.append(f"{pen}{a:.1f},{b:.1f}")
            pen = "L"
        else:
            pen = "M"
    return "".join(out)


def _runs(good: NDArray[np.bool_]) -> str:
    """Index of the first point of each stretch of a path without a gap, as the page's scripts read it."""
    return " ".join(str(i) for i in np.flatnonzero(np.diff(good.astype(np.int8), prepend=0) == 1))


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
    times = f"{start:.10g} {every * step:.10g} {_runs(good[::every])}"
    parts = [Markup('<path class="track" data-times="{}" d="{}"/>').format(times, _path_d(px[::every], py[::every]))]
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
                '<g class="mark {m}" data-f="{id}" role="button" tabindex="0" aria-label="{id} on the path"'
                ' transform="translate({x:.1f},{y:.1f})"><circle class="area" r="20"/><circle class="ring" r="12"/><text y="3.6">{id}</text>{b}</g>'
            ).format(m=symbol_of(fault), id=fault["id"], x=cx, y=cy, b=badge(symbol_of(fault), 10, -9, 11))
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
