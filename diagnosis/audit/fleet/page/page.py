"""The fleet page of an audit: one HTML file that works offline and can be read without JavaScript.

Its scripts choose light or dark, sort the machines and search the missions. A content security policy admits exactly
them and no request. Links lead to the missions' reports below the page's folder.
"""

from __future__ import annotations

import base64
import hashlib
from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path

import jinja2
from markupsafe import Markup

from diagnosis.audit.fleet.fault_types import FleetFaultRow
from diagnosis.audit.fleet.fleet_types import AuditRow, CountsRow, FleetDocument, MachineRow
from diagnosis.audit.fleet.leave import GONE, Left, lists_of
from diagnosis.audit.fleet.listed import machine_words
from diagnosis.audit.fleet.page import rows
from diagnosis.audit.fleet.page.changes import changes_of
from diagnosis.audit.fleet.page.faults import fault_context
from diagnosis.audit.fleet.page.figures import blind, hours, kpis, of_folders
from diagnosis.audit.fleet.page.matrix import matrix
from diagnosis.audit.fleet.page.points import in_points
from diagnosis.audit.fleet.page.shown import Context, ShownDocument, shown
from diagnosis.audit.fleet.page.svg import LEGEND, mark, sparkline, sprite
from diagnosis.audit.fleet.page.trends import MOST, chosen, course, dead_words, interest, is_lost, keys, level_words
from diagnosis.audit.fleet.trend_types import TrendRow
from diagnosis.audit.fleet.words import count, missions_words
from diagnosis.pages import labels
from diagnosis.pages.environment import DARK, SHARED, asset, environment, shared_style
from diagnosis.pages.mode_style import mode_rules
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Leave, Verdict
from replay.faults import FaultMode

_HERE = Path(__file__).parent
_FAULTS = 400
_OPEN_ROWS = 40
_STANDING = 2  # faults of a machine that its row names
_BLIND = 100  # machines whose parts that were not judged are listed
_FAILURES = 1000
_FILTER = (Verdict.STOP, Verdict.WATCH, Verdict.READY, Verdict.NOT_ASSESSED)
_DEFINITIONS = (
    "The verdict of a machine is that of its last mission that could be judged. It is worse where no later mission judged "
    "the part of an earlier fault. A machine counts as ready only if no mission without a verdict may be later. A log that cannot "
    "be read or has no date may be later, unless an earlier audit run read it before that mission began. A log without a "
    "verdict and without a machine counts for the only machine with judged missions in its folder. Missions count but "
    "cannot be ordered if their log has no date, if its date is more than a day after an audit read it, or if they start "
    "at the same moment.",
    "New: in the last mission of the machine and in no earlier one, of which at least one judged the part. Recurring: in several missions. "
    "Past: not found in the last three missions that judged the part. Faults of severity “info” are left out.",
    "A fault of high severity that no longer shows may be a loose contact. It stays open until the repair of its part is recorded "
    "(mfhca audit --repaired), or until ten missions do not find it that would have shown it: the part was judged, and by its report the "
    "mission would have shown such a fault of ten seconds more often than not; a damaged log counts for none. Repaired: not found since the repair.",
    "Missions with a report count. A copy of a log, a log that was not read and one that is not audited yet are missions that "
    "do not count in machines, faults and trends.",
    "A mission judged a part, or judged it long enough: decided, healthy or faulty, for the seconds that the verdict “ready” takes and for four fifths of its driving; one that found a fault of it counts as one that judged it. Check before it goes out: the missions do not tell that the machine is sound.",
    "Trend: weighted line through the missions' ε̂ over time, each over its whole mission, while a fault's ε̂ is that of the fault's own time; it is fitted by least squares, so that a time counts by the square of the speed, opening or angle in it, and a loss of half of the mission may be more or less than half of it; the spread from mission to mission is estimated with it. "
    "Outliers (×) are excluded. A step or bend (↓ ↑ ∠), such as a repair, starts a new line. "
    "The band is its 90 % interval, the bar on the limit the 90 % interval of the crossing.",
    "The limit of ε̂ is the loss from which on a report states a fault to watch. A loss alone is no reason to stop, so a machine with one may go "
    "out, unless the part may have lost half or more; one whose loss is beyond the limit for certain, though no report states the fault, is not "
    "known to be fit to.",
    "A forecast needs five missions since the last change, and reaches at most three times as far ahead as the time that "
    "they cover. It gives the time at which the mean of missions reaches the limit if wear continues at this rate.",
    "Copies of a log count once, and for one machine: that in whose folder an audit saw the log first.",
)


