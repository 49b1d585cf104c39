"""What the log offers and how good it is: signals, what is missing, and the effect on the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from diagnosis.channels.noise import rounding_step
from diagnosis.decision.missing import cost_of_missing
from diagnosis.results.assessment import Assessment
from diagnosis.wheels.identification import WheelModelFit
from replay.arrays.spill import blocks, release
from replay.clocks.source_clock import SourceClock
from replay.machine.config import Machine
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline

_GAP_PERIODS = 5
_UNITS = {"v": "m/s", "v_ref": "m/s", "v_true": "m/s", "omega": "rad/s", "yaw_rate": "rad/s", "speed": "m/s"}


def unit_of(signal: str) -> str:
    """SI unit of a canonical signal as shown."""
    leaf = signal.rpartition(".")[2]
    if leaf in _UNITS:
        return _UNITS[leaf]
    if leaf.startswith("pressure"):
        return "Pa"
    if leaf.startswith("phi") or signal == "odom.yaw":
        return "rad"
    if leaf in ("lat", "lon"):
        return "deg"
    return "m" if signal.startswith("odom.") else "of full opening"


@dataclass(frozen=True)
class Recorded:
    """What a report says of signals as they were recorded; found before their samples are let go of.

    Attributes
    ----------
    rows : Sequence[Mapping[str, Any]]
        `signal_rows`.
    jitter_ms : float
        99 % quantile of the distance of wheel stamps from their period [ms].
    first_ns : int
        First stamp of a wheel signal; 0 where there is none.
    """

    rows: Sequence[Mapping[str, Any]]
    jitter_ms: float
    first_ns: int


def recorded(signals: Signals, timeline: Timeline) -> Recorded:
    """Look through the samples of all signals."""
    first = min((int(s.stamps[0]) for n, s in signals.items.items() if n.startswith("wheel.")), default=0)
    return Recorded(signal_rows(signals, timeline), _jitter_ms(signals, timeline), first)


def signal_rows(signals: Signals, timeline: Timeline) -> list[dict[str, Any]]:
    """One row per mapped signal: origin, rate, gaps, missing share, rounding step."""
    rows = []
    for name, signal in signals.items.items():
        period = timeline.periods_ns[name]
        gaps, longest = _gaps(signal, period)
        values = timeline.signals.get(name)
        missing = 1.0 if values is None else float(np.mean(~np.isfinite(values)))
        release(values, signal.stamps)
        rows.append(
            {
                "name": name,
                "channel": signal.origin.label,
                "unit": unit_of(name),
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
        )
    return rows


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


def missing_rows(signals: Signals, machine: Machine) -> list[dict[str, str]]:
    """Signals that would sharpen the diagnosis and are not in the log, with what that costs."""
    rows = []
    for name in machine.canonical_signals():
        if name in signals.items:
            continue
        cost = cost_of_missing(name)
        if cost:
            rows.append({"name": name, "cost": cost})
    return rows


def checks(
    signals: Signals,
    found: Recorded,
    timeline: Timeline,
    damage: Sequence[str],
    notes: Sequence[str],
    assessments: Mapping[tuple[str, str], Assessment],
    model: WheelModelFit | None,
    clocks: Sequence[SourceClock] = (),
) -> list[dict[str, Any]]:
    """Checks of the data with their effect on the verdict."""
    rows: list[dict[str, Any]] = []

    def row(check: str, result: str, effect: str = "none", ok: bool = True) -> None:
        rows.append({"check": check, "result": result, "effect": effect, "ok": ok})

    jitter = found.jitter_ms
    row(
        "Sample rate",
        f"{1e9 / timeline.step_ns:.4g} Hz, jitter {jitter:.3g} ms (99 %)",
        "none" if jitter < timeline.step_ns * 2.5e-6 else "onsets are only as sharp as the jitter",
        jitter < timeline.step_ns * 2.5e-6,
    )
    if signals.open_loop:
        row(
            "Injected faults",
            "faults were written into this recording; its controller never met them",
            "the recorded commands are not compared with the law; no tracking error without a second speed",
            False,
        )
    for text in damage:
        row("Damage", text, "what is lost is not assessed; no “ready” from a damaged log", False)
    gaps = {s["name"]: s["longest_gap_s"] for s in found.rows if s["gaps"] and not s["name"].startswith("cmd.")}
    worst = list(gaps)
    if worst:
        longest = max(gaps.values())
        shown = ", ".join(worst[:4]) + (f" and {len(worst) - 4} more" if len(worst) > 4 else "")
        row(
            "Gaps",
            f"{shown}: longest {longest:.3g} s",
            "no samples there: no data, or no signal where only one channel is silent",
            False,
        )
    else:
        row("Gaps", "none longer than five sample periods")
    guessed = [n for n, s in signals.items.items() if s.guessed]
    if guessed:
        row(
            "Mapping",
            f"{len(guessed)} of {len(signals.items)} signals were found by name",
            "a wrong guess would mislead the diagnosis: check with `mfhca channels`, fix in [signals]",
        )
    if model is not None:
        row(
            "Wheel model", model.note, "none" if model.reliable else "gains and valves are not assessed", model.reliable
        )
    for clock in clocks:
        if clock.sentence:
            row("Clock", clock.sentence, *_effect_of(clock))
    told = {clock.sentence for clock in clocks}
    for text in dict.fromkeys((*signals.notes, *timeline.notes, *notes)):
        if text not in told:
            row("Note", text, "see text")
    for text in dict.fromkeys(note for a in assessments.values() for note in a.notes):
        row("Evidence", text)
    return rows


def _effect_of(clock: SourceClock) -> tuple[str, bool]:
    """What a source's clock means for the verdict, and whether all is well."""
    if clock.reason:
        return "delays between the files are not known: its signals are not used", False
    if clock.uncertainty_s is None:
        return "times are as good as what the machine file says", True
    return f"times of one file on the other's axis are right within ±{1e3 * clock.uncertainty_s:.2g} ms (95 %)", True


def clock_row(clock: SourceClock | None) -> dict[str, Any] | None:
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
    """99 % quantile of |stamp step − period| over the wheel signals [ms]."""
    out, seen = 0.0, set()
    for name, signal in signals.items.items():
        period, place = timeline.periods_ns[name], signal.stamps.__array_interface__["data"][0]
        if name.startswith("wheel.") and 0 < period < 2 * timeline.step_ns and signal.stamps.size > 2:
            if place not in seen:
                out = max(out, float(np.quantile(np.abs(np.diff(signal.stamps) - period), 0.99)) * 1e-6)
            seen.add(place)
    return out
