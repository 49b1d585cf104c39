"""Which machines may go out, which must not, and which must be checked first: each with why and the mission that says so."""

from __future__ import annotations

import shlex
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import takewhile

from diagnosis.audit.fleet.fault_types import FleetFaultRow
from diagnosis.audit.fleet.fleet_types import FleetDocument, MachineRow, MissionRow
from diagnosis.audit.fleet.may_leave import is_lost, leave_of
from diagnosis.audit.fleet.page.figures import unassessed
from diagnosis.audit.fleet.page.rows import fault_words, not_named
from diagnosis.audit.fleet.runs import sides_of
from diagnosis.audit.fleet.suspicion_words import with_suspicions
from diagnosis.audit.fleet.trend_types import TrendRow
from diagnosis.audit.fleet.words import count, open_words, small
from diagnosis.decision.severity import HALF
from diagnosis.decision.wording import MORE, join_words
from diagnosis.pages.labels import utc_moment
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Leave, Severity, Verdict
from replay.faults import SCALED, FaultMode

#: Statuses of faults that do not stand.
GONE = ("past", "repaired")
_FAULTS = 2
_PARTS = 4
_OUTDATED = "this report was written before the repair was recorded, and still says that the fault is open: this page holds the newest state"
_PREDATES = "this report is of a mission before the repair and tells the machine as it was then: this page holds the newest state"
_DAMAGE, _BRIEF = "the log is damaged: ", "not judged long enough"


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
    lead : str
        What that mission is to the reason, to stand before its name; may be empty.
    note : str
        What whoever opens its report must know, to follow its name; mostly empty.
    """

    leave: Leave
    machine: int
    label: str
    reason: str
    mission: int | None
    name: str
    lead: str = ""
    note: str = ""


def lists_of(document: FleetDocument) -> tuple[Left, ...]:
    """Every machine of a fleet in one list, in the document's order."""
    out = []
    standing: dict[int, list[FleetFaultRow]] = defaultdict(list)
    every: dict[int, list[FleetFaultRow]] = defaultdict(list)
    rising: dict[int, set[tuple[str, str]]] = defaultdict(set)
    beyond: dict[int, list[TrendRow]] = defaultdict(list)
    fast: dict[int, list[TrendRow]] = defaultdict(list)
    for f in document["faults"]:
        every[f["machine"]].append(f)
        if f["status"] not in GONE:
            standing[f["machine"]].append(f)
    for t in document["trends"]:
        if t["direction"] == "rising" and t["points"][-1][2] >= t["limit"]:
            rising[t["machine"]].add((t["component"], t["side"]))
        if t["points"][-1][2] >= t["limit"]:
            beyond[t["machine"]].append(t)
        if t.get("halving"):
            fast[t["machine"]].append(t)
    for k, m in enumerate(document["machines"]):
        untold = [t for t in beyond[k] if _is_untold(t, every[k], document["missions"])]
        lost = any(is_lost(t["points"][-1][3], t["limit"]) for t in untold)
        leave = leave_of(m["verdict"], m["last_cleared"], m["unjudged"], lost=lost or bool(fast[k]))
        otherwise = leave_of(m["verdict"], m["last_cleared"], m["unjudged"], lost=lost)  # but for what grows
        place, reason = _why(otherwise, m, standing[k], document["missions"], rising[k])
        reason += _repaired(every[k], m) if leave is Leave.MAY else ""
        reason = _with_growth(otherwise, m, _with_losses(leave, m, reason, untold), fast[k], untold)
        reason = with_suspicions(_with_blind(reason, m), m, document["missions"])
        if leave is not Leave.MAY and any(f["open"] and f["since"] for f in standing[k]) and _ready(m, document):
            newest = document["missions"][m["missions"][-1]]["name"]
            reason += f"; its newest report ({newest}) finds no fault, but judges its own mission alone"
        name = "" if place is None else document["missions"][place]["name"]
        lead = "– fault found in" if leave is Leave.MUST_NOT and standing[k] and name else ""
        note = _OUTDATED if m.get("outdated") and m["missions"] and place == m["missions"][-1] else ""
        if not note and place is not None and _predates(document["missions"][place], every[k]):
            note = _PREDATES
        out.append(Left(leave, k, m["label"], reason, place, name, lead, note))
    return tuple(out)


