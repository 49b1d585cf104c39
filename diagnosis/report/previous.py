"""Words of the section that compares a mission with another one of the same machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.comparison.words import CHANGES, OUTCOMES, SIGNS, coverage_words, times
from diagnosis.pages import labels
from replay.faults import TOTAL

_BAD = ("new", "worse")


def previous_section(report: Mapping[str, Any]) -> dict[str, Any] | None:
    """Everything that the section shows, None where the report holds no comparison.

    Parameters
    ----------
    report : Mapping[str, Any]
        The parsed ``report.json`` with names made visible.
    """
    found = report.get("previous")
    if not found:
        return None
    later = found.get("order") == "later"
    faults: Sequence[Mapping[str, Any]] = found.get("faults") or ()
    losses: Sequence[Mapping[str, Any]] = found.get("loss") or ()
    counts = {name: n for name, n in (found.get("counts") or {}).items() if name in OUTCOMES and n}
    return {
        "title": "Against a later mission" if later else "Against the previous mission",
        "heads": ["This mission", "Later mission"] if later else ["Previous mission", "This mission"],
        "own": 0 if later else 1,
        "later": later,
        "mission": _mission(found.get("mission") or {}),
        "counts": [(SIGNS[name], OUTCOMES[name], n, name in _BAD) for name, n in counts.items()],
        "short": ", ".join(
            f"{n} {'not seen again' if k == 'not_seen_again' else OUTCOMES[k]}" for k, n in counts.items()
        )
        or "no fault in either",
        "faults": [_row(c) for c in faults],
        "coverage": [_coverage(c) for c in found.get("coverage") or ()],
        "loss": [_loss(x, report) for x in losses if _differs(x)],
        "same_loss": sum(not _differs(x) for x in losses),
        "notes": list(found.get("notes") or ()),
    }


def _mission(m: Mapping[str, Any]) -> dict[str, str]:
    state, words = labels.VERDICTS.get(m.get("verdict", ""), labels.VERDICTS["not_assessed"])
    return {
        "state": state,
        "verdict": words,
        "files": " + ".join(m.get("files") or ()) or "no log named",
        "when": f"{labels.utc(m.get('start_ns'))} UTC",
        "length": f"{labels.span(m.get('duration_s') or 0.0)}, {labels.span(m.get('driving_s') or 0.0)} driving",
    }


def _row(c: Mapping[str, Any]) -> dict[str, Any]:
    outcome = c.get("trend") or c["status"]
    both = [c.get("older"), c.get("newer")]
    modes = {f["mode"]: (labels.known(f["mode"]), labels.state_label(f["mode"], f["side"])) for f in both if f}
    return {
        "sign": SIGNS.get(outcome, "·"),
        "outcome": OUTCOMES.get(outcome, outcome),
        "bad": outcome in _BAD,
        "part": f"{c['component']} {labels.part(c['kind'], c['side'])}",
        "modes": list(modes.values()),
        "cells": [_found(f) for f in both],
        "ids": [list(f["ids"][:3]) if f else [] for f in both],
        "more": "; ".join(
            x for x in (", ".join(CHANGES.get(n, n) for n in c.get("changes") or ()), c.get("note") or "") if x
        ),
    }


def _found(f: Mapping[str, Any] | None) -> str:
    if f is None:
        return "–"
    e = f.get("epsilon")
    size = "" if e is None or f["mode"] in TOTAL else f", ε̂ {_epsilon(e)}"
    return f"{f['severity']}, {times(len(f['ids']), f['seconds'])}{size}"


def _epsilon(e: Mapping[str, float]) -> str:
    return f"{e['value']:.2f} ({e['low']:.2f}–{e['high']:.2f})"


def _coverage(c: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "part": f"{c['component']} {labels.part(c['kind'], c['side'])}",
        "lost": c["change"] == "lost",
        "words": coverage_words(c),
        "cells": [_judged(c.get("older")), _judged(c.get("newer"))],
    }


def _judged(side: Mapping[str, Any] | None) -> str:
    if side is None:
        return "not in the result"
    if side["tier"] == "none":
        return "no evidence"
    return f"{side['decided_s']:.1f} of {side['driving_s']:.1f} s driving"


def _differs(x: Mapping[str, Any]) -> bool:
    """Whether each ε̂ lies outside the other's bounds."""
    a, b = x["older"], x["newer"]
    return not a["low"] <= b["value"] <= a["high"] and not b["low"] <= a["value"] <= b["high"]


def _loss(x: Mapping[str, Any], report: Mapping[str, Any]) -> dict[str, Any]:
    axles = (report.get("machine") or {}).get("axles") or ()
    kind = "steer" if x["component"] in axles else "wheel"
    change = x["newer"]["value"] - x["older"]["value"]
    return {
        "part": f"{x['component']} {labels.part(kind, x['side'])}",
        "cells": [labels.bounded(x["older"]), labels.bounded(x["newer"])],
        "change": f"{change:+.3f}".replace("-", "−"),
    }
