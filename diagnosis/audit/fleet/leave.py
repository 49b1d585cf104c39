"""Which machines may go out, which must not, and of which that is not known: each with why and the mission that says so."""

from __future__ import annotations

import shlex
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from diagnosis.audit.fleet.fault_types import FleetFaultRow
from diagnosis.audit.fleet.fleet_types import FleetDocument, MachineRow, MissionRow
from diagnosis.audit.fleet.may_leave import Leave, leave_of
from diagnosis.audit.fleet.page.figures import unassessed
from diagnosis.audit.fleet.page.rows import fault_words
from diagnosis.audit.fleet.words import count, open_words
from diagnosis.decision.wording import join_words
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Severity, Verdict

#: Statuses of faults that do not stand.
GONE = ("past", "repaired")
_FAULTS = 2
_PARTS = 4
_DAMAGE = "the log is damaged: "


@dataclass(frozen=True)
class Left:
    """A machine in one of the lists.

    Attributes
    ----------
    leave : Leave
        The list.
    machine : int
        Its place in the document.
    label : str
        What it is called.
    reason : str
        Why it is in this list.
    mission : int or None
        Place of the mission that says so, or that blocks it.
    name : str
        That mission's name; empty where there is none.
    """

    leave: Leave
    machine: int
    label: str
    reason: str
    mission: int | None
    name: str


def lists_of(document: FleetDocument) -> tuple[Left, ...]:
    """Every machine of a fleet in one list, in the document's order."""
    out = []
    standing: dict[int, list[FleetFaultRow]] = defaultdict(list)
    rising: dict[int, set[tuple[str, str]]] = defaultdict(set)
    for f in document["faults"]:
        if f["status"] not in GONE:
            standing[f["machine"]].append(f)
    for t in document["trends"]:
        if t["direction"] == "rising" and t["points"][-1][2] >= t["limit"]:
            rising[t["machine"]].add((t["component"], t["side"]))
    for k, m in enumerate(document["machines"]):
        leave = leave_of(m["verdict"], m["cleared"], m["unjudged"])
        place, reason = _why(leave, m, standing[k], document["missions"], rising[k])
        reason += _blind(m)
        name = "" if place is None else document["missions"][place]["name"]
        out.append(Left(leave, k, m["label"], reason, place, name))
    return tuple(out)


def _why(
    leave: Leave,
    m: MachineRow,
    standing: Sequence[FleetFaultRow],
    missions: Sequence[MissionRow],
    rising: Collection[tuple[str, str]],
) -> tuple[int | None, str]:
    """Place of the mission behind a machine's place in the lists, and the reason."""
    last = m["missions"][-1] if m["missions"] else next(iter(m["undated"]), None)
    faults = sorted(standing, key=lambda f: -Severity(f["severity"]).rank)
    named = "; ".join(
        fault_words(f, words_of(m))
        + (", rising" if (f["component"], f["side"]) in rising else "")
        + (", no repair recorded" + open_words(f["open"], f["clean"], f["needed"]) if f["open"] and f["since"] else "")
        for f in faults[:_FAULTS]
    )
    named += f" and {len(faults) - _FAULTS} more" if len(faults) > _FAULTS else ""
    if leave is Leave.MUST_NOT:
        place = faults[0]["last"] if faults else last
        was = "was" if m["unjudged"] == 1 else "were"
        later = f"; {count(m['unjudged'], 'mission')} that may be later {was} not judged" if m["unjudged"] else ""
        return place, (named or m["standing"]) + later
    if leave is Leave.MAY:
        if any(not f["since"] for f in faults):
            return last, f"with {count(len(faults), 'fault')} to watch: {named}"
        return last, "no fault in its last mission" + (f"; seen before: {named}" if faults else "")
    for place in (*sorted(m["failed"], key=lambda k: missions[k]["gone"]), *reversed(m["undated"])):
        if m["unjudged"] and missions[place]["verdict"] in (None, Verdict.NOT_ASSESSED):
            more = f" ({count(m['unjudged'], 'mission')} not judged)" if m["unjudged"] > 1 else ""
            lost = _lost(missions[place]) if place in m["failed"] and missions[place]["gone"] else ""
            return place, f"{named + '; ' if named else ''}{_said(missions[place])}{lost}{more}"
    if last is not None and m["verdict"] == missions[last]["verdict"] == Verdict.NOT_ASSESSED:
        return last, _said(missions[last])
    return last, f"{named}: {m['standing'][0].lower()}{m['standing'][1:]}" if named else m["standing"]


def _lost(mission: MissionRow) -> str:
    """What to do about a log that was not judged and is no longer there."""
    return f"; it is no longer there: put it back, or leave it out with mfhca audit --forget {shlex.quote(mission['name'])}"


def _blind(m: MachineRow) -> str:
    """Parts that the machine's last mission did not assess, which stand beside the leave that it gives; empty where there is none."""
    parts = unassessed(m)
    rest = f" and {count(len(parts) - _PARTS, 'more part')}" if len(parts) > _PARTS else ""
    named = ", ".join(parts[:_PARTS]) if rest else join_words(parts)
    return f"; not assessed: {named}{rest}" if parts else ""


def _said(mission: MissionRow) -> str:
    """Why a mission gives no leave, in a few words."""
    damage = mission["reason"].partition(_DAMAGE)[2]
    if damage:
        return f"{_DAMAGE}{damage.partition(': ')[0]}"
    reason = mission["reason"].partition(";")[0]
    for name in (file.rpartition("/")[2] for file in mission["files"]):
        before, found, after = reason.partition(f"/{name} ")
        if found and " " not in before:  # the whole path stands below
            reason = f"{name} {after}"
    head, _, tail = reason.partition(": ")
    names_a_file = tail and any(head.endswith(file.rpartition("/")[2]) for file in mission["files"])
    return (tail if names_a_file else reason).rstrip(".") or mission.get("title") or "not judged"