def _predates(mission: MissionRow, faults: Sequence[FleetFaultRow]) -> bool:
    """Whether a mission found a fault whose part was repaired after it: its report tells the machine as it was then."""
    at = mission.get("start_ns")
    mended = {
        (f["component"], f["side"], f["mode"])
        for f in faults
        if f["repaired_ns"] is not None and at is not None and at < f["repaired_ns"]
    }
    return any((f["component"], f["side"], f["mode"]) in mended for f in mission.get("faults", ()))


def _is_untold(t: TrendRow, faults: Sequence[FleetFaultRow], missions: Sequence[MissionRow]) -> bool:
    """Whether a loss beyond its limit is said by no fault that stands, and the part was not repaired since."""
    mine = [f for f in faults if f["component"] == t["component"] and t["side"] in sides_of(f["side"])]
    at = missions[t["points"][-1][0]].get("start_ns")
    repaired = any(f["repaired_ns"] is not None and at is not None and at < f["repaired_ns"] for f in mine)
    return not repaired and all(f["status"] in GONE for f in mine)


def _with_losses(leave: Leave, m: MachineRow, reason: str, untold: Sequence[TrendRow]) -> str:
    """A reason with the losses beyond their limit that no fault says: those that are certain give no leave, others are told beside it."""
    if leave is Leave.MUST_NOT or not untold:
        return reason
    words, said = words_of(m), []
    for t in sorted(untold, key=lambda t: -t["points"][-1][3])[:_FAULTS]:
        _, _, value, low, high = t["points"][-1]
        sure = is_lost(low, t["limit"])
        part = words.part_words(t["kind"], t["component"], t["side"])
        bounds = (
            "" if sure else f", which its bounds of {100 * low:.0f} to {100 * high:.0f} % leave open".replace("-", "−")
        )
        said.append(
            f"{part} lost {100 * value:.0f} % over the whole of its last mission, beyond the limit of {100 * t['limit']:.0f} %{bounds}"
        )
    losses = "; ".join(said)
    if (
        leave is Leave.CHECK
        and m["verdict"] in (Verdict.READY, Verdict.WATCH)
        and not m["unjudged"]
        and m["last_cleared"]
    ):
        return f"{losses}, though no fault was stated in it: check the part"
    return f"{reason}; {losses}"


def _with_growth(
    otherwise: Leave, m: MachineRow, reason: str, fast: Sequence[TrendRow], told: Sequence[TrendRow]
) -> str:
    """A reason with the losses that grow towards a half: where it might go out but for them (`otherwise`), they are the reason.

    Of the losses in `told` the reason says already how large they are.
    """
    if not fast:
        return reason
    words = words_of(m)
    said = []
    for t in sorted(fast, key=lambda t: -t["points"][-1][2])[:_FAULTS]:
        before, now = t["points"][-2][2], t["points"][-1][2]
        part = words.part_words(t["kind"], t["component"], t["side"])
        soon = "grows so fast that half may be lost before two more are over"
        if any(t is x for x in told) and otherwise is not Leave.MAY:
            said.append(
                f"the loss of the {part} was {100 * before:.0f} % over the mission before, and {soon}".replace("-", "−")
            )
            continue
        said.append(
            f"{part} lost {100 * now:.0f} % over its last mission ({100 * before:.0f} % over the one before), and {soon}".replace(
                "-", "−"
            )
        )
    losses = "; ".join(said)
    return f"{losses}: check the part; {reason}" if otherwise is Leave.MAY else f"{reason}; {losses}"


def _ready(m: MachineRow, document: FleetDocument) -> bool:
    """Whether the newest report of a machine says that it is ready."""
    return bool(m["missions"]) and document["missions"][m["missions"][-1]]["verdict"] is Verdict.READY


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
        + (f" in {missions[f['last']]['name']}" if len({g["last"] for g in faults[:_FAULTS]}) > 1 else "")
        + (", rising" if (f["component"], f["side"]) in rising else "")
        + (", no repair recorded" + open_words(f["open"], f["clean"], f["needed"]) if f["open"] and f["since"] else "")
        for f in faults[:_FAULTS]
    )
    named += not_named(faults, _FAULTS, m)
    if leave is Leave.MUST_NOT:
        place = faults[0]["last"] if faults else last
        return place, (named or m["standing"]) + _later(m, missions)
    if leave is Leave.MAY:
        if any(not f["since"] for f in faults):
            worn = any(f["mode"] == FaultMode.INEFFICIENT for f in faults[:_FAULTS])
            why = "; a loss of effectiveness alone is no reason to stop, only to check" if worn else ""
            return last, f"with {count(len(faults), 'fault')} to watch: {named}{why}"
        return last, "no fault in its last mission" + (f"; seen before: {named}" if faults else "")
    for place in (*sorted(m["failed"], key=lambda k: missions[k]["gone"]), *reversed(m["undated"])):
        if m["unjudged"] and missions[place]["verdict"] in (None, Verdict.NOT_ASSESSED):
            more = f"; {count(m['unjudged'] - 1, 'other mission')} of it not judged either" if m["unjudged"] > 1 else ""
            lost = _lost(missions[place]) if place in m["failed"] and missions[place]["gone"] else ""
            return place, f"{named + '; ' if named else ''}{_said(missions[place])}{lost}{more}"
    said = _left_open(m, missions)
    if last is not None and m["verdict"] == missions[last]["verdict"] == Verdict.NOT_ASSESSED:
        return last, f"{_said(missions[last])}{said and f' – {said}'}"
    why = m.get("not_cleared", "").removesuffix(MORE)
    stands = m["standing"] + (f", because {why}{_halved(faults)}" if why else "")
    reason = f"{named}: {small(stands)}" if named else stands
    return last, f"{reason} – {said}" if said else reason


