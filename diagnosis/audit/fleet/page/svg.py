"""Pictures of the fleet page that need no JavaScript: symbols used many times, sparklines, and trends of ε̂."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from scipy.special import stdtrit

from diagnosis.audit.fleet.trend_types import ChangePointRow, ForecastRow, LineRow, TrendRow
from diagnosis.audit.fleet.words import share
from diagnosis.pages.axes import Frame, label
from diagnosis.pages.svg import icon
from replay.faults import FaultMode, State

#: Modes and states in the legend of the machines.
LEGEND: tuple[str, ...] = (*FaultMode, State.HEALTHY, State.NOT_ASSESSED)
_SYMBOLS = (*LEGEND[:-1], "warning", LEGEND[-1])
_WIDTH, _HEIGHT = 420.0, 190.0
_MOST_POINTS = 150
_SPARK = 60

Array = NDArray[np.float64]


def sprite() -> Markup:
    """Every symbol once; `mark` refers to them."""
    parts = []
    for state in _SYMBOLS:
        glyph = str(icon(state)).partition('viewBox="0 0 12 12">')[2].partition("</svg>")[0]
        parts.append(Markup('<symbol id="g-{}" viewBox="0 0 12 12">{}</symbol>').format(state, Markup(glyph)))
    return Markup('<svg class="sprite" aria-hidden="true">{}</svg>').format(Markup("").join(parts))


def mark(state: str) -> Markup:
    """Symbol of a state; decoration only, its words stand beside it."""
    return Markup('<span class="ic {0}" aria-hidden="true"><svg><use href="#g-{0}"/></svg></span>').format(state)


def sparkline(trend: TrendRow) -> Markup:
    """Values of a trend and its limit in little room; those whose bounds reach from nothing beyond the limit say nothing, but for the last."""
    points = np.array([p[2:5] for p in trend["points"]], dtype=np.float64)
    points = points[::-1][:: max(1, math.ceil(len(points) / _SPARK))][::-1]
    known = ~((points[:, 1] <= 0.0) & (points[:, 2] >= trend["limit"]))
    known[-1] = True
    values = points[known, 0]
    width, height = 96.0, 26.0
    top = max(float(values.max()), trend["limit"], 1e-3)
    low = min(0.0, float(values.min()))
    x = 2 + (width - 4) * np.flatnonzero(known) / max(1, known.size - 1)
    y = height - 3 - (height - 6) * (values - low) / (top - low)
    limit = height - 3 - (height - 6) * (trend["limit"] - low) / (top - low)
    d = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True))
    return Markup(
        '<svg class="tl" viewBox="0 0 96 26" aria-hidden="true"><path class="lim" d="M0 {:.1f}H96"/><path class="sig" d="M{}"/>'
        '<circle cx="{:.1f}" cy="{:.1f}" r="2.2"/></svg>'
    ).format(limit, d, float(x[-1]), float(y[-1]))


def physical(trend: TrendRow) -> tuple[float, float]:
    """Least and largest value that a line can mean: ε is 0 to 1; estimates of a loss may lie somewhat below 0."""
    return min(0.0, *(p[2] for p in trend["points"])), 1.0


def trend_picture(trend: TrendRow, title: str, unit: str) -> Markup:
    """Estimates with 95 % bounds, the last stretch's line with its 90 % band, and where that meets the limit.

    Parameters
    ----------
    trend : TrendRow
        One of the document's trends.
    title : str
        What it is, for those who do not see it.
    unit : str
        Unit of the axis.
    """
    every = max(1, math.ceil(len(trend["points"]) / _MOST_POINTS))
    points = np.array([p[1:] for p in trend["points"]], dtype=np.float64)
    now, limit, f = trend["now"], trend["limit"], trend["forecast"]
    ahead = next((v for v in (f["latest"], f["likely"], f["soonest"]) if v is not None), 0.0)
    end = max(now + min(1.15 * ahead, f["horizon"]), 1.06 * now, 1e-9)
    values = points[:, 1]
    high = max(limit, float(values.max()), min(1.0, float(np.percentile(points[:, 3], 90))))
    low = min(0.0, float(values.min()))
    if trend["line"] is not None and f["state"] != "not_known":  # with the line as far as it goes by now, not ahead
        high = max(high, min(1.0, trend["line"]["level"]["high"]))
    frame = Frame(_WIDTH, _HEIGHT, (0.0, end), (low - 0.04 * (high - low), high + 0.1 * (high - low)), margin=10.0)
    parts = [frame.axes(unit, percent=True)]
    y = float(frame.py(limit))
    parts.append(Markup('<path class="lim" d="M{:.1f} {:.1f}H{:.1f}"/>').format(frame.left, y, frame.right))
    below = float(values[0]) > limit and y < frame.bottom - 14  # beside the line where no mission stands
    parts.append(label(frame.left + 4, y + 12 if below else y - 4, f"limit {share(limit)}", "lbl"))
    if now < end * 0.995:
        parts.append(frame.line(now, "now"))
    parts += [_change(frame, points, c) for c in trend["changes"]]
    if trend["line"] is not None and f["state"] != "not_known":  # no line where the words tell none
        parts += _line(frame, trend, trend["line"], points, end)
    parts += _points(frame, points, trend["outliers"], every)
    if f["state"] == "crossing":
        parts.append(_crossing(frame, limit, now, f, end))
    words = f"{title}: {len(points)} missions; {f['words']}"
    return Markup('<svg class="trend" viewBox="0 0 {:.0f} {:.0f}" role="img" aria-label="{}">{}</svg>').format(
        _WIDTH, _HEIGHT, words, Markup("").join(parts)
    )


def _change(frame: Frame, points: Array, change: ChangePointRow) -> Markup:
    k = change["index"]
    place = 0.5 * (points[k - 1, 0] + points[k, 0]) if k else points[0, 0]
    sign = {"drop": "↓", "rise": "↑"}.get(change["kind"], "∠")
    x = float(frame.px(place))
    return frame.line(float(place), "chg") + label(x + 3, frame.top + 10, sign, "lbl")


def _points(frame: Frame, points: Array, outliers: Sequence[int], every: int) -> list[Markup]:
    shown = np.arange(len(points))[::-1][::every][::-1]
    x, y = frame.px(points[:, 0]), [frame.py(points[:, k]) for k in (1, 2, 3)]
    bars = "".join(f"M{x[k]:.1f} {y[1][k]:.1f}V{y[2][k]:.1f}" for k in shown)
    dots = "".join(f"M{x[k]:.1f} {y[0][k]:.1f}h0" for k in shown if k not in outliers)
    odd = "".join(f"M{x[k] - 3:.1f} {y[0][k] - 3:.1f}l6 6m0-6l-6 6" for k in outliers)
    out = [Markup('<path class="bar" d="{}"/>').format(bars), Markup('<path class="pt" d="{}"/>').format(dots)]
    return [*out, Markup('<path class="odd" d="{}"/>').format(odd)] if odd else out


def _line(frame: Frame, trend: TrendRow, line: LineRow, points: Array, end: float) -> list[Markup]:
    """Line and band of the last stretch; dashed from now on."""
    now, first = trend["now"], trend["first"]
    begin = float(points[first, 0])
    x = np.linspace(begin, end, 40)
    level, slope, centre = line["level"], line["slope"], line["centre"]
    spread, half = slope["high"] - slope["value"], level["high"] - level["value"]
    scale = float(stdtrit(line["dof"], 0.95) / stdtrit(line["dof"], 0.975))  # from 95 % to 90 %
    inside = half**2 + spread**2 * ((x - centre) ** 2 - (now - centre) ** 2)
    band = scale * np.sqrt(np.maximum(inside, 0.0))
    middle = level["value"] + slope["value"] * (x - now)
    least, most = physical(trend)
    least, most = max(least, frame.y[0]), min(most, frame.y[1])
    px, upper, lower = (
        frame.px(x),
        frame.py(np.clip(middle + band, least, most)),
        frame.py(np.clip(middle - band, least, most)),
    )
    path = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip([*px, *px[::-1]], [*upper, *lower[::-1]], strict=True))
    out = [Markup('<path class="band" d="M{}Z"/>').format(path)]
    for style, a, b in (("fit", begin, now), ("fit far", now, end)):
        within = _within(a, b, (level["value"] - slope["value"] * now, slope["value"]), least, most)
        if within is not None:
            (x0, y0), (x1, y1) = ((float(frame.px(v)), float(frame.py(w))) for v, w in within)
            out.append(Markup('<path class="{}" d="M{:.1f} {:.1f}L{:.1f} {:.1f}"/>').format(style, x0, y0, x1, y1))
    return out


def _within(
    a: float, b: float, line: tuple[float, float], least: float, most: float
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Ends of a line (its value at 0, its slope) from a to b as far as it lies between two values; None where it does not."""
    at, slope = line
    if slope:
        first, last = sorted(((least - at) / slope, (most - at) / slope))
        a, b = max(a, first), min(b, last)
    elif not least <= at <= most:
        return None
    return ((a, at + slope * a), (b, at + slope * b)) if b > a else None


def _crossing(frame: Frame, limit: float, now: float, f: ForecastRow, end: float) -> Markup:
    """Bar on the limit from the soonest to the latest crossing, open where that is not known, with the likely one."""
    y, a = float(frame.py(limit)), float(frame.px(now + (f["soonest"] or 0.0)))
    b = float(frame.px(min(end, now + f["latest"]))) if f["latest"] is not None else frame.right
    out = Markup('<path class="when{}" d="M{:.1f} {:.1f}H{:.1f}"/>').format(
        "" if f["latest"] is not None else " open", a, y, b
    )
    if f["likely"] is not None and now + f["likely"] <= end:
        out += Markup('<circle class="when" cx="{:.1f}" cy="{:.1f}" r="3.5"/>').format(
            float(frame.px(now + f["likely"])), y
        )
    return out
