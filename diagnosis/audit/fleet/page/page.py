"""The fleet page of an audit: one HTML file that works offline and can be read without JavaScript.

Its scripts choose light or dark, sort the machines and search the missions. A content security policy admits exactly
them and no request. Links lead to the missions' reports below the page's folder.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from diagnosis.audit.fleet.page import rows
from diagnosis.audit.fleet.page.changes import changes_of
from diagnosis.audit.fleet.page.matrix import matrix
from diagnosis.audit.fleet.page.svg import mark, sparkline, sprite
from diagnosis.audit.fleet.page.trends import MOST, chosen, course, interest, level_words
from diagnosis.audit.fleet.words import count
from diagnosis.pages import labels
from diagnosis.pages.environment import SHARED, asset, environment

_HERE = Path(__file__).parent
_FAULTS = 400
_OPEN_ROWS = 40
_UNITS = {"hours": "h", "days": "d"}
_STATUS = {"new": "New", "recurring": "Recurring", "once": "Once", "past": "Past"}
_DEFINITIONS = (
    "A machine stands as its last mission that could be assessed, or worse where no later mission assessed the part of an "
    "earlier fault. It is ready only where no mission that was not judged may be later: a log that cannot be read or knows "
    "no date may be, unless an earlier audit run looked at it before that mission began. A log that was not judged and "
    "for which no machine is stated counts for the one that alone has judged missions in its folder. Missions whose log does not know the date "
    "(or tells one more than a day after an audit looked at it), or which start at the same moment, count, but cannot be ordered.",
    "New: in the machine's last mission and in none before, of which one assessed the part. Recurring: in several missions. "
    "Past: not found in the last three missions that assessed the part. Faults of severity “info” are left out.",
    "Assessed: judged for the seconds that the verdict “ready” takes, and for four fifths of its driving.",
    "Trend: weighted line through the missions' ε̂ over time, with a spread from mission to mission of its own; "
    "missions off the line (×) are set aside, and a step or bend (↓ ↑ ∠) starts the line anew, so that a repair does. "
    "The band is its 90 % interval, the bar on the limit the 90 % interval of the crossing.",
    "No forecast is made from fewer than five missions since the last change, nor further ahead than three times the time "
    "that it rests on. It says when the mean of missions reaches the limit if wear goes on as it does.",
    "Copies of a log count once in machines, faults and trends.",
)


def build_fleet_page(document: Mapping[str, Any]) -> str:
    """Page of a fleet; the same document gives the same text.

    Parameters
    ----------
    document : Mapping[str, Any]
        From `diagnosis.audit.fleet.document.fleet_document`.
    """
    trends = document["trends"]
    document = labels.made_visible(_addressed(document))
    trends = [{**t, "component": labels.visible(t["component"])} for t in trends]
    axis = document["axis"]
    scripts = [asset(SHARED / "theme.js"), asset(_HERE / "fleet.js")]
    told = [f for f in document["faults"] if f["status"] != "past"]
    past = [f for f in document["faults"] if f["status"] == "past"]
    shown = chosen(trends)
    standing, own = _by_machine(told), _by_machine(trends)
    directions = {(t["machine"], t["component"], t["side"]): t["direction"] for t in trends}
    context = {
        "css": Markup(_css()),
        "csp": _policy(scripts),
        "head": Markup(scripts[0]),
        "script": Markup(scripts[1]),
        "sprite": sprite(),
        "verdict": {**document["verdict"], "icon": rows.verdict_symbol(document["verdict"]["status"])},
        "counts": document["counts"],
        "span": _span(document["counts"]),
        "audit": _audit(document["audit"]),
        "kpis": _kpis(document),
        "baseline": changes_of(document["baseline"]),
        "strip": rows.STRIP,
        "machines": [_machine(k, m, document, standing[k], own[k]) for k, m in enumerate(document["machines"])],
        "faults": [_fault(f, document, directions) for f in told[:_FAULTS]],
        "unlisted": max(0, len(told) - _FAULTS),
        "past": [_fault(f, document, directions) for f in past[:_FAULTS]],
        "past_count": len(past),
        "trends": [course(t, document["machines"], _UNITS[axis]) for t in shown],
        "quiet": len(trends) - len(shown),
        "crowded": len(shown) == MOST,
        "matrix": matrix(document["machines"]),
        "groups": [(*g, len(document["missions"]) <= _OPEN_ROWS) for g in rows.groups(document)],
        "failures": [m for m in document["missions"] if m["verdict"] is None],
        "states": rows.STATES,
        "definitions": _DEFINITIONS,
        "version": document["version"],
        "axis": {"hours": "driving hours of the audited missions", "days": "days"}[axis],
    }
    return _environment().get_template("fleet.html.j2").render(context)


def _by_machine(found: Sequence[Mapping[str, Any]]) -> dict[int, list[Mapping[str, Any]]]:
    out: dict[int, list[Mapping[str, Any]]] = defaultdict(list)
    for f in found:
        out[f["machine"]].append(f)
    return out


def _addressed(document: Mapping[str, Any]) -> dict[str, Any]:
    """Document without its trends whose missions know their pages; names are made visible later, addresses stay."""
    missions = [{**m, "address": rows.link(m.get("report"))} for m in document["missions"]]
    out = {k: v for k, v in document.items() if k != "trends"} | {"missions": missions}
    if out["baseline"] is not None:
        changed = [
            {**f, "address": rows.to_fault(rows.link(f["newer"]["report"]), f["newer"]["id"]) if f["newer"] else ""}
            for f in out["baseline"]["faults"]
        ]
        out["baseline"] = {**out["baseline"], "faults": changed}
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
    shared = asset(SHARED / "style.css")
    dark = re.search(r"\[data-theme=dark\] \{([^}]*)\}", shared)
    if dark:
        chosen_dark = f"@media screen {{ {dark[0]} }}\n"
        system_dark = f"@media screen and (prefers-color-scheme: dark) {{ :root:not(.js) {{{dark[1]}}} }}\n"
        shared = shared.replace(dark[0], chosen_dark + system_dark)
    return shared + asset(_HERE / "fleet.css")


@lru_cache
def _environment() -> jinja2.Environment:
    found = environment(_HERE)
    found.filters |= {"state": labels.state_label, "grouped": labels.grouped}
    found.globals |= {"mark": mark}
    return found


def _span(counts: Mapping[str, Any]) -> str:
    days = [rows.day(counts[k]) for k in ("first_ns", "last_ns") if counts[k] is not None]
    return "logs from " + " to ".join(dict.fromkeys(days)) if days else ""


def _audit(audit: Mapping[str, Any]) -> str:
    run, made = audit["run"], audit["made_ns"]
    told = [f"audit run {run}"] if run else []
    return ", ".join([*told, f"newest result made {labels.utc(made)[:16]} UTC"] if made else told)


def _hours(seconds: float) -> str:
    if not seconds:
        return "–"
    return f"{seconds / 3600:.1f} h" if seconds >= 1800 else labels.span(seconds)


def _kpis(document: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Value, what it is, and what belongs to it."""
    c = document["counts"]
    unread = [
        f"{labels.grouped(c['states'][s])} {w}" for s, w in rows.STATES.items() if s != "ok" and c["states"].get(s)
    ]
    rest = [
        f"{labels.grouped(c[k])} {w}"
        for k, w in (
            ("not_assessed", "not assessed"),
            ("pending", "not audited yet"),
            ("copies", "copies"),
            ("gone", "logs no longer there"),
        )
        if c[k]
    ]
    judged = sum(len(m["missions"]) + len(m["undated"]) for m in document["machines"])
    share = f"{100 * c['with_faults'] / judged:.0f} % of those judged" if judged else "none judged"
    f = c["faults"]
    return [
        (labels.grouped(c["missions"]), "missions", ", ".join([*unread, *rest]) or "all read whole"),
        (
            _hours(c["driving_s"]),
            "driving time",
            f"{c['distance_m'] / 1000:.{1 if c['distance_m'] >= 1000 else 3}f} km",
        ),
        (labels.grouped(c["with_faults"]), "missions with faults", share),
        (
            f"{f['new']} / {f['recurring']} / {f['past']}",
            "new, recurring, past faults",
            f"{count(f['once'], 'other')} found once",
        ),
        (
            "–" if c["decided"] is None else f"{100 * c['decided']:.1f} %",
            "of driving time judged",
            "nothing judged" if c["decided"] is None else _coverage(document["machines"]),
        ),
    ]


