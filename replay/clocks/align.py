"""One clock for the files of a mission: offset and drift between them, from what both recorded.

The first file's clock is the mission's. Every other file is compared with the files already on it, by the signals that both
hold. Its stamps become stamp + offset + drift · (stamp − its first stamp), provided that this is more than what the
comparison leaves open. Where the signals do not tell, stamps stay as recorded and `SourceClock.reason` says why. What one
file's recorder needs to get and stamp a sample is part of the offset: the two cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore
from replay.clocks.correlation import match
from replay.clocks.jumps import jumps, pauses, widened
from replay.clocks.line_fit import fit_line
from replay.clocks.shared_series import Shared, shared_series
from replay.clocks.source_clock import Method, SourceClock, some
from replay.clocks.windows import Line
from replay.log.raw_log import Channel, RawLog
from replay.log.source_options import SourceOptions
from replay.machine.config import Machine
from replay.number_words import told
from replay.signals.mapping import map_signals
from replay.signals.signal import Signal

_ONE_DAY_S = 26 * 3600.0  # any time zone, and two hours
_SET_NS = 946_684_800_000_000_000  # clocks that show an earlier year than 2000 were not set, or count from a start
_STRETCH_S = 20.0
_MOST_GAPS = 8
_SEARCH_S = 7200.0
_STEP_S = 0.1
_SURE = 0.75


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
    with np.errstate(all="ignore"):  # damaged logs hold any bits
        return _estimate(reference, other, SourceClock(sources[1], sources[0], "as recorded"))


def _estimate(
    reference: Mapping[str, Signal], other: Mapping[str, Signal], unknown: SourceClock
) -> tuple[SourceClock, Line | None, int]:
    spans = [_span(reference), _span(other)]
    if spans[0] is None or spans[1] is None:
        return replace(unknown, reason="one of them holds no signal of the machine"), None, 0
    origins = (spans[0][0], spans[1][0])
    shared = shared_series(reference, other, origins)
    if not shared:
        return replace(unknown, reason="no moving signal is recorded in both"), None, 0
    between = origins[0] - origins[1]
    found = match(shared, -between * 1e-9)
    reason = f"{some(tuple(s.name for s in shared))}: {found.reason}" if found.reason else ""
    reason = reason or _too_far(found.lag_s + between * 1e-9, origins)
    if reason:
        return replace(unknown, reason=reason), None, 0
    line = fit_line(shared, found.lag_s, found.at_s)
    reason = line.reason
    if not reason and not np.isfinite([line.lag_s, line.drift, *line.covariance.ravel()]).all():
        reason = "their stamps or values are damaged"
    if not reason:
        reason, more = jumps(shared, line, pauses(reference, other, origins, line))
        line = widened(line, more, (spans[1][1] - spans[1][0]) * 1e-9)
    reason = reason or _steps(shared, line)
    if reason:
        return replace(unknown, reason=reason), None, 0
    ends = np.array([0.0, (spans[1][1] - spans[1][0]) * 1e-9])
    offset = line.lag(ends) + between * 1e-9
    uncertainty = float(line.bound(ends).max())
    moved = ends + line.lag(ends)
    overlap = min(moved[1], (spans[0][1] - origins[0]) * 1e-9) - max(moved[0], 0.0)
    method: Method = "estimated" if float(np.abs(offset).max()) > uncertainty else "common"
    clock = replace(
        unknown,
        method=method,
        offset_s=float(offset[0]),
        drift_ppm=line.drift * 1e6,
        uncertainty_s=uncertainty,
        signals=line.signals,
        overlap_s=float(overlap),
    )
    return clock, line, between


def _too_far(offset: float, origins: tuple[int, int]) -> str:
    """Refuse a shift of days between clocks that were both set: it may be another drive of the same kind."""
    if abs(offset) < _ONE_DAY_S or min(origins) < _SET_NS:
        return ""
    return (
        f"they agree under a shift of {told(offset, '+.3f')} s ({told(offset / 86400, '+.1f')} days), which may also be another drive of the "
        "same kind"
    )


def _steps(shared: Sequence[Shared], line: Line) -> str:
    """Say where signals that tell nothing of the line agree under another shift."""
    start, stop = min(s.other.t[0] for s in shared), max(s.other.t[-1] for s in shared)
    seen = np.unique(np.concatenate([[start], line.seen, [stop]]))
    gaps = np.diff(seen)
    found: list[tuple[float, float]] = []
    for i in np.argsort(-gaps, kind="stable")[:_MOST_GAPS].tolist():
        if gaps[i] < max(_STRETCH_S, 3.0 * float(np.median(gaps))):
            break
        first, last = float(seen[i]), float(seen[i + 1])
        if i == len(gaps) - 1:  # what follows the last reading shows best at the end
            first = max(first, last - 2 * _STRETCH_S)
        last = min(last, first + 2 * _STRETCH_S)
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
                return f"its clock jumps: {first - start:.0f} s after its start, the signals need a further shift of {told(step, '+.2f')} s"
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
                n: replace(s, stamps=_shifted(s.stamps, line_found, start, between, logs[i].store))
                for n, s in signals[i].items()
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


def _shifted(stamps: NDArray[np.int64], line: Line, start: int, between: int, store: ColumnStore) -> NDArray[np.int64]:
    def moved(rows: NDArray[np.int64]) -> NDArray[np.int64]:
        lag = line.lag(np.asarray((rows - start) * 1e-9, np.float64))
        return rows + between + np.rint(lag * 1e9).astype(np.int64)

    return store.map(moved, stamps)


def _moved(log: RawLog, line: Line, start: int, between: int) -> RawLog:
    """Move every channel; channels that share their stamps go on sharing them."""
    known: dict[int, NDArray[np.int64]] = {}
    channels: dict[str, Channel] = {}
    for name, channel in log.channels.items():
        key = id(channel.stamps)
        if key not in known:
            known[key] = _shifted(channel.stamps, line, start, between, log.store)
        channels[name] = replace(channel, stamps=known[key])
    return replace(log, channels=channels)
