"""What a diagnosis says of every part at every moment: level, a few words, and key values.

A part is OK only while it was judged healthy. While it was not judged, for whatever reason, it is STALE; while a fault
stands, WARN, or ERROR where its severity is high.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from diagnosis.results.candidates import candidates_of, label_of, unclear_words
from diagnosis.results.document import CoverageRow, IntervalRow, ReportDocument, StateRow
from diagnosis.results.fault_rows import mode_words, state_label
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.vocabulary import Kind, Severity
from replay.faults import FAULT_STATES, Side, State


class Level(IntEnum):
    """Levels of ``diagnostic_msgs/DiagnosticStatus``."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class Status:
    """One ``diagnostic_msgs/DiagnosticStatus``; `values` are its keys and values in their order."""

    level: Level
    name: str
    message: str
    hardware_id: str
    values: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class PartCourse:
    """One part over the mission.

    Attributes
    ----------
    name : str
        ``FR speed sensor``.
    starts : tuple[int, ...]
        Stamps from which each status holds, increasing [ns on the mission's clock].
    statuses : tuple[Status, ...]
        One per start.
    """

    name: str
    starts: tuple[int, ...]
    statuses: tuple[Status, ...]

    def at(self, ns: int) -> Status:
        """Status at a moment; before the first one, the first."""
        return self.statuses[max(bisect_right(self.starts, ns) - 1, 0)]


def courses(report: ReportDocument) -> tuple[PartCourse, ...]:
    """Course of every part that the report covers, in its order."""
    return tuple(_course(report, row) for row in report["coverage"])


def fault_name(fault: IntervalRow, words: MachineWords) -> str:
    """Part and row of a fault: ``FR speed sensor stuck``; its candidates where no row has the majority."""
    part = words.part_words(fault["kind"], fault["component"], fault["side"])
    modes = candidates_of(fault)
    return f"{part} {unclear_words(fault['side'], modes) if modes else mode_words(fault['side'], fault['mode'])}"


def level_of(severity: str) -> Level:
    """Level of a fault."""
    return Level.ERROR if severity == Severity.HIGH else Level.WARN


def hardware_of(report: ReportDocument) -> str:
    """What the statuses are of: the machine's identity, else its name."""
    return report["machine"]["id"] or report["machine"]["name"]


def _course(report: ReportDocument, row: CoverageRow) -> PartCourse:
    component, side = row["component"], row["side"]
    kind = Kind.STEER if component in report["machine"]["axles"] else Kind.WHEEL
    name, origin = words_of(report["machine"]).part_words(kind, component, side), report["log"]["start_ns"]
    states = sorted(
        (s for s in report["states"] if (s["component"], s["side"]) == (component, side)), key=lambda s: s["start_s"]
    )
    faults = [i for i in report["intervals"] if i["component"] == component and side in Side(i["side"]).sides]
    moments = {0.0, *(s[k] for s in states for k in ("start_s", "stop_s"))}
    moments |= {f[k] for f in faults for k in ("start_s", "stop_s")}
    # The end of the mission begins nothing.
    times = sorted(t for t in moments if 0.0 <= t < report["log"]["duration_s"]) or [0.0]
    starts, statuses = list[int](), list[Status]()
    for t in times:
        status = _status(name, hardware_of(report), row, _state_at(states, t), _fault_at(faults, t))
        if not statuses or status != statuses[-1]:
            starts.append(origin + round(t * 1e9))
            statuses.append(status)
    return PartCourse(name, tuple(starts), tuple(statuses))


def _state_at(states: Sequence[StateRow], t: float) -> StateRow | None:
    return next((s for s in states if s["start_s"] <= t < s["stop_s"]), None)


def _fault_at(faults: Sequence[IntervalRow], t: float) -> IntervalRow | None:
    """The most severe fault of a moment."""
    found = [f for f in faults if f["start_s"] <= t < f["stop_s"]]
    return max(found, key=lambda f: (Severity(f["severity"]).rank, f["probability"]), default=None)


def _status(name: str, hardware: str, row: CoverageRow, state: StateRow | None, fault: IntervalRow | None) -> Status:
    if fault is not None:
        level, message, values = level_of(fault["severity"]), _fault_message(fault), _fault_values(fault)
    else:
        known = State.NOT_ASSESSED if state is None else State(state["state"])
        reason = "" if state is None else state["reason"]
        level = Level.OK if known is State.HEALTHY else Level.WARN if known in FAULT_STATES else Level.STALE
        label = state_label(known, row["side"])
        message = f"{label}: {reason}" if reason else label
        values = [("state", known.value), *([("reason", reason)] if reason else []), ("evidence", row["tier"])]
    return Status(level, name, message, hardware, (("level", str(int(level))), *values))


def _fault_message(fault: IntervalRow) -> str:
    epsilon = fault["epsilon"]
    size = "" if epsilon is None else f", ε {epsilon['value']:.2f}"
    return f"{label_of(fault)}{size}, p {fault['probability']:.2f}, {fault['severity']} ({fault['id']})"


def _fault_values(fault: IntervalRow) -> list[tuple[str, str]]:
    """Key values of a fault; what is not known is left out, so that a key holds numbers only or texts only."""
    epsilon = fault["epsilon"]
    modes = candidates_of(fault)
    values = [
        ("state", "faulty" if modes else str(fault["mode"])),
        ("candidates", ", ".join(modes)) if modes else ("row", f"{fault['side']} {fault['mode']}"),
        ("fault", fault["id"]),
        ("severity", str(fault["severity"])),
        ("p", f"{fault['probability']:.6g}"),
    ]
    if epsilon is not None:
        sizes = (("epsilon", epsilon["value"]), ("epsilon_low", epsilon["low"]), ("epsilon_high", epsilon["high"]))
        values += [(key, f"{size:.6g}") for key, size in sizes]
    evidence = " ".join(fault["evidence"])
    values += [("evidence", f"{fault['tier']}: {evidence}" if evidence else str(fault["tier"]))]
    return [*values, ("advice", fault["advice"])]
