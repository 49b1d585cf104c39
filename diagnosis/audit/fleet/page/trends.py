"""Courses of ε̂ that the fleet page shows, the most urgent first, and their words."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from diagnosis.audit.fleet.fault_types import FleetFaultRow
from diagnosis.audit.fleet.fleet_types import MachineRow
from diagnosis.audit.fleet.page.shown import Context
from diagnosis.audit.fleet.page.svg import physical, trend_picture
from diagnosis.audit.fleet.runs import sides_of
from diagnosis.audit.fleet.trend_types import Axis, TrendRow
from diagnosis.audit.fleet.words import TICK_UNITS, count, share, time_words
from diagnosis.decision.wording import join_words
from diagnosis.pages.labels import utc
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import words_of
from replay.faults import TOTAL

MOST = 48
_LEAST = 0.005  # of a loss over a mission


def interest(t: TrendRow) -> tuple[bool, float, float]:
    """What should be seen first: limits that come near, soonest first, then large losses."""
    likely = t["forecast"]["likely"]
    level = t["line"]["level"]["value"] if t["line"] else t["points"][-1][2]
    above = t["forecast"]["state"] == "above"
    return above or t["approaching"], level if above else -(likely or 0.0) if t["approaching"] else 0.0, level


def level_words(t: TrendRow) -> str:
    """Loss of the last mission, as its report has it, and where the losses go."""
    last = t["points"][-1][2]
    far = " far below its limit" if t["direction"] == "rising" and t["forecast"]["state"] == "not_within" else ""
    return f"{share(last)} over its whole last mission" + (
        f", {t['direction']}{far}" if t["direction"] != "not_known" else ""
    )


def _tenths(value: float) -> str:
    """Per cent with a tenth, without a negative zero."""
    return f"{round(100 * value, 1) + 0.0:.1f}"


def is_lost(t: TrendRow) -> bool:
    """Whether there is a loss to watch: one that is half a per cent, or whose limit comes near."""
    return t["approaching"] or t["forecast"]["state"] == "above" or t["points"][-1][2] >= _LEAST


def _between(t: TrendRow) -> float:
    """Mean time between missions of a trend, in the unit of its axis."""
    at = [point[1] for point in t["points"]]
    return (max(at) - min(at)) / max(1, len(at) - 1)


def _fitted(t: TrendRow) -> str:
    """Which missions the line goes through: a step or bend starts a new one."""
    return "all missions" if t["first"] == 0 else f"the {len(t['points']) - t['first']} missions since the last change"


def chosen(trends: Sequence[TrendRow], dead: Callable[[TrendRow], bool] = lambda t: False) -> list[TrendRow]:
    """Trends that rise, change or come near their limit, and those of parts that are stuck or silent (`dead`), the most urgent first."""
    found = [
        t
        for t in trends
        if t["approaching"]
        or dead(t)
        or t["forecast"]["state"] == "above"
        or t["changes"]
        or t["outliers"]
        or t["points"][-1][2] >= t["limit"]
        or (t["direction"] == "rising" and t["forecast"]["likely"] is not None)
    ]
    return sorted(found, key=interest, reverse=True)[:MOST]


def _dates(t: TrendRow, start_of: Callable[[int], int | None]) -> str:
    """How many missions a course has, and the days of the first and the last."""
    days = [utc(start)[:10] for p in (t["points"][0], t["points"][-1]) if (start := start_of(p[0])) is not None]
    return f"{count(len(t['points']), 'mission')}, {' to '.join(dict.fromkeys(days))}".removesuffix(", ")


def dead_words(t: TrendRow, standing: Sequence[FleetFaultRow]) -> str:
    """That a part is stuck or silent at times, of which no loss is made: its course looks as good as what is left; else empty."""
    mine = [
        f
        for f in standing
        if f["component"] == t["component"] and t["side"] in sides_of(f["side"]) and f["mode"] in TOTAL
    ]
    if not mine:
        return ""
    rows = join_words(list(dict.fromkeys(state_label(f["mode"], f["side"]).lower() for f in mine)))
    return f"not counting the time found as {rows}"


def keys(trends: Sequence[TrendRow]) -> Context:
    """Which marks the pictures of some trends have, beside dots and limit."""
    return {
        "fit": any(t["line"] is not None and t["forecast"]["state"] != "not_known" for t in trends),
        "when": any(t["forecast"]["state"] == "crossing" for t in trends),
        "odd": any(t["outliers"] for t in trends),
    }


def course(
    t: TrendRow,
    machines: Sequence[MachineRow],
    axis: Axis,
    standing: Sequence[FleetFaultRow] = (),
    start_of: Callable[[int], int | None] = lambda place: None,
) -> Context:
    """Title, picture and words of one course over an axis; `start_of` a mission's place gives when it began [ns]."""
    title = f"{machines[t['machine']]['label']} · {words_of(machines[t['machine']]).part_words(t['kind'], t['component'], t['side'])}"
    line = t["line"]
    notes = []
    if line is not None and t["forecast"]["state"] != "not_known":
        between = _between(t)
        low, high = (
            f"{round(100 * between * v, 1) + 0.0:+.1f}".replace("-", "−")
            for v in (line["slope"]["low"], line["slope"]["high"])
        )
        least, most = physical(t)
        level = {k: min(max(line["level"][k], least), most) for k in ("value", "low", "high")}
        notes.append(
            f"over its whole last mission, fast driving counting more, {_tenths(t['points'][-1][2])} % was lost; the line through {_fitted(t)} is "
            f"at {_tenths(level['value'])} % now ({_tenths(level['low'])} to {_tenths(level['high'])} %) and changes by {low} to {high} points per mission "
            f"({time_words(between, axis)} apart), 95 %".replace("-", "−")
        )
    notes += [
        {
            "drop": "falls by {} points at once, as by a repair",
            "rise": "rises by {} points at once",
            "bend": "the slope changes",
        }[c["kind"]].format(_tenths(abs(c["size"])))
        for c in t["changes"]
    ]
    if t["outliers"]:
        notes.append(f"{count(len(t['outliers']), 'outlier')} excluded")
    words, beyond = t["forecast"]["words"], t["points"][-1][2] >= t["limit"]
    if beyond and t["forecast"]["state"] == "not_known":
        notes.insert(0, f"a forecast with bounds is {words}")
        words = f"above the limit of {share(t['limit'])}: {share(t['points'][-1][2])} lost over the whole of its last mission"
    if t.get("halving") and t["forecast"]["state"] == "not_known":
        notes.insert(
            0,
            "no forecast, but a reason to check it now: if it merely grows as in the last three, half may be lost before two more missions "
            "are over",
        )
    if dead := dead_words(t, standing):
        words = f"{words}; {dead}, in which nothing was left of it: the dots are of the rest"
    state = "above" if beyond or dead or t["forecast"]["state"] == "above" else "near" if t["approaching"] else "calm"
    return {
        "title": title,
        "dates": _dates(t, start_of),
        "state": state,
        "picture": trend_picture(t, title, TICK_UNITS[axis]),
        "words": words[:1].upper() + words[1:],
        "more": " ".join(f"{note[:1].upper()}{note[1:]}." for note in notes),
    }
