"""Faults in words: parts and modes, what to do about each part, and the verdict's sentence."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.results.result import FaultInterval
from replay.faults import FaultMode, Side

GONE = (FaultMode.STUCK, FaultMode.NO_SIGNAL)

MODE_WORDS = {
    "sensor": {
        "stuck": "stuck",
        "no_signal": "without signal",
        "inefficient": "inefficient",
        "noisy": "noisy",
        "outside_table": "outside the tables",
    },
    "actuator": {
        "stuck": "stuck",
        "no_signal": "without control signal",
        "inefficient": "inefficient",
        "noisy": "disturbed",
        "outside_table": "outside the tables",
    },
}


def mode_words(side: str, mode: str) -> str:
    """A fault mode in words for its side, to follow *was*."""
    return MODE_WORDS["actuator" if side == "actuator" else "sensor"][mode]


def part_words(kind: str, component: str, side: str) -> str:
    """A component and side in words: ``FR speed sensor``, ``front steering valve``."""
    if kind == "steer":
        return {
            "sensor": f"{component} steering sensor",
            "actuator": f"{component} steering valve",
        }.get(side, f"{component} steering sensor or valve")
    return {"sensor": f"{component} speed sensor", "actuator": f"{component} drive valve"}.get(
        side, f"{component} speed sensor or drive valve"
    )


def actions_of(intervals: Sequence[FaultInterval]) -> tuple[dict[str, object], ...]:
    """One action per component and side: valves to stop at once for, then other stops, then the rest, worst first."""
    parts: dict[tuple[str, str, str], list[FaultInterval]] = {}
    for f in intervals:
        if f.severity != "info":
            parts.setdefault((f.kind, f.component, f.side.value), []).append(f)
    out: list[dict[str, object]] = []
    for (kind, component, side), faults in sorted(parts.items(), key=lambda part: _urgency(part[1][0])):
        modes: dict[str, list[FaultInterval]] = {}
        for f in faults:
            modes.setdefault(f.mode.value, []).append(f)
        found = join_words([_spells(side, mode, spells) for mode, spells in modes.items()])
        text = f"{_order(faults[0])} the {part_words(kind, component, side)}: {found}."
        out.append({"n": len(out) + 1, "text": text, "faults": [f.id for f in faults], "severity": faults[0].severity})
    return tuple(out)


def _order(worst: FaultInterval) -> str:
    """What to do with a part, by its worst fault."""
    if worst.severity == "high":
        return "Stop at once and repair" if worst.side is Side.ACTUATOR else "Stop and repair"
    if unanswered(worst):
        return "Before the machine goes out, check"
    return "Check at the next service" if worst.mode in GONE else "Check"


def unanswered(fault: FaultInterval) -> bool:
    """Whether a valve probably does not answer, though that is not certain enough to stop for."""
    return fault.severity == "medium" and fault.mode in GONE and fault.side is not Side.SENSOR


def _urgency(worst: FaultInterval) -> int:
    """Place of a part among the actions, by its worst fault; equal ones keep their order."""
    if worst.severity == "high":
        return {Side.ACTUATOR: 0, Side.SENSOR_OR_ACTUATOR: 1}.get(worst.side, 2)
    return {"medium": 3, "low": 4}.get(worst.severity, 5)


def _spells(side: str, mode: str, faults: Sequence[FaultInterval]) -> str:
    total = seconds_words(sum(f.stop_s - f.start_s for f in faults))
    return f"{mode_words(side, mode)} for {total}" + ("" if len(faults) == 1 else f" in {len(faults)} spells")


def sentence_of(faults: Sequence[FaultInterval]) -> str:
    """The worst three faults in one sentence."""
    shown = [
        f"the {part_words(f.kind, f.component, f.side.value)} was {mode_words(f.side.value, f.mode.value)} for "
        f"{seconds_words(f.stop_s - f.start_s)}"
        for f in faults[:3]
    ]
    text = join_words(shown)
    more = f"; {len(faults) - 3} more are listed below" if len(faults) > 3 else ""
    return text[0].upper() + text[1:] + more + "."


def seconds_words(value: float) -> str:
    """A duration [s] as shown: ``140 ms``, ``6.4 s``."""
    return f"{value * 1e3:.0f} ms" if value < 1 else f"{value:.1f} s"


def count_words(n: int, word: str) -> str:
    """A number with its noun: ``1 fault``, ``3 faults``."""
    return f"{n} {word}" + ("" if n == 1 else "s")


def join_words(words: Sequence[str]) -> str:
    """Words joined by commas and “and”; empty for none."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1] if words else ""
