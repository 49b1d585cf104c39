"""Thumbnail of a fault: its channel and the command around it."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from diagnosis.results.document import IntervalRow


def extremes(y: NDArray[np.floating], count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Smallest and largest value in each of `count` stretches of a series; NaN where a stretch is empty.

    From shape (n,) to two of shape (count,).
    """
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
