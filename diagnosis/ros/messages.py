"""A diagnosis as messages in CDR: ``diagnostic_msgs/DiagnosticArray`` over time, and an event where a fault begins or ends.

Header and event stamps are on the mission's clock, as those of the log's own headers are; the recorder's stamps are for
whoever writes the messages.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from diagnosis.report.confidence import headline
from diagnosis.results.document import IntervalRow, ReportDocument
from diagnosis.results.ending import Ending, ending_of
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Verdict
from diagnosis.ros.statuses import Level, Status, courses, fault_name, level_of
from replay.export.formats.cdr import Cdr

DIAGNOSTICS, EVENTS = "/mfhca/diagnostics", "/mfhca/events"
ARRAY, LOG = "diagnostic_msgs/msg/DiagnosticArray", "rcl_interfaces/msg/Log"
_PERIOD_NS = 1_000_000_000
#: Levels of ``rcl_interfaces/Log``: information, warning, error.
_LOG_LEVELS = {Level.OK: 20, Level.STALE: 20, Level.WARN: 30, Level.ERROR: 40}


class Arrays:
    """The DiagnosticArray messages of a mission: one each second, and one where a part's status changes.

    Parameters
    ----------
    report : ReportDocument
        The diagnosis.
    start_ns, stop_ns : int or None
        Part of the mission to tell of; None: from its start, to its end.

    Attributes
    ----------
    stamps : NDArray[np.int64], shape (n,)
        Stamps on the mission's clock, increasing.
    """

    def __init__(self, report: ReportDocument, start_ns: int | None = None, stop_ns: int | None = None) -> None:
        self._courses = courses(report)
        self._known: dict[tuple[Status, int], bytes] = {}
        first = report["log"]["start_ns"]
        last = first + round(report["log"]["duration_s"] * 1e9)
        start = max(first, first if start_ns is None else start_ns)
        stop = max(min(last, last if stop_ns is None else stop_ns), start)
        changes = [ns for course in self._courses for ns in course.starts if start <= ns <= stop]
        every = np.arange(first, stop + 1, _PERIOD_NS, dtype=np.int64)
        every = every[every >= start]
        self.stamps: NDArray[np.int64] = np.unique(np.concatenate([every, np.array([start, stop, *changes], np.int64)]))

    def messages(self, start: int = 0, stop: int | None = None) -> Iterator[bytes]:
        """Messages start…stop, one per stamp."""
        for ns in self.stamps[start:stop].tolist():
            yield self._message(ns)

    def _message(self, ns: int) -> bytes:
        cdr = Cdr()
        cdr.stamp(ns)
        cdr.text("")
        cdr.number("I", len(self._courses))
        for course in self._courses:
            status = course.at(ns)
            key = (status, cdr.place % 4)  # nothing in a status is wider than four bytes
            if key not in self._known:
                self._known[key] = _status(status, key[1])
            cdr.octets(self._known[key])
        return cdr.message()


def _status(status: Status, start: int) -> bytes:
    cdr = Cdr(start)
    cdr.number("B", int(status.level))
    for text in (status.name, status.message, status.hardware_id):
        cdr.text(text)
    cdr.number("I", len(status.values))
    for pair in status.values:
        for text in pair:
            cdr.text(text)
    return cdr.part()


def events(report: ReportDocument) -> list[tuple[int, bytes]]:
    """Stamp and ``rcl_interfaces/Log`` message of each event: the verdict at the start, every fault's beginning and end."""
    first = report["log"]["start_ns"]
    status = report["verdict"]["status"]
    label, answer = headline(report)
    words = ". ".join(dict.fromkeys(t for t in (label, answer, report["verdict"]["title"]) if t))
    level = Level.ERROR if status == Verdict.STOP else Level.WARN if status == Verdict.WATCH else Level.OK
    found = [(first, 0, _event(first, level, "verdict", words))]
    for fault in report["intervals"]:
        part = fault_name(fault, words_of(report["machine"]))
        begin, end = fault["start_ns"], fault["stop_ns"]
        found.append((begin, 2, _event(begin, level_of(fault["severity"]), part, _begins(fault, part))))
        found.append((end, 1, _event(end, *_ends(fault, part, report))))
    return [(ns, octets) for ns, _, octets in sorted(found, key=lambda e: e[:2])]


def _begins(fault: IntervalRow, part: str) -> str:
    epsilon = fault["epsilon"]
    size = [] if epsilon is None else [f"ε {epsilon['value']:.2f} ({epsilon['low']:.2f}–{epsilon['high']:.2f})"]
    facts = ", ".join([*size, f"p {fault['probability']:.3f}", f"severity {fault['severity']}"])
    return " ".join([f"{fault['id']} begins: {part}, {facts}.", *fault["evidence"]])


def _ends(fault: IntervalRow, part: str, report: ReportDocument) -> tuple[Level, str, str]:
    """Level, part and words of the event at a fault's last moment; one that was not seen to end keeps its level."""
    after = f"after {fault['stop_s'] - fault['start_s']:.2f} s"
    ending = ending_of(fault, report)
    if ending is Ending.ENDED:
        return Level.OK, part, f"{fault['id']} ends: {part}, {after}"
    level = level_of(fault["severity"])
    if ending is Ending.LASTS:
        return level, part, f"{fault['id']} {Ending.LASTS}: {part}, {after}"
    return level, part, f"{fault['id']} was last seen, not seen to end: {part}, {after}"


def _event(ns: int, level: Level, name: str, words: str) -> bytes:
    cdr = Cdr()
    cdr.stamp(ns)
    cdr.number("B", _LOG_LEVELS[level])
    for text in (f"mfhca: {name}", words, "report.json", "diagnose"):
        cdr.text(text)
    cdr.number("I", 0)
    return cdr.message()
