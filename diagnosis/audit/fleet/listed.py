"""The list of a fleet's machines, the same on page and terminal: order, state in words, faults."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.audit.fleet.fault_types import FleetFaultRow
from diagnosis.audit.fleet.fleet_types import FleetDocument, MachineRow
from diagnosis.audit.fleet.leave import GONE, lists_of
from diagnosis.audit.fleet.may_leave import leave_of
from diagnosis.audit.fleet.page.rows import fault_words
from diagnosis.audit.fleet.words import FAST_GROWTH, open_words
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Leave, Verdict


@dataclass(frozen=True)
class ListedMachine:
    """One machine as page and terminal list it.

    Attributes
    ----------
    label : str
        What it is called.
    verdict : Verdict
        Where it stands.
    words : str
        The same in words.
    faults : tuple[str, ...]
        Its faults that stand.
    with_faults, judged : int
        Missions with faults, and missions that were judged.
    copies : tuple[tuple[str, str], ...]
        Missions that are copies of one of its logs, in whichever folder, each with the name of that one.
    leave, reason, mission : str
        Whether it may go out, why, and the name of the mission that says so or blocks it.
    lead, note : str
        What that mission is to the reason, and what whoever opens its report must know; mostly empty.
    in_part : tuple[str, ...]
        Missions with a report in which a part of a wheel was not judged long enough.
    """

    label: str
    verdict: Verdict
    words: str
    faults: tuple[str, ...]
    with_faults: int
    judged: int
    leave: str = ""
    reason: str = ""
    mission: str = ""
    copies: tuple[tuple[str, str], ...] = ()
    lead: str = ""
    note: str = ""
    in_part: tuple[str, ...] = ()


def machine_words(
    m: MachineRow,
    standing: Sequence[FleetFaultRow],
    approaching: bool,
    leave: Leave = Leave.MAY,
    *,
    halving: bool = False,
) -> str:
    """Where a machine stands, with what a ready one still shows.

    Parameters
    ----------
    m : MachineRow
        The machine.
    standing : Sequence[FleetFaultRow]
        Its faults that stand.
    approaching : bool
        Whether a trend of its comes near its limit.
    leave : Leave
        Whether it may go out: a machine may be ready by its last report, and yet have lost too much.
    halving : bool
        Whether a loss of its grows so fast that half may be lost soon.
    """
    if m["verdict"] == Verdict.READY and leave is not Leave.MAY:
        return f"Ready by its last report, but a loss {'grows fast' if halving else 'is beyond its limit'}"
    if (
        halving
        and m["verdict"] == Verdict.WATCH
        and leave_of(m["verdict"], m["last_cleared"], m["unjudged"]) is Leave.MAY
    ):
        return FAST_GROWTH
    if m["verdict"] == Verdict.READY and standing:
        often = any(f["status"] == "recurring" for f in standing)
        return f"Ready, fault {'comes and goes' if often else 'seen lately'}"
    if m["verdict"] == Verdict.READY and approaching:
        return "Ready, limit comes near"
    if m["verdict"] == Verdict.READY and m.get("suspicions"):
        return "Ready, but not settled what an earlier mission saw"
    return m["standing"]


def _with_note(words: str, m: MachineRow) -> str:
    """Words of a machine that is not assessed with what keeps it from being so, as the page has it below them."""
    return f"{words} ({m['note']})" if m["verdict"] == Verdict.NOT_ASSESSED and m["note"] else words


def listed_machines(document: FleetDocument) -> tuple[ListedMachine, ...]:
    """Machines of a fleet's document in its order, worst first."""
    near = {t["machine"] for t in document["trends"] if t["approaching"]}
    fast = {t["machine"] for t in document["trends"] if t.get("halving")}
    out, lists = [], lists_of(document)
    copies: dict[int | None, list[tuple[str, str]]] = defaultdict(list)
    for x in document["missions"]:
        if original := x.get("copy_of"):
            copies[x["machine"]].append((x["name"], original))
    for k, m in enumerate(document["machines"]):
        standing = [f for f in document["faults"] if f["machine"] == k and f["status"] not in GONE]
        out.append(
            ListedMachine(
                m["label"],
                Verdict(m["verdict"]),
                _with_note(machine_words(m, standing, k in near, lists[k].leave, halving=k in fast), m),
                tuple(fault_words(f, words_of(m)) + open_words(f["open"], f["clean"], f["needed"]) for f in standing),
                m["with_faults"],
                len(m["missions"]) + len(m["undated"]),
                lists[k].leave.value,
                lists[k].reason,
                lists[k].name,
                tuple(copies[k]),
                lists[k].lead,
                lists[k].note,
                tuple(
                    x["name"]
                    for x in (document["missions"][j] for j in (*m["missions"], *m["undated"]))
                    if not x.get("judged", True)
                ),
            )
        )
    return tuple(out)
