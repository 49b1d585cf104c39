"""What changed in a fleet against an earlier audit, as the fleet page says it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnosis.audit.fleet.compare import OUTCOMES
from diagnosis.audit.fleet.words import count
from diagnosis.pages import labels

VERDICTS = {
    "stop": "Stop and repair",
    "watch": "Faults to watch",
    "ready": "Ready",
    "not_assessed": "Not assessed",
}
_CHANGES = {
    "new": ("+", "new"),
    "worse": ("▲", "worse"),
    "better": ("▼", "better"),
    "not_seen_again": ("?", "not seen again, but not assessed"),
    "resolved": ("✓", "resolved"),
    "unchanged": ("=", "unchanged"),
}
_CHANGED = {"severity": "severity", "epsilon": "ε̂", "frequency": "how often"}


def changes_of(b: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """What changed against another audit, in words."""
    if b is None:
        return None
    groups = []
    for outcome in OUTCOMES:
        found = [_changed(f) for f in b["faults"] if f["outcome"] == outcome]
        sign, words = _CHANGES[outcome]
        groups.append({"outcome": outcome, "sign": sign, "words": words[0].upper() + words[1:], "rows": found})
    notes = [f"{c['machine']}: {VERDICTS[c['older']]} → {VERDICTS[c['newer']]}" for c in b["machines"]["changed"]]
    for key, words in (("new", "not in the earlier audit"), ("missing", "no longer in the audit")):
        if b["machines"][key]:
            notes.append(
                f"Machines {words}: {', '.join(b['machines'][key][:20])}"
                + (" …" if len(b["machines"][key]) > 20 else "")
            )
    coverage = [
        {
            "change": c["change"],
            "words": {"lost": "no longer assessed", "gained": "assessed now"}[c["change"]],
            "part": f"{c['machine']}: {c['component']} {labels.part(c['kind'], c['side'])}",
        }
        for c in b["coverage"]
    ]
    m, gone = b["missions"], b["machines"]["missing"]
    if m["missing"]:
        notes.append(f"Missions missing: {', '.join(m['missing'][:20])}" + (" …" if len(m["missing"]) > 20 else ""))
    lost = " and ".join(count(len(x), w) for x, w in ((gone, "machine"), (m["missing"], "mission")) if x)
    one = len(gone) + len(m["missing"]) == 1
    lost = f"{lost} of the earlier audit {'is' if one else 'are'} missing. " if lost else ""
    told = [f"{n} {_CHANGES[k][1]}" for k, n in b["counts"].items() if n]
    return {
        "worse": b["worse"],
        "missing": bool(lost),
        "headline": lost + ("Faults: " + ", ".join(told) if told else "No fault in either audit"),
        "missions": f"{count(m['newer'], 'mission')} now, {count(m['older'], 'mission')} then; {count(m['new'], 'mission')} new",
        "groups": groups,
        "notes": notes,
        "coverage": coverage,
    }


def _changed(f: Mapping[str, Any]) -> dict[str, Any]:
    told = [f[k] and _told(f[k]) for k in ("older", "newer")]
    return {
        "machine": f["machine"],
        "symbol": labels.known(f["mode"]),
        "words": f"{f['component']} {labels.part(f['kind'], f['side'])} {labels.state_label(f['mode'], f['side']).lower()}",
        "older": told[0] or "–",
        "newer": told[1] or "–",
        "address": f["address"],
        "more": f["note"] or ", ".join(_CHANGED[c] for c in f["changes"]),
    }


def _told(side: Mapping[str, Any]) -> str:
    e = side["epsilon"]
    return f"{side['missions']} of {side['assessed']} missions, {side['severity']}" + (
        f", ε̂ {e['value']:.2f}" if e else ""
    )