def _coverage(machines: Sequence[Mapping[str, Any]]) -> str:
    """What the machines' last missions assessed; not known where the last one may be one without a date or a report."""
    blind = sum(p["assessed_last"] is False for m in machines for p in m["parts"])
    dark = sum(
        not m["parts"] or m["unjudged"] > 0 or any(p["assessed_last"] is None for p in m["parts"]) for m in machines
    )
    told = [f"{count(blind, 'part')} not assessed in the last mission"] if blind else []
    told += [f"{'' if blind else 'last mission '}not known of {count(dark, 'machine')}"] if dark else []
    return ", ".join(told) or "every part assessed in the last mission"


def _machine(
    k: int,
    m: Mapping[str, Any],
    document: Mapping[str, Any],
    standing: Sequence[Mapping[str, Any]],
    trends: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    leading = max((t for t in trends if t["line"] is not None), key=interest, default=None)
    judged = len(m["missions"]) + len(m["undated"])
    words, symbol = m["standing"], rows.verdict_symbol(m["verdict"])
    if m["verdict"] == "watch" and not standing:
        symbol = "warning"  # a damaged log
    if m["verdict"] == "ready" and standing:
        often = any(f["status"] == "recurring" for f in standing)
        words, symbol = f"Ready, fault {'comes and goes' if often else 'seen lately'}", "warning"
    elif m["verdict"] == "ready" and any(t["approaching"] for t in trends):
        words, symbol = "Ready, limit comes near", "warning"
    return {
        "label": m["label"],
        "name": m["name"] if m["name"] != m["label"] else "",
        "rank": k,
        "symbol": symbol,
        "words": words,
        "note": m["note"],
        "open": len(standing),
        "faults": "; ".join(rows.fault_words(f) for f in standing[:2])
        + (f" +{len(standing) - 2}" if len(standing) > 2 else ""),
        "strip": rows.strip(document["missions"], m),
        "with_faults": m["with_faults"],
        "judged": judged,
        "trend": sparkline(leading) if leading else "",
        "trend_words": f"{leading['component']} {labels.part(leading['kind'], leading['side'])}: {level_words(leading)}"
        if leading
        else "",
        "level": leading["line"]["level"]["value"] if leading else -1.0,
        "driven": _hours(m["driving_s"]),
        "driving_s": m["driving_s"],
        "decided": "–" if m["decided"] is None else f"{100 * m['decided']:.0f} %",
        "share": m["decided"] or 0.0,
        "group": k,
    }


def _fault(
    f: Mapping[str, Any], document: Mapping[str, Any], directions: Mapping[tuple[int, str, str], str]
) -> dict[str, Any]:
    first, last = (document["missions"][f[k]] for k in ("first", "last"))
    e = f["epsilon"]
    told = []
    if e and f["mode"] == "inefficient":
        told.append(f"ε̂ {e['value']:.2f} ({e['low']:.2f} to {e['high']:.2f})".replace("-", "−"))
        direction = directions.get((f["machine"], f["component"], f["side"]), "not_known")
        told += [direction] if direction != "not_known" else []
    if f["since"]:
        last_ones = f"last {count(f['since'], 'mission')}" if f["since"] > 1 else "last mission"
        told.append(f"not in the {last_ones} that assessed it")
    return {
        "machine": document["machines"][f["machine"]]["label"],
        "symbol": labels.known(f["mode"]),
        "words": labels.state_label(f["mode"], f["side"]),
        "part": f"{f['component']} {labels.part(f['kind'], f['side'])}",
        "severity": f["severity"],
        "status": _STATUS[f["status"]],
        "kind": f["status"],
        "count": f"{f['missions']} of {f['assessed']}",
        "first": rows.day(first.get("start_ns")),
        "last": rows.day(last.get("start_ns")),
        "address": rows.to_fault(last["address"], f["last_id"]),
        "told": ", ".join(told) or "–",
    }
