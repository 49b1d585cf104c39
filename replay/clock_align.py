"""One clock for the files of a mission: offset and drift between them, from what both recorded.

The first file's clock is the mission's. Every other file is compared with the files already on it, by the signals that both
hold. Its stamps become stamp + offset + drift · (stamp − its first stamp), provided that this is more than what the
comparison leaves open. Where the signals do not tell, stamps stay as recorded and `SourceClock.reason` says why. What one
file's recorder needs to get and stamp a sample is part of the offset: the two cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from replay.clock_coarse import match
from replay.clock_fit import Line, fit_line
from replay.clock_series import Shared, shared_series
from replay.machine import Machine
from replay.mapping import map_signals
from replay.rawlog import Channel, RawLog
from replay.signals import Signal
from replay.sources import SourceOptions

_ONE_DAY_S = 26 * 3600.0  # any time zone, and two hours
_SET_NS = 946_684_800_000_000_000  # clocks that show an earlier year than 2000 were not set, or count from a start
_STRETCH_S = 30.0
_SEARCH_S = 7200.0
_STEP_S = 0.1
_SURE = 0.75

Method = Literal["reference", "estimated", "common", "as recorded", "given"]


@dataclass(frozen=True)
class SourceClock:
    """How the clock of one source relates to the mission's.

    Attributes
    ----------
    source : str
        The file.
    reference : str
        File with whose signals it was compared; empty where it was not.
    method : str
        ``reference`` (its clock is the mission's), ``estimated`` (offset and drift were applied), ``common`` (measured, and
        too small to be told from none: stamps are unchanged), ``given`` (applied as the machine file says), ``as recorded``
        (unchanged: asked for, or nothing to compare, see `reason`).
    offset_s : float
        Seconds that a stamp at the source's first sample gets, or for ``common`` would have got.
    drift_ppm : float
        Change of the offset [microseconds per second].
    uncertainty_s : float or None
        95 % bound of the error of the offset anywhere in the source [s]; None where nothing was measured.
    signals : tuple[str, ...]
        Signals that were compared.
    overlap_s : float
        Time that both files cover after that [s].
    reason : str
        Why nothing was estimated; else empty.
    """

    source: str
    reference: str
    method: Method
    offset_s: float = 0.0
    drift_ppm: float = 0.0
    uncertainty_s: float | None = None
    signals: tuple[str, ...] = ()
    overlap_s: float = 0.0
    reason: str = ""

    @property
    def sentence(self) -> str:
        """What was found and done, for the report; empty for the reference."""
        name, base = PurePath(self.source).name, PurePath(self.reference).name
        change = f"{_seconds(self.offset_s)} at its start and {self.drift_ppm:+.1f} ppm"
        if self.method == "estimated":
            return (
                f"{name}: its stamps were moved onto the clock of {base} by {change} (95 % within ±{_size(self.uncertainty_s)} "
                f"throughout), from {_list(self.signals)}, recorded in both for {self.overlap_s:.0f} s"
            )
        if self.method == "common":
            return (
                f"{name} and {base} share one clock: {change} is no more than the ±{_size(self.uncertainty_s)} that "
                f"{_list(self.signals)} leave open; stamps are unchanged"
            )
        if self.method == "given":
            return f"{name}: its stamps were moved by {change}, as the machine file says"
        if self.method == "as recorded" and self.reason:
            return (
                f"{name}: its clock could not be compared with {base}: {self.reason}; its stamps are taken as recorded. "
                "Set clock_offset and clock_drift in the machine file's [sources] if they are known, or clock = "
                '"as recorded" if the clocks are common'
            )
        return f"{name}: its stamps are taken as recorded, as the machine file says" if self.reference else ""


def estimate(
    reference: Mapping[str, Signal], other: Mapping[str, Signal], sources: tuple[str, str] = ("", "")
) -> tuple[SourceClock, Line | None, int]:
    """Compare two files' clocks by the signals that both recorded.

    Parameters
    ----------
    reference, other : Mapping[str, Signal]
        Signals of the two files by canonical name.
    sources : tuple[str, str]
        Names of the two files.

    Returns
    -------
    tuple[SourceClock, Line or None, int]
        What was found; the lag [s] over the seconds since the other file's first stamp, to which the third, the distance
        of the two first stamps [ns], is to be added. None where nothing was found.
    """
    unknown = SourceClock(sources[1], sources[0], "as recorded")
    spans = [_span(reference), _span(other)]
    if spans[0] is None or spans[1] is None:
        return replace(unknown, reason="one of them holds no signal of the machine"), None, 0
    origins = (spans[0][0], spans[1][0])
    shared = shared_series(reference, other, origins)
    if not shared:
        return replace(unknown, reason="no signal that moves is recorded in both"), None, 0
    between = origins[0] - origins[1]
    found = match(shared, -between * 1e-9)
    reason = f"{_list(tuple(s.name for s in shared))}: {found.reason}" if found.reason else ""
    reason = reason or _too_far(found.lag_s + between * 1e-9, origins)
    if reason:
        return replace(unknown, reason=reason), None, 0
    line = fit_line(shared, found.lag_s, found.at_s)
    reason = line.reason or _steps(shared, line)
    if reason:
        return replace(unknown, reason=reason), None, 0
    ends = np.array([0.0, (spans[1][1] - spans[1][0]) * 1e-9])
    offset = line.lag(ends) + between * 1e-9
    uncertainty = float(line.bound(ends).max())
    moved = ends + line.lag(ends)
    overlap = min(moved[1], (spans[0][1] - origins[0]) * 1e-9) - max(moved[0], 0.0)
    method: Method = "estimated" if float(np.abs(offset).max()) > uncertainty else "common"
    clock = SourceClock(
        sources[1], sources[0], method, float(offset[0]), line.drift * 1e6, uncertainty, line.signals, float(overlap)
    )
    return clock, line, between


def _too_far(offset: float, origins: tuple[int, int]) -> str:
    """Refuse a shift of days between clocks that were both set: it may be another drive of the same kind."""
    if abs(offset) < _ONE_DAY_S or min(origins) < _SET_NS:
        return ""
    return (
        f"they agree under a shift of {offset:+.3f} s ({offset / 86400:+.1f} days), which may as well be another drive of the "
        "same kind"
    )


def _steps(shared: Sequence[Shared], line: Line) -> str:
    """Say where signals that tell nothing of the line agree under another shift."""
    longest = max((s.other for s in shared), key=lambda s: len(s.t)).t
    count = min(8, max(1, int(np.ptp(longest) // _STRETCH_S)))
    found: list[tuple[float, float]] = []
    for rows in np.array_split(longest, count):
        first, last = float(rows[0]), min(float(rows[-1]), float(rows[0]) + 2 * _STRETCH_S)
        if ((line.seen >= first) & (line.seen <= last)).any():
            continue
        lag = float(line.lag(np.array([first]))[0])
        near = (first + lag - _SEARCH_S, last + lag + _SEARCH_S)
        parts = [replace(s, reference=s.reference.within(*near), other=s.other.within(first, last)) for s in shared]
        parts = [s for s in parts if all(len(x.t) > 20 and np.ptp(x.x) > 0 for x in (s.reference, s.other))]
        if not parts:
            continue
        place = match(parts, lag)
        step = place.lag_s - lag
        if not place.reason and abs(step) > _STEP_S:
            found.append((first, step))
            if place.correlation > _SURE or any(abs(step - other) < _STEP_S for _, other in found[:-1]):
                return f"its clock jumps: {first - longest[0]:.0f} s after its start signals agree under a shift by another {step:+.2f} s"
    return ""


def align_clocks(
    logs: Sequence[RawLog], machine: Machine, options: Sequence[SourceOptions]
) -> tuple[list[RawLog], tuple[SourceClock, ...]]:
    """Put the files of one mission onto the clock of the first.

    Parameters
    ----------
    logs : Sequence[RawLog]
        As read.
    machine : Machine
        Where signals are recorded.
    options : Sequence[SourceOptions]
        Of each log; its `clock`, `clock_offset` and `clock_drift` switch off or replace the estimate.

    Returns
    -------
    tuple[list[RawLog], tuple[SourceClock, ...]]
        The logs with their stamps moved, and what was done to each.
    """
    out = list(logs)
    clocks: dict[int, SourceClock] = {}
    waiting: list[int] = []
    for i, (log, option) in enumerate(zip(logs, options, strict=True)):
        if option.clock_offset is not None or option.clock_drift is not None:
            offset, drift = option.clock_offset or 0.0, option.clock_drift or 0.0
            start = _first_stamp(log)
            line = Line(0.0, offset, drift * 1e-6, np.zeros((2, 2)))
            out[i] = _moved(log, line, start, 0)
            clocks[i] = SourceClock(log.source, logs[0].source, "given", offset, drift)
        elif i == 0:
            clocks[i] = SourceClock(log.source, "", "reference")
        elif option.clock == "as recorded":
            clocks[i] = SourceClock(log.source, logs[0].source, "as recorded")
        else:
            waiting.append(i)
    signals = {i: _signals_of(out[i], machine) for i in range(len(out))} if waiting else {}
    while waiting:
        i, clock, line_found, between = _next(waiting, sorted(clocks), signals, logs)
        waiting.remove(i)
        clocks[i] = clock
        if clock.method == "estimated" and line_found is not None:
            start = _first(signals[i])
            out[i] = _moved(out[i], line_found, start, between)
            signals[i] = {
                n: replace(s, stamps=_shifted(s.stamps, line_found, start, between)) for n, s in signals[i].items()
            }
    return out, tuple(clocks[i] for i in range(len(out)))


def _next(
    waiting: list[int], placed: list[int], signals: Mapping[int, Mapping[str, Signal]], logs: Sequence[RawLog]
) -> tuple[int, SourceClock, Line | None, int]:
    """Return the first waiting file that agrees with a placed one; where none does, the first as recorded."""
    failed: tuple[int, SourceClock, Line | None, int] | None = None
    for i in waiting:
        for j in placed:
            found = estimate(signals[j], signals[i], (logs[j].source, logs[i].source))
            if found[1] is not None:
                return (i, *found)
            failed = failed or (i, *found)
    assert failed is not None
    return failed


def _signals_of(log: RawLog, machine: Machine) -> Mapping[str, Signal]:
    """Signals of one file alone; given ones that it does not hold are searched for by the rules."""
    found = map_signals([log], machine)
    held = {name: s for name, s in machine.signals.items() if name in found.items}
    if len(held) < len(machine.signals):
        found = map_signals([log], replace(machine, signals=held))
    return found.items


def _span(signals: Mapping[str, Signal]) -> tuple[int, int] | None:
    stamps = [s.stamps for s in signals.values() if s.stamps.size]
    return (min(int(s[0]) for s in stamps), max(int(s[-1]) for s in stamps)) if stamps else None


def _first(signals: Mapping[str, Signal]) -> int:
    span = _span(signals)
    return 0 if span is None else span[0]


def _first_stamp(log: RawLog) -> int:
    return min((int(c.stamps.min()) for c in log.channels.values() if len(c.stamps)), default=0)


def _shifted(stamps: NDArray[np.int64], line: Line, start: int, between: int) -> NDArray[np.int64]:
    lag = line.lag(np.asarray((stamps - start) * 1e-9, np.float64))
    moved: NDArray[np.int64] = stamps + between + np.rint(lag * 1e9).astype(np.int64)
    return moved


def _moved(log: RawLog, line: Line, start: int, between: int) -> RawLog:
    """Move every channel; channels that share their stamps go on sharing them."""
    known: dict[int, NDArray[np.int64]] = {}
    channels: dict[str, Channel] = {}
    for name, channel in log.channels.items():
        key = id(channel.stamps)
        if key not in known:
            known[key] = _shifted(channel.stamps, line, start, between)
        channels[name] = replace(channel, stamps=known[key])
    return replace(log, channels=channels)


def _seconds(value: float) -> str:
    size = abs(value)
    if size < 0.9995:
        return f"{value * 1e3:+.2f} ms"
    return f"{value:+.4f} s" if size < 1000 else f"{value:+.3f} s ({value / 3600:+.3f} h)"


def _size(value: float | None) -> str:
    return "?" if value is None else f"{value * 1e3:.2g} ms" if value < 0.9995 else f"{value:.2g} s"


def _list(names: Sequence[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
