"""Plots of an evaluation that need no JavaScript: distributions of times and reliability diagrams."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from markupsafe import Markup

from diagnosis.evaluation.document import ProbabilityBin
from diagnosis.pages.labels import span
from diagnosis.pages.svg import text

_DECADES = (-3, -2, -1, 0, 1)  # 1 ms … 10 s
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 360.0, 196.0, 40.0, 14.0, 10.0, 34.0


def _x(seconds: float) -> float:
    """Place of a time on the logarithmic axis; beyond its ends, the end."""
    low, high = _DECADES[0], _DECADES[-1]
    place = math.log10(seconds) if seconds > 0 else low
    return _LEFT + (_WIDTH - _LEFT - _RIGHT) * (min(max(place, low), high) - low) / (high - low)


def _y(share: float) -> float:
    return _HEIGHT - _BOTTOM - (_HEIGHT - _TOP - _BOTTOM) * share


def distribution(title: str, values: Mapping[str, Sequence[float]]) -> Markup:
    """Share of faults whose time is no longer than x, one stepped line per side; empty where there is no value.

    Parameters
    ----------
    title : str
        What the times are.
    values : Mapping[str, Sequence[float]]
        Times by side [s]; their size counts, and what is below 1 ms or above 10 s stands at the end of the axis.
    """
    if not any(values.values()):
        return Markup("")
    parts = []
    for share in (0.0, 0.5, 0.95, 1.0):
        style = "grid" if share in (0.0, 1.0) else "grid mark"
        parts.append(
            Markup('<path class="{}" d="M{:.1f},{:.1f}H{:.1f}"/>').format(style, _LEFT, _y(share), _WIDTH - _RIGHT)
        )
        if share != 1.0:
            parts.append(text(_LEFT - 5, _y(share) + 4, f"{share:.0%}".replace("%", " %"), "tick end"))
    for decade in _DECADES:
        x = _x(10.0**decade)
        parts.append(Markup('<path class="grid" d="M{:.1f},{:.1f}V{:.1f}"/>').format(x, _TOP, _HEIGHT - _BOTTOM))
        label = {_DECADES[0]: "≤ 1 ms", _DECADES[-1]: "≥ 10 s"}.get(decade, span(10.0**decade).replace(".0", ""))
        anchor = "tick end" if decade == _DECADES[-1] else "tick mid"
        parts.append(text(x + (10 if anchor == "tick end" else 0), _HEIGHT - _BOTTOM + 16, label, anchor))
    for side, times in values.items():
        ordered = sorted(abs(t) for t in times)
        if not ordered:
            continue
        d = f"M{_LEFT:.1f},{_y(0):.1f}"
        for k, t in enumerate(ordered):
            d += f"H{_x(t):.1f}V{_y((k + 1) / len(ordered)):.1f}"
        parts.append(Markup('<path class="line {}" d="{}H{:.1f}"/>').format(side, d, _WIDTH - _RIGHT))
    return Markup('<svg class="plot" viewBox="0 0 {:.0f} {:.0f}" role="img" aria-label="{}">{}</svg>').format(
        _WIDTH, _HEIGHT, f"{title}: share of faults up to a time", Markup("").join(parts)
    )


def reliability_diagram(title: str, bins: Sequence[ProbabilityBin]) -> Markup:
    """Share that was right over the stated probability, with the diagonal; areas grow with the number of faults.

    Parameters
    ----------
    title : str
        Whose probabilities.
    bins : Sequence[ProbabilityBin]
        From `diagnosis.evaluation.reliability`.
    """
    size, left, top = 132.0, 30.0, 11.0

    def at(p: float, share: float) -> tuple[float, float]:
        return left + size * p, top + size * (1 - share)

    parts = [
        Markup('<rect class="frame" x="{}" y="{}" width="{}" height="{}"/>').format(left, top, size, size),
        Markup('<path class="grid mark" d="M{},{}L{},{}"/>').format(*at(0, 0), *at(1, 1)),
    ]
    for p in (0.0, 0.5, 1.0):
        parts.append(text(at(p, 0)[0], top + size + 15, f"{p:g}", "tick mid"))
        parts.append(text(left - 5, at(0, p)[1] + 4, f"{p:g}", "tick end"))
    used = [
        (b["reported"], b["probability"], b["right"])
        for b in bins
        if b["probability"] is not None and b["right"] is not None
    ]
    most = max((count for count, _, _ in used), default=1)
    for count, stated, right in used:
        x, y = at(stated, right)
        words = f"{count} stated {stated:.2f}, {right:.2f} of them right"
        parts.append(
            Markup(
                '<path class="miss" d="M{x:.1f},{y:.1f}V{d:.1f}"/><circle class="dot" cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}">'
                "<title>{words}</title></circle>"
            ).format(x=x, y=y, d=at(0, stated)[1], r=2.5 + 6 * math.sqrt(count / most), words=words)
        )
    return Markup('<svg class="plot rel" viewBox="0 0 176 164" role="img" aria-label="{}">{}</svg>').format(
        f"Reliability of {title}", Markup("").join(parts)
    )