def _later(m: MachineRow, missions: Sequence[MissionRow]) -> str:
    """The missions after the last verdict, and those that may be, by name where they are few; empty for none."""
    if not m["unjudged"]:
        return ""
    newer = [
        missions[k]["name"]
        for k in takewhile(lambda k: missions[k]["verdict"] == Verdict.NOT_ASSESSED, reversed(m["missions"]))
    ]
    others = [k for k in m["undated"] if missions[k]["verdict"] == Verdict.NOT_ASSESSED]
    dark, rest = [missions[k]["name"] for k in (*others, *m["failed"])], m["unjudged"] - len(newer)
    said = (
        f"; {count(len(newer), 'newer mission')}{_by_name(newer, len(newer))} did not clear the machine"
        if newer
        else ""
    )
    if rest > 0:
        was = "was" if rest == 1 else "were"
        said += f"; {count(rest, 'mission')} that may be later{_by_name(dark, rest)} {was} not judged"
    return said


def _by_name(names: Sequence[str], number: int) -> str:
    """So many missions by name, in brackets, where they are few and all known; else empty."""
    return f" ({join_words(list(names))})" if len(names) == number <= _FAULTS else ""


def _left_open(m: MachineRow, missions: Sequence[MissionRow]) -> str:
    """What the machine's newest mission leaves open without naming a fault, where that one says nothing else; may be empty."""
    points = m.get("open_points", [])
    if not points or not m["missions"] or missions[m["missions"][-1]]["verdict"] != Verdict.NOT_ASSESSED:
        return ""
    return points[0] + (f"; and {count(len(points) - 1, 'more point')}" if len(points) > 1 else "")


def _halved(faults: Sequence[FleetFaultRow]) -> str:
    """The rule behind it, where a part may have lost half or more."""
    lost = any(
        f["mode"] in SCALED and f["epsilon"] is not None and f["epsilon"]["high"] >= HALF and not f["since"]
        for f in faults
    )
    return " (a part that may have lost half or more is checked first)" if lost else ""


def _repaired(faults: Sequence[FleetFaultRow], m: MachineRow) -> str:
    """What was repaired of a machine and not found since, to follow why it may go out."""
    mended = [f for f in faults if f["status"] == "repaired" and f["repaired_ns"] is not None]
    mended.sort(key=lambda f: -(f["repaired_ns"] or 0))
    said = [
        f"{fault_words(f, words_of(m))}, repaired {utc_moment(f['repaired_ns'] or 0)} and not found since"
        for f in mended
    ]
    return "".join(f"; {text}" for text in said[:_FAULTS])


def _lost(mission: MissionRow) -> str:
    """What to do about a log that was not judged and is no longer there."""
    return f"; it is no longer there: put it back, or leave it out with mfhca audit --forget {shlex.quote(mission['name'])}"


def _with_blind(reason: str, m: MachineRow) -> str:
    """A reason with the parts that the machine's last mission did not judge, or not for long enough."""
    parts = unassessed(m)
    if not parts:
        return reason
    rest = f" and {count(len(parts) - _PARTS, 'more part')}" if len(parts) > _PARTS else ""
    named = ", ".join(parts[:_PARTS]) if rest else join_words(parts)
    said = reason.casefold() == _BRIEF  # the reason itself, which lacks the names
    return f"{reason if said else f'{reason}; {_BRIEF}'}: {named}{rest}"


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
