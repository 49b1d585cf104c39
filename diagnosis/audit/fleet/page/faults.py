"""A fault of a machine as a row of the fleet page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from diagnosis.audit.fleet.fault_types import FleetFaultRow, MissionFaultRow
from diagnosis.audit.fleet.leave import GONE
from diagnosis.audit.fleet.page import rows
from diagnosis.audit.fleet.page.shown import Context, ShownDocument, fault_address
from diagnosis.audit.fleet.words import count, open_words, repair_command, share
from diagnosis.pages import labels
from diagnosis.results.candidates import UNCLEAR
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import words_of
from replay.faults import SCALED

_COURSE = 5  # missions whose ε̂ a fault's course names
_STATUS = {"new": "New", "recurring": "Recurring", "once": "Once", "past": "Past", "repaired": "Repaired"}


def _each(f: FleetFaultRow, document: ShownDocument) -> list[MissionFaultRow]:
    """The worst fault of this row in each dated mission of its machine that has one, oldest first."""
    about = (f["component"], f["side"], f["mode"])
    missions, places = document["missions"].as_found, document["machines"][f["machine"]]["missions"]
    each = (
        [x for x in missions[k]["faults"] if (labels.visible(x["component"]), x["side"], x["mode"]) == about]
        for k in places
    )
    return [same[0] for same in each if same]


def _of_missions(worst: str, each: Sequence[str]) -> str:
    """In how many missions a fault was of its severity, where it was not in all: by each mission's own evidence; else empty."""
    others = Counter(s for s in each if s != worst)
    if not others or worst not in each:
        return ""
    rest = ", ".join(f"{s} in {n}" for s, n in others.items())
    return f" (in {sum(s == worst for s in each)} of {len(each)} missions; {rest}, by its own evidence)"


def fault_context(f: FleetFaultRow, document: ShownDocument, directions: Mapping[tuple[int, str, str], str]) -> Context:
    """What the template shows of a fault of a machine.

    Parameters
    ----------
    f : FleetFaultRow
        The fault.
    document : ShownDocument
        The fleet.
    directions : Mapping[tuple[int, str, str], str]
        Where ε̂ goes, by machine, component and side.
    """
    first, last = (document["missions"][place] for place in (f["first"], f["last"]))
    e, found = f["epsilon"], _each(f, document)
    notes = []
    if e and f["mode"] in SCALED and not f.get("unclear"):
        # the first one, the last few, and a gap between them
        told = found[:-1] if len(found) <= _COURSE + 1 else [found[0], *found[-_COURSE:-1]]
        before = [share(each["value"]).removesuffix(" %") for m in told if (each := m["epsilon"]) is not None]
        if len(told) < len(found) - 1 and found[0]["epsilon"] is not None:
            before.insert(1, "…")
        bounds = f"{share(e['low']).removesuffix(' %')} to {share(e['high'])}"
        sizes = " → ".join([*before, f"{share(e['value'])} ({bounds})"])
        notes.append(f"{sizes} lost in the fault{', mission by mission' if before else ''}")
        direction = directions.get((f["machine"], f["component"], f["side"]), "not_known")
        notes += [direction] if direction != "not_known" else []
    if found and "lasting" in found[-1]:
        notes.append("lasts to the end of its log" if found[-1]["lasting"] else "last seen before its log ended")
    if f["status"] == "repaired" and f["repaired_ns"] is not None:
        notes.append(f"repaired on {labels.utc_moment(f['repaired_ns'])}")
    elif f["repaired_ns"] is not None:
        notes.append(f"found again since the repair on {labels.utc_moment(f['repaired_ns'])}")
    if f["open"] and f["since"]:
        none = ", for no mission since that was read whole would have shown it"
        notes.append(f"open{open_words(True, f['clean'], f['needed']) or none}")
    elif f["since"]:
        last_ones = f"last {count(f['since'], 'mission')}" if f["since"] > 1 else "last mission"
        notes.append(f"not in the {last_ones} that judged it")
    return {
        "machine": document["machines"][f["machine"]]["label"],
        "symbol": rows.fault_symbol(f),
        "words": UNCLEAR.capitalize() if f.get("unclear") else state_label(f["mode"], f["side"]),
        "part": words_of(document["machines"][f["machine"]]).part_words(f["kind"], f["component"], f["side"]),
        "severity": f["severity"] + _of_missions(f["severity"], [m["severity"] for m in found]),
        "status": _STATUS[f["status"]],
        "kind": f["status"],
        "count": f"{f['missions']} of {f['assessed']}",
        "first": rows.day(first.get("start_ns")),
        "last": rows.day(last.get("start_ns")),
        "address": fault_address(last["address"], f["last_id"]),
        "course": ", ".join(notes) or "–",
        "repair": ""
        if f["status"] in GONE
        else repair_command(document["machines"][f["machine"]]["label"], f["component"], f["side"]),
    }
