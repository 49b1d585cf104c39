"""Strips, cells and rows of the fleet page: markup that occurs thousands of times, built without a template."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence

from markupsafe import Markup, escape

from diagnosis.audit.fleet.fault_types import FleetFaultRow, MissionFaultRow
from diagnosis.audit.fleet.fleet_types import MachineRow, MissionRow
from diagnosis.audit.fleet.page.shown import ShownDocument, ShownMission
from diagnosis.audit.fleet.page.svg import mark
from diagnosis.audit.fleet.words import missions_words
from diagnosis.audit.store.outcome import MissionState
from diagnosis.pages import labels
from diagnosis.results.candidates import UNCLEAR
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import ANY_DRIVE, MachineWords, words_of
from diagnosis.results.sizes import loss_known
from diagnosis.results.vocabulary import NOT_CLEARED, Verdict
from replay.faults import SCALED

STRIP = 14
# Missions of a fleet that are all listed; of a larger one those that say most, so that the page stays light.
LISTED = 6000
_CELLS, _LEAST = 6000, 3


def strip_length(machines: int) -> int:
    """How many missions each strip shows."""
    return max(_LEAST, min(STRIP, _CELLS // max(machines, 1)))


def symbol(mission: ShownMission) -> str:
    """Symbol of a mission: its worst fault, healthy, not assessed, or a warning where there is no report."""
    verdict = mission["verdict"]
    if verdict is None:
        return "warning"
    if mission["faults"]:
        return fault_symbol(mission["faults"][0])
    return "warning" if verdict == Verdict.WATCH else Verdict(verdict).symbol


def fault_symbol(fault: FleetFaultRow | MissionFaultRow) -> str:
    """Symbol of a fault: its mode, or a warning where its kind is unclear."""
    return "warning" if fault.get("unclear") else labels.known(fault["mode"])


def fault_words(fault: FleetFaultRow | MissionFaultRow, machine_words: MachineWords) -> str:
    """Part, mode and size in few words: ``RL drive valve inefficient, 12 % lost in the fault``."""
    words = machine_words.part_words(fault["kind"], fault["component"], fault["side"])
    if fault.get("unclear"):
        return f"{words} {UNCLEAR}"
    words += f" {state_label(fault['mode'], fault['side']).lower()}"
    e = fault["epsilon"]
    sized = e is not None and fault["mode"] in SCALED and loss_known(e["low"], e["high"])
    return words + (f", {100 * e['value']:.0f} % lost in the fault" if e and sized else "")


def not_named(faults: Sequence[FleetFaultRow], named: int, machine: MachineRow) -> str:
    """How many faults of a machine follow the first `named`, and which is the newest where that is one of them; empty where none do."""
    rest = faults[named:]
    if not rest:
        return ""
    order = {place: k for k, place in enumerate(machine["missions"])}
    newest = max(rest, key=lambda f: order.get(f["last"], -1))
    newer = order.get(newest["last"], -1) > max((order.get(f["last"], -1) for f in faults[:named]), default=-1)
    return f" and {len(rest)} more" + (f", the newest {fault_words(newest, words_of(machine))}" if newer else "")


def _verdict_words(m: ShownMission) -> str:
    """Verdict of a mission in few words, as its own report begins: one that judged every wheel and yet gives no leave is *not cleared*."""
    verdict = m["verdict"]
    if verdict == Verdict.NOT_ASSESSED and m.get("judged"):
        return NOT_CLEARED
    return "" if verdict is None else Verdict(verdict).short


def day(start_ns: int | None) -> str:
    """Date of a mission."""
    return labels.utc(start_ns)[:10] if start_ns is not None else "no date"


def strip(missions: Sequence[ShownMission], machine: MachineRow, length: int = STRIP) -> Markup:
    """The last missions, oldest first, then apart those of unknown order and those that were not read."""
    words = words_of(machine)
    shown = Markup("").join(_cell(missions[k], words) for k in machine["missions"][-length:])
    apart = [*machine["undated"], *machine["failed"]]
    extra = Markup("").join(_cell(missions[k], words) for k in apart[:6])
    more = Markup('<span class="muted">+{}</span>').format(len(apart) - 6) if len(apart) > 6 else Markup("")
    if extra:
        extra = Markup(
            '<span class="apart" role="group" aria-label="of unknown order, or not read">{}{}</span>'
        ).format(extra, more)
    return Markup('<div class="cells">{}{}</div>').format(shown, extra)


def _cell(m: ShownMission, machine_words: MachineWords) -> Markup:
    state, address = symbol(m), m["address"]
    faults = m["faults"]
    found = fault_words(faults[0], machine_words) if faults else m["state"].words or _verdict_words(m)
    more = f" and {len(faults) - 1} more" if len(faults) > 1 else ""
    words = f"{day(m.get('start_ns'))}: {found}{more}"
    inner = Markup('<svg><use href="#g-{}"/></svg>').format(state)
    if not address:
        return Markup('<span class="c {}" role="img" aria-label="{}" title="{}">{}</span>').format(
            state, words, words, inner
        )
    return Markup('<a class="c {}" href="{}" title="{}">{}</a>').format(state, address, words, inner)


def groups(document: ShownDocument) -> Iterator[tuple[str, str, int, Markup]]:
    """Name of a machine, what its missions add up to, how many are listed, and their rows, newest first."""
    missions, machines = document["missions"], document["machines"]
    most = None if len(missions) <= LISTED else max(_LEAST, LISTED // (len(machines) + 1))
    copies: dict[int, list[int]] = defaultdict(list)
    rest: list[int] = []
    for k, found in enumerate(missions.as_found):
        if found["machine"] is None:
            rest.append(k)
        elif found.get("copy_of") and found["verdict"] is not None:
            copies[found["machine"]].append(k)
    for k, m in enumerate(machines):
        every = [*reversed(m["missions"]), *m["undated"], *m["failed"], *copies[k]]
        listed = _telling(missions.as_found, every, most)
        counted = missions_words(len(every), len(m["missions"]) + len(m["undated"]))
        words = f"{counted}, {m['with_faults']} with faults{_cut(listed, every)}"
        yield m["label"], words, len(listed), Markup("".join(_row(missions[r], words_of(m)) for r in listed))
    if rest:
        listed = rest[:most]
        yield (
            "No machine known",
            f"{len(rest)} log{'s' if len(rest) != 1 else ''}{_cut(listed, rest)}",
            len(listed),
            Markup("".join(_row(missions[r], ANY_DRIVE) for r in listed)),
        )


def _telling(missions: Sequence[MissionRow], every: Sequence[int], most: int | None) -> list[int]:
    """Places of a machine's missions to be listed: half of them the first of `every`, half those with faults or without a report."""
    if most is None or len(every) <= most:
        return list(every)
    chosen = set(every[: most // 2])
    telling = [k for k in every if missions[k]["faults"] or missions[k]["verdict"] is None]
    for k in (*telling, *every):
        if len(chosen) >= most:
            break
        chosen.add(k)
    return [k for k in every if k in chosen]


def _cut(listed: Sequence[int], every: Sequence[int]) -> str:
    return f"; {len(listed)} listed, all in fleet.csv" if len(listed) < len(every) else ""


def _row(m: ShownMission, machine_words: MachineWords) -> str:
    """One mission; its class is what the selection above the list asks for."""
    verdict, faults, address = m["verdict"], m["faults"], m["address"]
    name = escape(m["name"])
    head = f'<a href="{escape(address)}">{name}</a>' if address else str(name)
    notes = [
        w
        for w in (f"copy of {m['copy_of']}" if m.get("copy_of") else "", "log no longer there" if m["gone"] else "")
        if w
    ]
    if m.get("open_loop"):
        notes.append("faults injected")
    if m["state"] is MissionState.DEGRADED:
        kept = m.get("duration_s")
        notes.append(f"{labels.span(kept)} of it could be read; {m['reason']}" if kept else m["reason"])
    note = f'<div class="small muted">{escape("; ".join(notes))}</div>' if notes else ""
    start, driving = m.get("start_ns"), m.get("driving_s")
    kinds = Counter(fault_words(f, machine_words) for f in faults)
    words = "; ".join(kind if n == 1 else f"{kind}, {n} times" for kind, n in list(kinds.items())[:2])
    words += f" +{len(faults) - sum(list(kinds.values())[:2])}" if len(kinds) > 2 else ""
    if verdict is Verdict.NOT_ASSESSED and not words:
        words = m.get("title", "")
    if verdict is None:
        kind, words = ("pending" if m["state"] is MissionState.PENDING else "failed"), m["reason"]
        status = f"{mark('warning')}{m['state'].words.capitalize()}"
    else:
        kind = verdict.value
        status = f"{mark(symbol(m))}{_verdict_words(m)}"
    kind += " degraded" if m["state"] is MissionState.DEGRADED else ""
    return (
        f'<tr class="{kind}"><td>{head}{note}</td><td>{labels.utc_mark(start, 16) if start is not None else "no date"}</td>'
        f'<td class="num">{labels.span(driving) if driving is not None else "–"}</td>'
        f'<td><span class="st">{status}</span></td><td>{escape(words)}</td></tr>\n'
    )
