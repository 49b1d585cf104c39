"""Which stamp a message gets, and how header, log and publish clocks relate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_of
from replay.log.raw_log import Channel, Clock
from replay.log.reading_notes import Report
from replay.number_words import told
from replay.readers.common.clock_lead import Lead
from replay.readers.common.clock_steps import (
    Step,
    find_steps,
    lead_of,
    steady,
    strays,
    unwrapped,
    usual_step,
    without_steps,
)

FAR_NS = 1_000_000_000
_OFFSET_NS = 100_000_000
_SAMPLES = 10_000


class Clocks:
    """Chooses stamps topic by topic, repairs what a second clock proves wrong, and remembers what to say about it."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self.clock, self.report = clock, report
        self.no_header: list[str] = []
        self.far: dict[str, list[str]] = {}
        self.near = 0
        self.lead: Lead | None = None
        self.leads: dict[str, Lead] = {}
        self.log_steps: dict[str, list[int]] = {}

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
            given = publish != 0
            if not given.any():
                self.report.note(f"{label} has no publish stamps; it uses the log clock")
                return log
            return self._repaired(label, "publish", publish, given, log)
        given = np.zeros(len(log), np.bool_)
        if header is not None:
            given[header[0]] = header[1][header[0]] != 0
        if header is None or not given.any():
            self.no_header.append(label)
            return log
        stamps = self._repaired(label, "header", header[1], given, log)
        rows = slice(None) if given.all() else np.flatnonzero(given)
        self._compare(label, stamps[rows], log[rows])
        if self.clock == "log":
            return self._log_without_steps(label, log, stamps, given)
        return stamps

    def _repaired(
        self, label: str, name: str, stamps: NDArray[np.int64], given: NDArray[np.bool_], log: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """Stamps without wraps, steps, strays and zeros, as far as the log clock proves them."""
        say = self.report.note if self.clock == name else lambda text: None
        if given.all() and steady(stamps, log):
            return stamps
        rows = np.flatnonzero(given)
        own, beside = stamps[rows], log[rows]
        own, wraps, span = unwrapped(own, beside)
        if wraps:
            say(
                f"{label}: its {name} stamps are a 32-bit counter that starts again every {span / 1e9:.3f} s; {wraps} wraps "
                "were continued by the log's stamps"
            )
        steps, log_steps = find_steps(own, beside)
        if log_steps and name == "header":
            self.log_steps[label] = [s.size for s in log_steps]
        if steps:
            own = without_steps(own, steps, lead_of(own, beside))
            say(
                f"{label}: its {name} stamps jump {_times(len(steps))} while the log's run on ("
                + ", ".join(f"{_signed(s.size)} after {_since(beside, s.at)}" for s in steps[:3])
                + (", …" if len(steps) > 3 else "")
                + "); the jumps were taken out"
            )
        stray, expected = strays(own, beside)
        if stray.any():
            first = int(np.argmax(stray))
            say(
                f"{label}: {stray.sum()} of {len(own)} {name} stamps deviate from the course of the others (the first by "
                f"{_signed(int(own[first]) - int(expected[first]))}, {_since(beside, first)} after its start); log stamps are used instead"
            )
            own = np.where(stray, expected, own)
        out = stamps.copy()
        out[rows] = own
        zero = ~given & (stamps == 0)
        if zero.any():
            lead = int(median_of(lead_of(own, beside)))
            shift = lead if abs(lead) > FAR_NS else 0
            if name == "header" or self.clock == name:
                say(f"{label}: {zero.sum()} of {len(log)} {name} stamps are zero; log stamps are used instead")
            out[zero] = log[zero] + shift
        return out

    def _compare(self, label: str, stamps: NDArray[np.int64], log: NDArray[np.int64]) -> None:
        """Remember how a topic's header clock relates to the log clock, and say where it drifts."""
        thin = slice(None, None, max(1, len(log) // _SAMPLES))
        ahead = int(median_of(lead_of(stamps[thin], log[thin])))
        lead = Lead.of(log[thin], stamps[thin], len(log))
        if abs(ahead) > FAR_NS:
            self.far.setdefault(_span(ahead), []).append(label)
            if lead is not None and (self.lead is None or lead.count > self.lead.count):
                self.lead = lead
        else:
            self.near = max(self.near, len(stamps))
            if lead is not None:
                self.leads[label] = lead
        if lead is not None and lead.drifts:
            self.report.note(
                f"{label}: its header clock runs {told(lead.rate * 1e6, '+.0f')} ppm against the log's ("
                f"{told((lead.ahead[1] - lead.ahead[0]) / 1e6, '+.0f')} ms over the log)"
                + ("; header stamps are kept" if self.clock == "header" else "")
            )

    def _log_without_steps(
        self, label: str, log: NDArray[np.int64], header: NDArray[np.int64], given: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """Log stamps without the jumps that header stamps prove."""
        rows = np.flatnonzero(given)
        steps, _ = find_steps(log[rows], header[rows])
        if not steps:
            return log
        self.report.note(
            f"{label}: the log's stamps jump {_times(len(steps))} while header stamps run on ("
            + ", ".join(_signed(s.size) for s in steps[:3])
            + "); the jumps were taken out"
        )
        moved = [Step(int(rows[s.at]), s.size) for s in steps]
        return without_steps(log, moved, lead_of(log, header))

    def finish(self, channels: dict[str, Channel]) -> None:
        """Bring topics without header stamps to the header clock where that is another one, and write the notes."""
        for span, topics in self.far.items():
            self.report.note(f"header stamps are {span} the log's stamps (median): {_some(topics)}")
        jumps = self._jumps_of_log()
        if self.clock != "header" or not self.no_header:
            if jumps and self.clock == "header":
                self.report.note(
                    f"the log's stamps jump by {_list_of(jumps)} while header stamps, which are used, run on"
                )
            return
        lead = self.lead if self.lead is not None and self.near < self.lead.count else self._near_lead()
        if lead is None and not jumps:
            self.report.note(f"no header stamps (or all zero), so on the log clock: {_some(self.no_header)}")
            return
        moved: dict[int, tuple[NDArray[np.int64], NDArray[np.int64]]] = {}
        found = 0
        for name, channel in channels.items():
            if channel.topic in self.no_header:
                old = channel.stamps
                if id(old) not in moved:
                    steady, count = _without_jumps(old, jumps)
                    found += count
                    moved[id(old)] = (old, steady if lead is None else lead.to_header(steady))
                channels[name] = replace(channel, stamps=moved[id(old)][1])
        if jumps:
            self.report.note(
                f"the log's stamps jump by {_list_of(jumps)} while header stamps run on; {found} such jumps were taken out of "
                f"topics without header stamps: {_some(self.no_header)}"
            )
        if lead is None:
            self.report.note(f"no header stamps (or all zero), so on the log clock: {_some(self.no_header)}")
        else:
            self.report.note(
                "no header stamps (or all zero), so moved from the log clock by the other topics' header offset: "
                + _some(self.no_header)
            )

    def _jumps_of_log(self) -> list[int]:
        """Jumps of the log clock that every topic with enough header stamps shows [ns]."""
        if not self.log_steps or (set(self.leads) - set(self.log_steps)):
            return []
        first, *rest = self.log_steps.values()
        near = [r for r in rest if len(r) == len(first)]
        if len(near) < len(rest):
            return []
        agree = all(abs(a - b) <= max(20_000_000, 0.05 * abs(a)) for r in near for a, b in zip(first, r, strict=True))
        sure = len(near) > 0 or all(abs(s) > 10 * FAR_NS or s < 0 for s in first)
        return first if agree and sure else []

    def _near_lead(self) -> Lead | None:
        """Header offset below a second, where all topics agree on one that no transport explains."""
        leads = list(self.leads.values())
        if not leads or self.far:
            return None
        ahead = np.array([x.ahead for x in leads], np.float64)
        if np.abs(ahead).min() < _OFFSET_NS or np.ptp(ahead, axis=0).max() > 0.5 * _OFFSET_NS:
            return None
        return max(leads, key=lambda x: x.count)


def _without_jumps(log: NDArray[np.int64], jumps: list[int]) -> tuple[NDArray[np.int64], int]:
    """Take known jumps out of one topic's log stamps, each where its own stamps show it."""
    out = log
    usual = usual_step(log)
    count = 0
    for jump in jumps:
        if len(out) < 2:
            break
        off = np.abs(np.diff(out) - usual - jump)
        k = int(np.argmin(off))
        if off[k] <= max(0.3 * abs(jump), 2 * usual):
            out = np.concatenate([out[: k + 1], out[k + 1 :] - jump])
            count += 1
    return out, count


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _signed(ns: int) -> str:
    seconds = ns / 1e9
    if abs(seconds) >= 2 * 86400:
        return f"{told(seconds / 86400, '+.1f')} days"
    return f"{told(seconds, '+.3f')} s"


def _list_of(jumps: list[int]) -> str:
    return ", ".join(_signed(j) for j in jumps[:3]) + (" and more" if len(jumps) > 3 else "")


def _since(log: NDArray[np.int64], row: int) -> str:
    return f"{(int(log[row]) - int(log[0])) / 1e9:.1f} s"


def _span(ns: int) -> str:
    seconds = abs(ns) / 1e9
    size = f"{seconds / 86400:.1f} days" if seconds > 2 * 86400 else f"{seconds:.1f} s"
    return f"{size} {'before' if ns < 0 else 'after'}"


def _some(names: list[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
