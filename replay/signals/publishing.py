"""Commands that their sender publishes when they change: how long the last value stands.

A measurement that is silent has no signal. A command that is silent may only have stayed what it was: CAN nodes with an event
timer send what changed, and else the same again every so often (a heartbeat); others send nothing until the next change.

The heartbeat is found in the log: every message that repeats the one before it comes after the same time, while those that
differ come sooner. A value then stands for one and a half of it, so that a sender that fell silent is silent soon. Without a
heartbeat nothing in the log tells a value that stands from a sender that fell silent: the machine file says it
(``on_change = true``), and `on_change_hint` asks for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_of
from replay.machine.signal_table import is_asked
from replay.signals.signal import Signal, quantity_kind

Stamps = NDArray[np.int64]

_LOOKED = 50_000  # messages of a topic in which its heartbeat is looked for
_LEAST_REPEATS = 8
_ALIKE, _MOSTLY = 0.2, 0.95  # a heartbeat's times from message to message differ by less, in most of them
_LATE = 1.25  # heartbeats, within which nearly every message comes
_SLOW = 2.5  # usual periods: a heartbeat that is not slower needs no hold of its own
_STANDS = 1.5  # heartbeats
_SILENT_NS = 3_000_000_000
_OTHERS, _THEIR_MESSAGES = 2, 20  # other wheels, and messages of each of them, beside which one is silent
_FEW, _GAPS = 10, 3  # messages; of more, a topic that ends once may have lost its sender
_REPEATS = 0.02  # share of messages that repeat the one before
_UNKNOWN, _UNKNOWN_S = 0.05, 2.0  # share of the mission, and time, from which on what is not known is worth a hint
_BREAK = 0.2  # of the time without messages, in which measurements may be silent as well
_NAMED = 3
_HINT = (
    "if commands are published on change only, add on_change = true to their lines under [signals] in a machine file"
)


@dataclass(frozen=True)
class Standing:
    """How long values of a command stand.

    Attributes
    ----------
    hold_ns : float
        Longest time [ns]; infinite: until the next message.
    ends_ns : Stamps, shape (k,)
        Moments beyond which no earlier value stands, rising [ns].
    longest_s : float
        Longest time for which a value stands in the log [s].
    note : str
        What is said of it.
    """

    hold_ns: float
    ends_ns: Stamps
    longest_s: float = 0.0
    note: str = ""


def standing_commands(items: Mapping[str, Signal], usual_ns: Mapping[str, float]) -> dict[str, Standing]:
    """Commands whose last value stands for longer than usual.

    Parameters
    ----------
    items : Mapping[str, Signal]
        All signals of the mission.
    usual_ns : Mapping[str, float]
        How long a value of each would stand otherwise [ns].
    """
    out = {}
    span = measured_span(items)
    for group in _topics(items):
        asked = [s for s in group if is_asked(s.name) and s.stamps.size]
        beat = heartbeat(group) if asked else None
        for signal in asked:
            name, usual = signal.name, usual_ns[signal.name]
            if beat is not None:
                longest = _STANDS * beat * 1e-9
                note = f"{name}: sent when it changes, and else every {beat * 1e-9:.3g} s; a value stands for {longest:.3g} s"
                out[name] = Standing(max(usual, _STANDS * beat), np.empty(0, np.int64), longest, note)
            elif signal.origin.on_change:
                ends, longest = _silences(signal, items, usual, span), _longest_wait(signal, span)
                note = f"{name}: published on change, as the machine file says; a value stands until the next, here for up to {longest:.1f} s"
                if ends.size:
                    at = (int(ends[0]) - span[0]) * 1e-9
                    note += f", but not from {at:.1f} s on, where it fell silent beside the other wheels'"
                out[name] = Standing(np.inf, ends, longest, note)
    return out


def heartbeat(topic: Sequence[Signal]) -> int | None:
    """Time after which a sender repeats what has not changed [ns]; None where it does not, or where it always sends in time.

    Parameters
    ----------
    topic : Sequence[Signal]
        What one topic brings, or one channel, at the same stamps.
    """
    stamps = topic[0].stamps[:_LOOKED]
    if stamps.size <= _LEAST_REPEATS:
        return None
    repeated = np.logical_and.reduce([s.values[1 : stamps.size] == s.values[: stamps.size - 1] for s in topic])
    waited = np.diff(stamps)
    if np.count_nonzero(repeated) < _LEAST_REPEATS:
        return None
    beat = float(median_of(waited[repeated]))
    if beat < _SLOW * float(median_of(waited)):
        return None
    alike = np.abs(waited[repeated] - beat) < _ALIKE * beat
    in_time = waited < _LATE * beat
    return round(beat) if min(np.mean(alike), np.mean(in_time)) >= _MOSTLY else None


def on_change_hint(items: Mapping[str, Signal]) -> str:
    """What to write if commands that are rarely sent are published on change; empty where none is.

    Each message differs from the one before, and for some of the mission, while measurements go on, there is none.
    """
    start, stop = measured_span(items)
    measured = [s for n, s in items.items() if not is_asked(n) and s.stamps.size > 1]
    found, most = list[Signal](), 0.0
    for group in _topics(items):
        signal = next((s for s in group if is_asked(s.name) and s.stamps.size), None)
        if signal is None or signal.origin.on_change or not measured or _comes_always(signal, start, stop):
            continue
        if heartbeat(group) is not None:
            continue
        silent, longest, gaps = _silent(signal, start, stop)
        few = signal.stamps.size <= _FEW
        if silent < max(_UNKNOWN * (stop - start), _UNKNOWN_S * 1e9) or not (few or gaps >= _GAPS) or _repeats(group):
            continue
        if min(_silent(m, start, stop)[0] for m in measured) > _BREAK * silent:
            continue
        found += [s for s in group if is_asked(s.name)]
        most = max(most, longest * 1e-9)
    if not found:
        return ""
    more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
    names = ", ".join(s.name for s in found[:_NAMED]) + more
    come, are, they = ("come", "are", "they") if len(found) > 1 else ("comes", "is", "it")
    return (
        f"{names} {come} rarely: each message differs from the last, and up to {most:.1f} s pass without one, in which {they} {are} not known; "
        f"{_HINT}"
    )


def on_change_hint_in(notes: Iterable[str]) -> tuple[str, str]:
    """What is rarely sent, and what to do, of the note among others that `on_change_hint` made; both empty where none is."""
    return next(((n.removesuffix(f"; {_HINT}"), _HINT) for n in notes if n.endswith(_HINT)), ("", ""))


def measured_span(items: Mapping[str, Signal]) -> tuple[int, int]:
    """First and last stamp of the measurements of wheels and axles, or of all signals where there is none [ns]."""
    own = [s for n, s in items.items() if n.startswith(("wheel.", "steer.")) and s.stamps.size > 1 and not is_asked(n)]
    own = own or [s for s in items.values() if s.stamps.size]
    return min((int(s.stamps[0]) for s in own), default=0), max((int(s.stamps[-1]) for s in own), default=0)


def _topics(items: Mapping[str, Signal]) -> list[list[Signal]]:
    """Signals that come in one message: of one topic, at the same stamps; others each by itself."""
    together: dict[tuple[str, str], list[Signal]] = {}
    for signal in items.values():
        together.setdefault((signal.source, signal.origin.topic or signal.origin.label), []).append(signal)
    out = []
    for group in together.values():
        sizes = {s.stamps.size for s in group}
        if len(sizes) == 1 and all(np.array_equal(s.stamps[:_LOOKED], group[0].stamps[:_LOOKED]) for s in group[1:]):
            out.append(group)
        else:
            out += [[s] for s in group]
    return out


def _comes_always(signal: Signal, start: int, stop: int) -> bool:
    """Whether a signal has as many samples in a span as its usual period makes."""
    some = signal.stamps[:_LOOKED]
    return some.size > _FEW and signal.stamps.size * float(median_of(np.diff(some))) > (1.0 - _UNKNOWN) * (stop - start)


def _repeats(topic: Sequence[Signal]) -> bool:
    """Whether a topic brings the same values again now and then, which no sender on change does."""
    n = min(topic[0].stamps.size, _LOOKED)
    if n < 2:
        return False
    return bool(np.mean(np.logical_and.reduce([s.values[1:n] == s.values[: n - 1] for s in topic])) > _REPEATS)


def _silent(signal: Signal, start: int, stop: int) -> tuple[float, float, int]:
    """Time within a span in which a signal is silent for longer than it usually is, the longest such time [ns], and how many."""
    known = signal.stamps[np.isfinite(signal.values)]
    edge = np.r_[start, known[(known > start) & (known < stop)], stop]
    waited = np.diff(edge)
    usual = float(median_of(np.diff(known))) if known.size > _FEW else 0.0
    long = waited[waited > max(_SLOW * usual, 0.5e9 if signal.name.startswith("cmd.") else 0.0)]
    return float(long.sum()), float(long.max(initial=0)), int(long.size)


def _longest_wait(signal: Signal, span: tuple[int, int]) -> float:
    """Longest time for which a value stands [s]."""
    edge = np.r_[signal.stamps, max(span[1], int(signal.stamps[-1]))]
    return float(np.diff(edge).max(initial=0)) * 1e-9


def _silences(signal: Signal, items: Mapping[str, Signal], usual: float, span: tuple[int, int]) -> Stamps:
    """Where a command of a wheel is silent for long, at another value than 0, while those of the other wheels change all the time.

    Of shape (k,): the moments [ns] from which on its value does not stand.
    """
    kind = quantity_kind(signal.name)
    others = [
        s
        for n, s in items.items()
        if n.startswith("wheel.") and n != signal.name and quantity_kind(n) == kind and s.origin.on_change
    ]
    if not signal.name.startswith("wheel.") or len(others) < _OTHERS:
        return np.empty(0, np.int64)
    edge = np.r_[signal.stamps, max(span[1], int(signal.stamps[-1]))]
    long = np.flatnonzero((np.diff(edge) > _SILENT_NS) & (signal.values != 0.0))
    came = np.array([np.searchsorted(s.stamps, edge[long + 1]) - np.searchsorted(s.stamps, edge[long]) for s in others])
    fell = long[came.min(axis=0) >= _THEIR_MESSAGES] if long.size else long
    ends: Stamps = edge[fell] + round(usual)
    return ends