def build_fleet_page(found: FleetDocument) -> str:
    """Page of a fleet; the same document gives the same text.

    Parameters
    ----------
    found : FleetDocument
        From `diagnosis.audit.fleet.document.fleet_document`.
    """
    document = shown(found)
    trends: list[TrendRow] = [{**t, "component": labels.visible(t["component"])} for t in found["trends"]]
    axis = document["axis"]
    scripts = [asset(SHARED / "theme.js"), asset(_HERE / "fleet.js")]
    present = [f for f in document["faults"] if f["status"] not in GONE]
    past = [f for f in document["faults"] if f["status"] in GONE]
    standing, lists = _by_machine(present), lists_of(found)
    drawn = chosen(trends, lambda t: bool(dead_words(t, standing[t["machine"]])))
    failed = [k for k, m in enumerate(found["missions"]) if m["verdict"] is None]
    own: dict[int, list[TrendRow]] = defaultdict(list)
    for t in trends:
        own[t["machine"]].append(t)
    directions = {(t["machine"], t["component"], t["side"]): t["direction"] for t in trends}
    context: Context = {
        "css": Markup(_css()),
        "csp": _policy(scripts),
        "head": Markup(scripts[0]),
        "script": Markup(scripts[1]),
        "sprite": sprite(),
        "verdict": {**document["verdict"], "icon": document["verdict"]["status"].symbol},
        "counts": document["counts"],
        "span": _span(document["counts"]),
        "missions_words": missions_words(document["counts"]["missions"], document["counts"]["counted"]),
        "audit": _audit(document["audit"]),
        "kpis": kpis(document),
        "baseline": changes_of(document["baseline"], {m["label"]: words_of(m) for m in document["machines"]}),
        "leave": _leave(lists, document),
        "of_folders": of_folders(document["machines"], document["missions"].as_found),
        "strip": rows.strip_length(len(document["machines"])),
        "machines": [
            _machine(k, m, document, standing[k], own[k], lists[k].leave) for k, m in enumerate(document["machines"])
        ],
        "faults": [fault_context(f, document, directions) for f in present[:_FAULTS]],
        "unlisted": max(0, len(present) - _FAULTS),
        "past": [fault_context(f, document, directions) for f in past[:_FAULTS]],
        "past_count": len(past),
        "trends": [course(t, document["machines"], axis, standing[t["machine"]], _start_of(document)) for t in drawn],
        "keys": keys(drawn),
        "quiet": len(trends) - len(drawn),
        "brief": sum(t["forecast"]["state"] == "not_known" for t in trends if all(t is not d for d in drawn)),
        "crowded": len(drawn) == MOST,
        "matrix": matrix(document["machines"]),
        "blind": blind(document["machines"][:_BLIND], document),
        "groups": [(*g, len(document["missions"]) <= _OPEN_ROWS) for g in rows.groups(document)],
        "cut": len(document["missions"]) > rows.LISTED,
        "failures": [document["missions"][k] for k in failed[:_FAILURES]],
        "failed_more": max(0, len(failed) - _FAILURES),
        "definitions": _DEFINITIONS,
        "version": document["version"],
        "axis": {"hours": "driving hours of the audited missions", "days": "days"}[axis],
    }
    return _environment().get_template("fleet.html.j2").render(context)


def _leave(lists: Sequence[Left], document: ShownDocument) -> list[Context]:
    """The three lists, those that keep machines back first; the mission's file where it has no name of its own."""
    symbols = {Leave.MUST_NOT: Verdict.STOP, Leave.CHECK: Verdict.NOT_ASSESSED, Leave.MAY: Verdict.READY}
    out: list[Context] = []
    for leave in Leave:
        rows_ = [
            {
                "label": document["machines"][x.machine]["label"],
                "group": x.machine,
                "reason": labels.visible(head),
                "more": [labels.visible(one) for one in more],
                "name": "" if x.mission is None else document["missions"][x.mission]["name"],
                "files": [] if x.mission is None else document["missions"][x.mission]["files"][:2],
                "address": "" if x.mission is None else document["missions"][x.mission]["address"],
                "lead": x.lead,
                "note": x.note,
            }
            for x in lists
            if x.leave is leave
            for head, more in [in_points(x.reason)]
        ]
        words = leave.value[:1].upper() + leave.value[1:]
        first = sum(x.leave is Leave.CHECK for x in lists) if leave is Leave.MUST_NOT else 0
        but = f" for certain, but {count(first, 'machine')} must be checked first" if first else ""
        out.append({"symbol": symbols[leave].symbol, "words": words, "rows": rows_, "but": but})
    return out


