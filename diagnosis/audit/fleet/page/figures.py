"""The fleet page's figures: missions, driving, faults, what was judged, and the parts that the last missions did not assess."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath

from diagnosis.audit.discovery.identity import telling_folder
from diagnosis.audit.fleet.fleet_types import MachineRow, MissionRow
from diagnosis.audit.fleet.page.shown import Context, ShownDocument
from diagnosis.audit.fleet.words import count
from diagnosis.audit.store.outcome import MissionState
from diagnosis.decision.wording import join_words
from diagnosis.pages import labels
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Kind, Verdict

#: What mostly has the parts of a steering judged.
_STEER = "steer from stop to stop twice at standstill and several times while driving, with the log running; where the report asks for a signal, log it"
_FOLDERS = 4  # that are named
_MACHINES = 3  # that are named
_STANDING = {"new": "new", "recurring": "recurring", "once": "found once"}
_GONE = {"past": "past", "repaired": "repaired"}


def hours(seconds: float) -> str:
    """A driving time in hours, a short one in minutes and seconds."""
    if not seconds:
        return "–"
    return f"{seconds / 3600:.1f} h" if seconds >= 1800 else labels.span(seconds)


def kpis(document: ShownDocument) -> list[tuple[str, str, str]]:
    """Value, what it is, and what belongs to it."""
    c = document["counts"]
    of_them = sum(
        m["state"] is MissionState.DEGRADED and m["verdict"] is not None and not m.get("copy_of")
        for m in document["missions"].as_found
    )
    states = {s: c["states"].get(s, 0) - (of_them if s is MissionState.DEGRADED else 0) for s in MissionState}
    unread = [f"{labels.grouped(n)} {s.words}" for s, n in states.items() if s.words and n > 0]
    rest = [
        f"{labels.grouped(n)} {words}"
        for n, words in (
            (c["pending"], MissionState.PENDING.words),
            (c["copies"], "copy" if c["copies"] == 1 else "copies"),
            (c["gone"], "log no longer there" if c["gone"] == 1 else "logs no longer there"),
        )
        if n
    ]
    counted = c["counted"]
    share = (
        f"{100 * c['with_faults'] / counted:.0f} % of the {labels.grouped(counted)} with a report"
        if counted
        else "none with a report"
    )
    f = c["faults"]
    return [
        (
            labels.grouped(counted),
            "missions",
            (f"of {labels.grouped(c['missions'])} logs: " if c["missions"] != counted else "")
            + ", ".join([f"{labels.grouped(counted)} with a report{_damaged(of_them)}", *unread, *rest])
            + (
                f"; {labels.grouped(c['not_assessed'])} {Verdict.NOT_ASSESSED.group.lower()}"
                if c["not_assessed"]
                else ""
            ),
        ),
        (
            hours(c["driving_s"]),
            "driving time",
            f"{c['distance_m'] / 1000:.1f} km" if c["distance_m"] >= 1000 else f"{c['distance_m']:.0f} m",
        ),
        (labels.grouped(c["with_faults"]), "missions with faults", share),
        (
            labels.grouped(f["new"] + f["recurring"] + f["once"]),
            "faults that stand",
            of_faults(f),
        ),
        (
            "–" if c["decided"] is None else f"{100 * c['decided']:.1f} %",
            "of driving time judged",
            "nothing judged" if c["decided"] is None else _coverage(document["machines"]),
        ),
    ]


def _damaged(of_them: int) -> str:
    """How many of the missions with a report were not read whole, in brackets; empty for none."""
    return f" ({labels.grouped(of_them)} of them {MissionState.DEGRADED.words})" if of_them else ""


def of_faults(found: Mapping[str, int]) -> str:
    """How the faults that stand were found, and apart from them those that do not."""
    standing, gone = (
        [f"{labels.grouped(found[k])} {said}" for k, said in words.items() if found[k]] for words in (_STANDING, _GONE)
    )
    apart = f"{'beside them' if standing else 'none'}{',' if not standing else ''} {' and '.join(gone)}" if gone else ""
    return (
        "; ".join([*([", ".join(standing)] if standing else []), *([apart] if apart else [])]) or "none was ever found"
    )


def _coverage(machines: Sequence[MachineRow]) -> str:
    """What the machines' last missions assessed; not known where the last one may be one without a date or a report."""
    blind = sum(len(unassessed(m)) for m in machines)
    dark = [
        m["label"]
        for m in machines
        if not m["parts"] or m["unjudged"] > 0 or any(p["assessed_last"] is None for p in m["parts"])
    ]
    words = (
        [f"{count(blind, 'part')} not judged long enough in the last mission{'s' if len(machines) > 1 else ''}"]
        if blind
        else []
    )
    who = join_words(dark) if len(dark) <= _MACHINES else count(len(dark), "machine")
    words += [f"which parts the last mission of {who} judged is not known"] if dark else []
    return "; ".join(words) or "every part judged long enough in the last mission"


def unassessed(m: MachineRow) -> list[str]:
    """Parts that the machine's last mission did not assess."""
    words = words_of(m)
    return [words.part_words(p["kind"], p["component"], p["side"]) for p in m["parts"] if p["assessed_last"] is False]


def blind(machines: Sequence[MachineRow], document: ShownDocument) -> list[Context]:
    """Machines with parts that their last mission did not assess: which, and the report that says what would assess them."""
    out: list[Context] = []
    for m in machines:
        parts = unassessed(m)
        if parts:
            last = document["missions"][m["missions"][-1]] if m["missions"] else None
            address = "" if last is None or not last["address"] else last["address"]
            # of one that is ready nothing is to be done: the checks of its axles passed
            ready = last is not None and last["verdict"] == Verdict.READY
            says = "why" if ready else "why, and what would have them judged"
            steered = any(p["kind"] == Kind.STEER and p["assessed_last"] is False for p in m["parts"])
            drive = _STEER if steered and not ready else ""
            out.append(
                {"label": m["label"], "parts": join_words(parts), "address": address, "says": says, "drive": drive}
            )
    return out


def of_folders(machines: Sequence[MachineRow], missions: Sequence[MissionRow]) -> list[str]:
    """Machines whose logs lie in several folders that may each be a machine, in a sentence each: their id alone makes them one."""
    out = []
    for m in machines:
        own = [*m["missions"], *m["undated"], *m["failed"]]
        folders = [telling_folder(PurePosixPath(file).parent.parts) for k in own for file in missions[k]["files"][:1]]
        named = [name for name in dict.fromkeys(folders) if name]
        if m["id"] and len(named) > 1:
            rest = f" and {len(named) - _FOLDERS} more" if len(named) > _FOLDERS else ""
            out.append(
                f"{m['label']} has logs of {len(named)} folders ({', '.join(named[:_FOLDERS])}{rest}), which its id makes one machine. If each "
                "folder is a machine, leave the id out of the machine file, or give each its own, and audit again."
            )
    return [labels.visible(words) for words in out]
