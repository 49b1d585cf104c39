"""Courses of ε̂ that the fleet page shows, the most urgent first, and their words."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.audit.fleet.fleet_types import MachineRow
from diagnosis.audit.fleet.page.shown import Context
from diagnosis.audit.fleet.page.svg import trend_picture
from diagnosis.audit.fleet.trend_types import LineRow, TrendRow
from diagnosis.audit.fleet.words import count
from diagnosis.results.machine_words import words_of

MOST = 48


def interest(t: TrendRow) -> tuple[bool, float, float]:
    """What should be seen first: limits that come near, soonest first, then large losses."""
    likely = t["forecast"]["likely"]
    level = t["line"]["level"]["value"] if t["line"] else t["points"][-1][2]
    above = t["forecast"]["state"] == "above"
    return above or t["approaching"], level if above else -(likely or 0.0) if t["approaching"] else 0.0, level


def level_words(t: TrendRow, line: LineRow) -> str:
    """Loss that the line of a trend gives for now, and where it goes."""
    level = line["level"]
    return f"ε̂ {level['value']:.2f}".replace("-", "−") + (
        f", {t['direction']}" if t["direction"] != "not_known" else ""
    )


def chosen(trends: Sequence[TrendRow]) -> list[TrendRow]:
    """Trends that rise, change or come near their limit, the most urgent first."""
    found = [
        t
        for t in trends
        if t["approaching"]
        or t["forecast"]["state"] == "above"
        or t["changes"]
        or t["outliers"]
        or (t["direction"] == "rising" and t["forecast"]["likely"] is not None)
    ]
    return sorted(found, key=interest, reverse=True)[:MOST]


def course(t: TrendRow, machines: Sequence[MachineRow], unit: str) -> Context:
    """Title, picture and words of one course."""
    title = f"{machines[t['machine']]['label']} · {words_of(machines[t['machine']]).part_words(t['kind'], t['component'], t['side'])}"
    line = t["line"]
    notes = []
    if line is not None:
        per = 10 if unit == "h" else 30
        low, high = (f"{per * v:+.3f}".replace("-", "−") for v in (line["slope"]["low"], line["slope"]["high"]))
        level = line["level"]
        notes.append(
            f"ε̂ now {level['value']:.3f} ({level['low']:.3f} to {level['high']:.3f}), {low} to {high} per {per} {unit} (95 %)".replace(
                "-", "−"
            )
        )
    notes += [
        {"drop": "falls by {:.2f}: repaired?", "rise": "rises by {:.2f} at once", "bend": "the slope changes"}[
            c["kind"]
        ].format(abs(c["size"]))
        for c in t["changes"]
    ]
    if t["outliers"]:
        notes.append(f"{count(len(t['outliers']), 'outlier')} excluded")
    words = t["forecast"]["words"]
    state = "above" if t["forecast"]["state"] == "above" else "near" if t["approaching"] else "calm"
    return {
        "title": title,
        "state": state,
        "picture": trend_picture(t, title, unit),
        "words": words[:1].upper() + words[1:],
        "more": "; ".join(notes),
    }
