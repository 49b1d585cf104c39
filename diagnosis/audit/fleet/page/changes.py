"""What changed in a fleet against an earlier audit, as the fleet page says it."""

from __future__ import annotations

from collections.abc import Mapping

from diagnosis.audit.fleet.baseline_types import MissionChangesRow
from diagnosis.audit.fleet.compare import OUTCOMES
from diagnosis.audit.fleet.fault_types import FaultChange, FaultStandingRow
from diagnosis.audit.fleet.page.shown import Context, ShownBaseline, ShownFaultChange
from diagnosis.audit.fleet.words import count
from diagnosis.pages import labels
from diagnosis.results.candidates import UNCLEAR
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import HYDRAULIC, MachineWords

_CHANGES: dict[FaultChange, tuple[str, str]] = {
    "new": ("+", "new"),
    "worse": ("▲", "worse"),
    "better": ("▼", "better"),
    "not_seen_again": ("?", "not seen again, no repair shown"),
    "resolved": ("✓", "resolved"),
    "unchanged": ("=", "unchanged"),
}
_CHANGED = {"severity": "severity", "epsilon": "ε̂", "frequency": "how often"}


def changes_of(b: ShownBaseline | None, words: Mapping[str, MachineWords]) -> Context | None:
    """What changed against another audit, in words; `words` has how to speak of each machine by its label."""
    if b is None:
        return None
    groups = []
    for outcome in OUTCOMES:
        found = [_changed(f, words.get(f["machine"], HYDRAULIC)) for f in b["faults"] if f["outcome"] == outcome]
        sign, said = _CHANGES[outcome]
        groups.append({"outcome": outcome, "sign": sign, "words": said[0].upper() + said[1:], "rows": found})
    notes = [f"{c['machine']}: {c['older'].short} → {c['newer'].short}" for c in b["machines"]["changed"]]
    machines = b["machines"]
    for labels_of, said in (
        (machines["new"], "not in the earlier audit"),
        (machines["missing"], "no longer in the audit"),
    ):
        if labels_of:
            notes.append(f"Machines {said}: {', '.join(labels_of[:20])}" + (" …" if len(labels_of) > 20 else ""))
    coverage = [
        {
            "change": c["change"],
            "words": {"lost": "no longer judged long enough", "gained": "judged long enough now"}[c["change"]],
            "part": f"{c['machine']}: {words.get(c['machine'], HYDRAULIC).part_words(c['kind'], c['component'], c['side'])}",
        }
        for c in b["coverage"]
    ]
    m, gone = b["missions"], b["machines"]["missing"]
    if m["missing"]:
        notes.append(f"Missions missing: {', '.join(m['missing'][:20])}" + (" …" if len(m["missing"]) > 20 else ""))
    lost = " and ".join(count(len(x), w) for x, w in ((gone, "machine"), (m["missing"], "mission")) if x)
    one = len(gone) + len(m["missing"]) == 1
    lost = f"{lost} of the earlier audit {'is' if one else 'are'} missing. " if lost else ""
    counted = [f"{b['counts'][k]} {_CHANGES[k][1]}" for k in OUTCOMES if b["counts"][k]]
    return {
        "worse": b["worse"],
        "missing": bool(lost),
        "headline": lost
        + ("Faults that stand in either audit: " + ", ".join(counted) if counted else "No fault in either audit"),
        "missions": f"{count(m['newer'], 'mission')} now, {count(m['older'], 'mission')} then; {_new_words(m)}",
        "groups": groups,
        "notes": notes,
        "coverage": coverage,
    }


def _new_words(m: MissionChangesRow) -> str:
    """How many missions are new, and how many of them have a report: ``7 missions new, 6 of them with a report``."""
    counted = m.get("new_counted", m["new"])
    return f"{count(m['new'], 'mission')} new" + (f", {counted} of them with a report" if counted != m["new"] else "")


def _changed(f: ShownFaultChange, words: MachineWords) -> Context:
    return {
        "machine": f["machine"],
        "symbol": "warning" if f.get("unclear") else labels.known(f["mode"]),
        "words": f"{words.part_words(f['kind'], f['component'], f['side'])} {UNCLEAR if f.get('unclear') else state_label(f['mode'], f['side']).lower()}",
        "older": _standing(f["older"]),
        "newer": _standing(f["newer"]),
        "address": f["address"],
        "more": f["note"] or ", ".join(_CHANGED[c] for c in f["changes"]),
    }


def _standing(side: FaultStandingRow | None) -> str:
    if side is None:
        return "–"
    e = side["epsilon"]
    return f"{side['missions']} of {side['assessed']} missions, {side['severity']}" + (
        f", ε̂ {e['value']:.2f}" if e else ""
    )
