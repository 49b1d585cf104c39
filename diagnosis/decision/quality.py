"""What the log offers and how good it is: signals, what is missing, and the effect on the verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np

from diagnosis.channels.noise import rounding_step
from diagnosis.decision.alike_notes import alike_notes
from diagnosis.decision.missing import applies, cost_of_missing
from diagnosis.decision.scale import Scale
from diagnosis.results.assessment import Assessment
from diagnosis.results.document import MissingRow, QualityRow, SignalRow
from diagnosis.results.left_out import is_left_out
from diagnosis.results.log_rows import ClockRow
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.plain_numbers import plain, with_minus_signs
from diagnosis.results.wheel_model import WheelModelFit
from replay.arrays.blocks import blocks, release
from replay.arrays.processors import each
from replay.arrays.quantiles import quantile_of
from replay.clocks.source_clock import SourceClock
from replay.machine.config import Machine
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline

_GAP_PERIODS = 5


@dataclass(frozen=True)
class Recorded:
    """What a report says of signals as they were recorded; found before their samples are let go of.

    Attributes
    ----------
    rows : Sequence[SignalRow]
        `signal_rows`.
    jitter_ms : float
        99 % quantile of the distance of wheel stamps from their period [ms].
    first_ns : int
        First stamp of a wheel signal; 0 where there is none.
    last_ns : int
        Last one.
    """

    rows: Sequence[SignalRow]
    jitter_ms: float
    first_ns: int
    last_ns: int = 0


def recorded(signals: Signals, timeline: Timeline, words: MachineWords) -> Recorded:
    """Look through the samples of all signals."""
    first = min((int(s.stamps[0]) for n, s in signals.items.items() if n.startswith("wheel.")), default=0)
    last = max((int(s.stamps[-1]) for n, s in signals.items.items() if n.startswith("wheel.")), default=0)
    return Recorded(signal_rows(signals, timeline, words), _jitter_ms(signals, timeline), first, last)


def signal_rows(signals: Signals, timeline: Timeline, words: MachineWords) -> list[SignalRow]:
    """One row per mapped signal: origin, rate, gaps, missing share, rounding step."""

    def row(name: str) -> SignalRow:
        signal, period = signals.items[name], timeline.periods_ns[name]
        gaps, longest = _gaps(signal, period)
        values = timeline.signals.get(name)
        missing = 1.0 if values is None else float(np.mean(~np.isfinite(values)))
        release(values, signal.stamps)
        return {
            "name": name,
            "channel": signal.origin.label,
            "unit": words.unit_of(name),
            "recorded_unit": signal.origin.unit,
            "rate_hz": 1e9 / period if period else None,
            "samples": int(signal.stamps.size),
            "gaps": gaps,
            "longest_gap_s": longest,
            "missing_share": missing,
            "lsb": rounding_step(signal.values),
            "guessed": signal.guessed,
            "source": PurePath(signal.source).name,
        }

    return each(row, signals.items, timeline.size)


def _gaps(signal: Signal, period: int) -> tuple[int, float]:
    """Number and length [s] of the longest of the times without a number; samples that hold none count as missing."""
    count = longest = 0
    last: list[int] = []
    for part in blocks(signal.stamps.size):
        known = signal.stamps[part][np.isfinite(signal.values[part])]
        steps = np.diff(np.concatenate([np.array(last, np.int64), known]))
        count += int(np.count_nonzero(steps > _GAP_PERIODS * period))
        longest = max(longest, int(steps.max(initial=0)))
        last = [int(known[-1])] if known.size else last
    return count, longest * 1e-9


def missing_rows(signals: Signals, machine: Machine, words: MachineWords) -> list[MissingRow]:
    """Signals that would sharpen the diagnosis and are not in the log, with what that costs."""
    names = (name for name in machine.canonical_signals() if name not in signals.items and applies(name, words))
    return [{"name": name, "cost": cost_of_missing(name, words, signals.items, machine.wheels)} for name in names]


def checks(
    signals: Signals,
    found: Recorded,
    timeline: Timeline,
    damage: Sequence[str],
    notes: Sequence[str],
    assessments: Mapping[tuple[str, str], Assessment],
    model: WheelModelFit | None,
    words: MachineWords,
    clocks: Sequence[SourceClock] = (),
    scale: Scale | None = None,
    misplaced: Sequence[str] = (),
) -> list[QualityRow]:
    """Checks of the data with their effect on the verdict."""
    return [
        _sample_rate(found.jitter_ms, timeline.step_ns),
        *_injected(signals),
        *(
            _row("Left out", text, "its signals are not assessed; a mission without them does not get “ready”", False)
            if is_left_out(text)
            else _row("Damage", text, "lost data are not assessed; a damaged log does not get “ready”", False)
            for text in damage
        ),
        _gap_check([row for row in found.rows if row["name"] not in timeline.stands]),
        *_guessed(signals),
        *([_row("Scale of speeds", *scale.result)] if scale is not None else []),
        *(_row("Places of wheels", f"{text}.", "the wrong part may be blamed", False) for text in misplaced),
        *_wheel_model(model, words),
        *(_row("Clock", clock.sentence, *_effect_of(clock)) for clock in clocks if clock.sentence),
        *_notes((*signals.notes, *timeline.notes, *notes), clocks),
        *(_row("Evidence", text) for text in dict.fromkeys(note for a in assessments.values() for note in a.notes)),
    ]


def _row(check: str, result: str, effect: str = "none", ok: bool = True) -> QualityRow:
    return {"check": check, "result": result, "effect": effect, "ok": ok}


def _sample_rate(jitter_ms: float, step_ns: int) -> QualityRow:
    sharp = jitter_ms < step_ns * 2.5e-6
    return _row(
        "Sample rate",
        f"{plain(1e9 / step_ns, 4)} Hz, jitter {plain(jitter_ms)} ms (99 %)",
        "none" if sharp else "the jitter limits the accuracy of onsets",
        sharp,
    )


def _injected(signals: Signals) -> list[QualityRow]:
    if not signals.open_loop:
        return []
    return [
        _row(
            "Injected faults",
            "faults were injected into this recording; its controller did not react to them",
            "the recorded commands are not compared with the law; no tracking error without a second speed",
            False,
        )
    ]


def _gap_check(rows: Sequence[SignalRow]) -> QualityRow:
    gaps = {s["name"]: s["longest_gap_s"] or 0.0 for s in rows if s["gaps"] and not s["name"].startswith("cmd.")}
    if not gaps:
        return _row("Gaps", "none longer than five sample periods")
    names = list(gaps)
    shown = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
    return _row(
        "Gaps",
        f"{shown}: longest {plain(max(gaps.values()))} s",
        "no samples there: no data, or no signal where only one channel is silent",
        False,
    )


def _guessed(signals: Signals) -> list[QualityRow]:
    guessed = [name for name, s in signals.items.items() if s.guessed]
    if not guessed:
        return []
    return [
        _row(
            "Mapping",
            f"{len(guessed)} of {len(signals.items)} signals were found by name",
            "a wrong mapping would falsify the diagnosis: check with `mfhca channels`, fix in [signals]",
        )
    ]


def _wheel_model(model: WheelModelFit | None, words: MachineWords) -> list[QualityRow]:
    if model is None:
        return []
    effect = "none" if model.reliable else "gains and drives are not assessed"
    return [_row(f"{words.part.capitalize()} model", with_minus_signs(model.note), effect, model.reliable)]


def _notes(texts: Iterable[str], clocks: Sequence[SourceClock]) -> list[QualityRow]:
    """Notes of readers and timeline, each once, without those on clocks, which have rows of their own."""
    on_clocks = {clock.sentence for clock in clocks}
    return [
        _row("Note", with_minus_signs(text), "see text") for text in alike_notes(t for t in texts if t not in on_clocks)
    ]


def _effect_of(clock: SourceClock) -> tuple[str, bool]:
    """What a source's clock means for the verdict, and whether all is well."""
    if clock.reason:
        return "delays between the files are not known: its signals are not used", False
    if clock.uncertainty_s is None:
        return "times depend on the offset and drift in the machine file", True
    return f"times of the files agree within ±{plain(1e3 * clock.uncertainty_s, 2)} ms (95 %)", True


def clock_row(clock: SourceClock | None) -> ClockRow | None:
    """How a file's clock was put onto the mission's, for ``report.json``; None for a mission of one file."""
    if clock is None or (clock.method == "reference" and not clock.reference):
        return None
    return {
        "reference": PurePath(clock.reference).name,
        "method": clock.method,
        "offset_s": clock.offset_s,
        "drift_ppm": clock.drift_ppm,
        "uncertainty_s": clock.uncertainty_s,
        "signals": list(clock.signals),
        "overlap_s": clock.overlap_s,
        "reason": clock.reason,
    }


def _jitter_ms(signals: Signals, timeline: Timeline) -> float:
    """99 % quantile of |stamp step − period| over the wheel signals that come regularly [ms]."""
    out, seen = 0.0, set()
    for name, signal in signals.items.items():
        period, place = timeline.periods_ns[name], signal.stamps.__array_interface__["data"][0]
        regular = name.startswith("wheel.") and name not in timeline.stands
        if regular and 0 < period < 2 * timeline.step_ns and signal.stamps.size > 2:
            if place not in seen:
                out = max(out, float(quantile_of(np.abs(np.diff(signal.stamps) - period), 0.99)) * 1e-6)
                release(signal.stamps)
            seen.add(place)
    return out
