"""Axles that stand still because of what supplies the whole machine, or what lies behind their valves: their sensors and valves are less surely at fault."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.still import rate_of
from diagnosis.clearing.untold_faults import UNTOLD
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.limited import limited
from diagnosis.results.machine_event import MachineEvent
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

#: A component and its side.
Part = tuple[str, str]

_BRIEF_S, _MOSTLY, _TOGETHER = 5.0, 0.6, 0.55  # of both axles; of the time; of any fault, set by hand
_AT_ONCE = "Another axle stands at the same time: parts fail one at a time, so that what supplies or holds the machine is as likely to hold both."
_BESIDE = 0.3  # of its time
_SUPPLY = "All {wheel}s together made less of their commands, or their openings, for a time: what supplies the machine would stop its steering as well."
_SLOWED = "The {wheel}s fell far behind their commands at the same time: an engine that stalls, or what else supplies the machine, stops its steering as well."
_BEHIND_VALVE = (
    "Its opening follows its command, and its angle the second one: sensor and {valve} do as they should, and what does not turn it lies behind the "
    "{valve}, such as its cylinder, or in what supplies it."
)
_ALL_RESTS = (
    "Nothing else of the machine moved at the time: what supplies the axle may have been off, as while an engine that died is started again, "
    "and a machine at rest does not show it."
)
_RESTS, _TURNS, _NEARLY = 0.02, 0.015, 0.9  # of the top speed; rad/s; of the time
_BEFORE_S, _BEHIND_S = 1.0, 0.5  # before the axle stands; in which most wheels are behind
_DRIVES, _BEHIND, _WHEELS = 0.1, 0.5, 3  # of the top speed; of a wheel's command; wheels that are told to drive


def less_sure_together(found: Mapping[str, Finding], checks: Sequence[Checked], cells: Cells) -> dict[str, Finding]:
    """Axles that stand for a moment at the same time, while the wheels make little of their commands, or nothing moves, less sure: by one supply, all stop.

    Parts fail one at a time. Nor is one as sure of which both sides agree with second measurements.
    """

    def together(f: Finding) -> bool:
        others = [g for g in found.values() if g is not f and g.mode is f.mode]
        common = [min(f.stop, g.stop) - max(f.start, g.start) for g in others]
        return max(common, default=0) >= _MOSTLY * (f.stop - f.start)

    def less_sure(f: Finding, why: str) -> Finding:
        return limited(f, f.probability * _TOGETHER / _faulty(f), why)

    def why(component: str, f: Finding) -> str | None:
        if f.mode is FaultMode.NO_SIGNAL and agree_twice(checks, component):
            return _BEHIND_VALVE
        if f.mode is not FaultMode.NO_SIGNAL or (f.stop - f.start) * cells.timeline.dt >= _BRIEF_S:
            return None
        if together(f):
            return _AT_ONCE
        return _SLOWED if _machine_slows(f, cells) else _ALL_RESTS if _all_rests(component, f, cells) else None

    def told(f: Finding, reason: str | None) -> Finding:
        if reason is _BEHIND_VALVE:  # second measurements do tell
            f = replace(f, evidence=tuple(text for text in f.evidence if text != UNTOLD))
        return f if reason is None else less_sure(f, reason)

    reasons = {component: why(component, f) for component, f in found.items()}
    return {c: told(f, reasons[c]) for c, f in found.items()}


def less_sure_beside_supply(
    assessments: Mapping[Part, Assessment],
    events: Sequence[MachineEvent],
    axles: Collection[str],
    words: MachineWords,
    dt: float,
) -> dict[Part, Assessment]:
    """Assessments in which axles that stand still are less sure where all wheels together make less of their commands, or openings: by one supply.

    While they do, or where several axles stand at once.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    events : Sequence[MachineEvent]
        What happened to the machine as a whole.
    axles : Collection[str]
        Names of the steering axles.
    words : MachineWords
        How to speak of the machine.
    dt : float
        Sampling period [s].
    """
    supply = [e for e in events if e.supply]
    still = [(part[0], f) for part, a in assessments.items() if part[0] in axles for f in a.findings if _stands(f)]

    def beside(axle: str, f: Finding) -> bool:
        start, stop = f.start * dt, f.stop * dt
        less = [
            sum(max(0.0, min(b, stop) - max(a, start)) for a, b in e.spans) if e.spans else stop - start for e in supply
        ]
        least = _BESIDE * (stop - start)
        at_once = [(min(g.stop, f.stop) - max(g.start, f.start)) * dt for name, g in still if name != axle]
        return bool(less) and _stands(f) and max([*less, *at_once]) >= least

    def told(axle: str, f: Finding) -> Finding:
        if not beside(axle, f) or _faulty(f) <= _TOGETHER:
            return f
        return limited(f, f.probability * _TOGETHER / _faulty(f), words.fill(_SUPPLY))

    standing = {axle for axle, _ in still} if supply else set()
    return {
        part: replace(a, findings=tuple(told(part[0], f) for f in a.findings)) if part[0] in standing else a
        for part, a in assessments.items()
    }


def _stands(f: Finding) -> bool:
    return f.tier is Tier.MODEL and f.mode is FaultMode.NO_SIGNAL


def _machine_slows(f: Finding, cells: Cells) -> bool:
    """Whether most wheels make less than half of what they are told for a while in, or just before, the time in which an axle stands."""
    before = round(_BEFORE_S / cells.dt)
    part = slice(max(0, f.start // cells.width - before), -(-f.stop // cells.width))
    speed, asked = np.abs(cells.wheels("v")[part]), np.abs(cells.reference[part])
    with np.errstate(invalid="ignore"):
        told = asked > _DRIVES * cells.machine.max_speed
        behind = told & (speed < _BEHIND * asked)
    most = (behind.sum(axis=1) > 0.5 * told.sum(axis=1)) & (told.sum(axis=1) >= _WHEELS)
    return float(np.count_nonzero(most) * cells.dt) >= _BEHIND_S


def _all_rests(component: str, f: Finding, cells: Cells) -> bool:
    """Whether no wheel rolls and no other axle turns while an axle stands."""
    part = slice(f.start // cells.width, -(-f.stop // cells.width))
    others = [j for j, axle in enumerate(cells.machine.axles) if axle != component]
    speed, rate = np.abs(cells.wheels("v")[part]), np.abs(rate_of(cells.axles("phi"), cells.dt)[part][:, others])
    if not np.isfinite(speed).any():
        return False
    with np.errstate(invalid="ignore"):
        moves = (speed > _RESTS * cells.machine.max_speed).any(axis=1) | (rate > _TURNS).any(axis=1)
    return float(np.mean(~moves)) >= _NEARLY


def _faulty(f: Finding) -> float:
    return sum(h.p for h in f.hypotheses if h.mode != State.HEALTHY.value)


def agree_twice(checks: Sequence[Checked], wheel: str) -> bool:
    """Whether the speed and the opening of a wheel are both measured twice, and pass that check."""
    own = {c.side: c.passed for c in checks if (c.component, c.check) == (wheel, Check.SECOND_MEASUREMENT)}
    return own.get(Side.SENSOR, False) and own.get(Side.ACTUATOR, False)