def _start_of(document: ShownDocument) -> Callable[[int], int | None]:
    missions = document["missions"].as_found
    return lambda place: missions[place].get("start_ns")


def _by_machine(faults: Sequence[FleetFaultRow]) -> dict[int, list[FleetFaultRow]]:
    out: dict[int, list[FleetFaultRow]] = defaultdict(list)
    for f in faults:
        out[f["machine"]].append(f)
    return out


def _policy(scripts: Sequence[str]) -> str:
    hashes = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(s.encode()).digest()).decode()}'" for s in scripts)
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
        "form-action 'none'"
    )


@lru_cache
def _css() -> str:
    """Style of the mission report and what is special to this page.

    Dark is for screens, and without scripts by the system's choice; paper stays light.
    """
    chosen_dark = r"@media screen { \g<0> }\n"
    system_dark = r"@media screen and (prefers-color-scheme: dark) { :root:not(.js) {\1} }\n"
    cells = mode_rules([(".c.{m}", "border: 0; background: var(--{m}); color: var(--on-{m});")])
    return DARK.sub(chosen_dark + system_dark, shared_style()) + cells + asset(_HERE / "fleet.css")


@lru_cache
def _environment() -> jinja2.Environment:
    made = environment(_HERE)
    made.filters |= {"state": state_label, "grouped": labels.grouped}
    made.globals |= {
        "mark": mark,
        "legend": [(s, _legend(s)) for s in LEGEND],
        "verdicts": [(v, v.group) for v in _FILTER],
    }
    return made


def _legend(symbol: str) -> str:
    """What a symbol of a mission says: its worst fault, or its verdict where it has none."""
    if symbol in set(FaultMode):
        return labels.mode_legend(FaultMode(symbol))
    return Verdict.NOT_ASSESSED.group if symbol == Verdict.NOT_ASSESSED.symbol else state_label(symbol)


def _span(counts: CountsRow) -> str:
    days = [rows.day(start) for start in (counts["first_ns"], counts["last_ns"]) if start is not None]
    return "logs from " + " to ".join(dict.fromkeys(days)) if days else ""


def _audit(audit: AuditRow) -> str:
    run, made = audit["run"], audit["made_ns"]
    words = [f"audit run {run}"] if run else []
    if made:
        words.append(Markup("newest result made {} UTC").format(labels.utc_mark(made, 16)))
    return Markup(", ").join(words)


def _machine(
    k: int,
    m: MachineRow,
    document: ShownDocument,
    standing: Sequence[FleetFaultRow],
    trends: Sequence[TrendRow],
    leave: Leave,
) -> Context:
    leading = max((t for t in trends if t["line"] is not None and is_lost(t)), key=interest, default=None)
    told = any(t["line"] is not None for t in trends)
    line = leading["line"] if leading else None
    judged = len(m["missions"]) + len(m["undated"])
    near = any(t["approaching"] for t in trends)
    words, symbol = (
        machine_words(m, standing, near, leave, halving=any(t.get("halving") for t in trends)),
        m["verdict"].symbol,
    )
    shows = bool(standing) or near or leave is not Leave.MAY
    if (m["verdict"] is Verdict.WATCH and not standing) or (m["verdict"] is Verdict.READY and shows):
        symbol = "warning"  # a damaged log, or a ready one that shows something
    return {
        "label": m["label"],
        "name": m["name"] if m["name"] != m["label"] else "",
        "rank": k,
        "symbol": symbol,
        "words": words,
        "note": m["note"],
        "open": len(standing),
        "faults": "; ".join(rows.fault_words(f, words_of(m)) for f in standing[:_STANDING])
        + rows.not_named(standing, _STANDING, m),
        "strip": rows.strip(document["missions"], m, rows.strip_length(len(document["machines"]))),
        "with_faults": m["with_faults"],
        "judged": judged,
        "trend": sparkline(leading) if leading else "",
        "trend_words": f"{words_of(m).part_words(leading['kind'], leading['component'], leading['side'])}: {level_words(leading)}{f', {dead}' if (dead := dead_words(leading, standing)) else ''}"
        if leading and line
        else "",
        "no_trend": ""
        if leading
        else "no loss of any part over its last mission"
        if told
        else "fewer than five missions with an estimate"
        if trends
        else "no estimate of ε̂",
        "level": leading["points"][-1][2] if leading and line else -1.0,
        "driven": hours(m["driving_s"]),
        "driving_s": m["driving_s"],
        "decided": "–" if m["decided"] is None else f"{100 * m['decided']:.0f} %",
        "share": m["decided"] or 0.0,
        "group": k,
    }
