"""What a mission of a campaign is, and what became of it: outcomes of `all_clear.py`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from troubles import Part, Trouble, troubles

from diagnosis.results.document import IntervalRow, ReportDocument
from replay.faults import FaultMode, Side

_SURE = 0.9


@dataclass(frozen=True)
class Task:
    """One mission: its machine, which of the kinds of trouble it has (None: none), its seed, length, and the evidence to judge it with."""

    machine: str
    kind: int | None
    seed: int
    duration: float
    tiers: tuple[str, ...]

    @property
    def trouble(self) -> Trouble | None:
        """What is wrong; None: nothing."""
        return None if self.kind is None else troubles(self.duration)[self.kind]


@dataclass(frozen=True)
class Outcome:
    """What became of a mission at one level of evidence."""

    machine: str
    trouble: str
    tier: str
    outcome: str
    wrong_high: int
    high: int
    status: str
    words: str
    sure: int = 0
    wrong_sure: int = 0
    rows: int = 0
    right_rows: int = 0
    bounded: int = 0
    held: int = 0
    findings: tuple[str, ...] = ()
    claims: tuple[tuple[float, bool], ...] = ()  # probability of each finding, and whether part and row are right
    seed: int = -1
    kind: int | None = None


def judged(task: Task, tier: str, name: str, report: ReportDocument, parts: frozenset[Part] | None) -> Outcome:
    """How a report stands to what is wrong: `parts` fail; None: nothing does."""
    found = [f for f in report["intervals"] if f["severity"] != "info"]
    high = [f for f in found if f["severity"] == "high"]
    verdict = report["verdict"]
    still = [
        f"{c['component']} {c['check']} {c['worst']} of {c['limit']:.2f}" for c in report["clearing"] if not c["passed"]
    ]
    words = "; ".join([verdict["title"], *still])
    lines = tuple(
        f"{f['component']} {f['side']} {f['mode']} p {f['probability']:.3f} {f['severity']} {f['start_s']:.1f}-{f['stop_s']:.1f} s"
        for f in found
    )
    own = {"findings": lines, "seed": task.seed, "kind": task.kind}
    sure = [f["probability"] >= _SURE for f in found]
    if parts is None:
        sound = Outcome(task.machine, name, tier, verdict["status"], len(high), len(high), verdict["status"], words)
        claims = tuple((f["probability"], False) for f in found)
        return replace(sound, sure=sum(sure), wrong_sure=sum(sure), claims=claims, **own)
    right = [any(_names(f["component"], f["side"], part) for part in parts) for f in found]
    wrong_high = 0 if not parts else sum(f["severity"] == "high" and not ok for f, ok in zip(found, right, strict=True))
    named = any(right) if parts else bool(found)
    if verdict["cleared"] and not named:
        outcome = "cleared"
    elif named:
        outcome = "named"
    else:
        outcome = "wrong part" if wrong_high else "abstained"
    ill = Outcome(task.machine, name, tier, outcome, wrong_high, len(high), verdict["status"], words)
    wrong_sure = 0 if not parts else sum(s and not ok for s, ok in zip(sure, right, strict=True))
    on_part = [f for f, ok in zip(found, right, strict=True) if ok]
    rows = [f["mode"] in modes for f in on_part if f["mode"] != "outside_table" and (modes := _modes(task, f))]
    held = [h for f in on_part for h in _held(task, f)]
    return replace(
        ill, sure=sum(sure) if parts else 0, wrong_sure=wrong_sure,
        rows=len(rows), right_rows=sum(rows), bounded=len(held), held=sum(held), claims=_claims(task, found, right), **own,
    )  # fmt: skip


def _claims(task: Task, found: Sequence[IntervalRow], right: Sequence[bool]) -> tuple[tuple[float, bool], ...]:
    """Probability of each finding, and whether it names a part that fails with its row, or with none; empty where what is wrong has no row."""
    if task.trouble is None or not task.trouble.faults:
        return ()
    return tuple(
        (f["probability"], ok and (f["mode"] == "outside_table" or f["mode"] in _modes(task, f)))
        for f, ok in zip(found, right, strict=True)
    )


def _modes(task: Task, finding: IntervalRow) -> set[str]:
    """Rows that the simulated faults of a finding's part have; a sensor that is held where it stood reads nothing, which is one row."""
    faults = task.trouble.faults if task.trouble else ()
    own = [f for f in faults if _names(finding["component"], finding["side"], (f.component, f.side.value))]
    held = any(f.mode is FaultMode.STUCK and f.side is Side.SENSOR and math.isnan(f.sat) for f in own)
    return {f.mode.value for f in own} | ({FaultMode.NO_SIGNAL.value} if held else set())


def _names(component: str, side: str, part: Part) -> bool:
    return component == part[0] and side in (part[1], "sensor_or_actuator")


def _held(task: Task, finding: IntervalRow) -> list[bool]:
    """Whether the bounds of a finding's ε hold that of a constant partial fault of its part and time; empty where there is none."""
    faults = task.trouble.faults if task.trouble else ()
    return [
        finding["epsilon"]["low"] <= f.epsilon <= finding["epsilon"]["high"]
        for f in faults
        if finding["epsilon"] is not None
        and finding["mode"] == FaultMode.INEFFICIENT.value == f.mode.value
        and (finding["component"], finding["side"]) == (f.component, f.side.value)
        and not f.ramp_s
        and min(finding["stop_s"], f.stop_s) > max(finding["start_s"], f.start_s)
    ]
