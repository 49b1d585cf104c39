"""Which stamp a message gets, and how header, log and publish clocks relate."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from replay.rawlog import Channel, Clock

FAR_NS = 1_000_000_000


@dataclass
class Report:
    """Notes and damage gathered while reading; repeated sentences are kept once."""

    notes: list[str] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)

    def note(self, text: str) -> None:
        """Add a harmless fact."""
        if text not in self.notes:
            self.notes.append(text)

    def lost(self, text: str) -> None:
        """Add a loss."""
        if text not in self.damage:
            self.damage.append(text)


@dataclass(frozen=True)
class _Lead:
    """Header clock against log clock, as a straight line through the medians of the first and last third."""

    count: int
    at: tuple[int, int]
    ahead: tuple[int, int]

    @staticmethod
    def of(log: NDArray[np.int64], header: NDArray[np.int64]) -> _Lead | None:
        """Return the line, or None where the stamps are too few or do not run with the log."""
        n = len(log)
        if n < 12 or not 0.1 < float(np.ptp(header)) / max(float(np.ptp(log)), 1.0) < 10:
            return None
        ends = slice(0, n // 3), slice(n - n // 3, n)
        at = tuple(int(np.median(log[e] - log[0])) + int(log[0]) for e in ends)
        ahead = tuple(int(np.median(header[e] - log[e])) for e in ends)
        return _Lead(n, (at[0], at[1]), (ahead[0], ahead[1]))

    def to_header(self, log: NDArray[np.int64]) -> NDArray[np.int64]:
        """Header stamps that messages with these log stamps would carry."""
        rate = (self.ahead[1] - self.ahead[0]) / max(self.at[1] - self.at[0], 1)
        moved: NDArray[np.int64] = log + self.ahead[0] + np.rint(rate * (log - self.at[0])).astype(np.int64)
        return moved


class Clocks:
    """Chooses stamps topic by topic and remembers what to say about them."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self.clock, self.report = clock, report
        self.no_header: list[str] = []
        self.far: dict[str, list[str]] = {}
        self.near = 0
        self.lead: _Lead | None = None

    def stamps(
        self,
        label: str,
        header: tuple[NDArray[np.int64], NDArray[np.int64]] | None,
        log: NDArray[np.int64],
        publish: NDArray[np.int64],
    ) -> NDArray[np.int64]:
        """Stamps of one topic's messages on the chosen clock.

        Parameters
        ----------
        label : str
            The topic.
        header : tuple[NDArray[np.int64], NDArray[np.int64]] or None
            Rows that have a header stamp, and the stamps of all n rows [ns].
        log, publish : NDArray[np.int64], shape (n,)
            The container's stamps [ns].
        """
        if self.clock == "publish":
            if publish.any():
                return publish
            self.report.note(f"{label} has no publish stamps; it stands on the log clock")
            return log
        if header is None:
            self.no_header.append(label)
            return log
        rows, stamps = header
        given = stamps != 0
        if not given.any():
            self.no_header.append(label)
            return log
        ahead = int(np.median(stamps[given] - log[given]))
        if abs(ahead) > FAR_NS:
            self.far.setdefault(_span(ahead), []).append(label)
            lead = _Lead.of(log[given], stamps[given])
            if lead is not None and (self.lead is None or lead.count > self.lead.count):
                self.lead = lead
        else:
            self.near = max(self.near, len(rows))
        if self.clock == "log":
            return log
        zero = np.zeros(len(log), np.bool_)
        zero[rows] = ~given[rows]
        if zero.any():
            shift = ahead if abs(ahead) > FAR_NS else 0
            self.report.note(f"{label}: {zero.sum()} of {len(rows)} header stamps are zero; log stamps stand in")
            stamps[zero] = log[zero] + shift
        return stamps

    def finish(self, channels: dict[str, Channel]) -> None:
        """Bring topics without header stamps to a far header clock, and write the notes."""
        for span, topics in self.far.items():
            self.report.note(f"header stamps lie {span} the log's stamps (median): {_some(topics)}")
        if self.clock != "header" or not self.no_header:
            return
        if self.lead is None or self.near >= self.lead.count:
            self.report.note(f"no header stamps (or all zero), so on the log clock: {_some(self.no_header)}")
            return
        moved: dict[int, tuple[NDArray[np.int64], NDArray[np.int64]]] = {}
        for name, channel in channels.items():
            if channel.topic in self.no_header:
                old = channel.stamps
                if id(old) not in moved:
                    moved[id(old)] = (old, self.lead.to_header(old))
                channels[name] = replace(channel, stamps=moved[id(old)][1])
        self.report.note(
            "no header stamps (or all zero), so moved from the log clock by the other topics' header offset: "
            + _some(self.no_header)
        )


def _span(ns: int) -> str:
    seconds = abs(ns) / 1e9
    size = f"{seconds / 86400:.1f} days" if seconds > 2 * 86400 else f"{seconds:.1f} s"
    return f"{size} {'before' if ns < 0 else 'after'}"


def _some(names: list[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
