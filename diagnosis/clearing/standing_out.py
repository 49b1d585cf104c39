"""One wheel, or an axle, that deviates so far that no other explanation is left, although no row could be told: a fault of either side.

What a part does per opening is compared with the other wheels without any model of a fault (`diagnosis.clearing.responses`). A
deviation of several times what stands against an all-clear, of one wheel alone, is a fault of its sensor or its valve. Where several
deviate, the one that does not follow its command, which all others do, is what they drag along; else nobody knows which of them
are healthy. An axle that stands still while it is commanded is one likewise. A steering
angle that is far off its second measurement, or jumps, is its sensor's fault, whatever the kind.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.clearing.backwards import without_findings
from diagnosis.clearing.cells import Cells
from diagnosis.clearing.drop_outs import fault_of_drop_outs
from diagnosis.clearing.jumps import fault_of_jumps
from diagnosis.clearing.limits import Limits, measured_twice, usual_limits
from diagnosis.clearing.one_supply import agree_twice, less_sure_together
from diagnosis.clearing.openings import speeds_follow_openings
from diagnosis.clearing.second_angles import scaled_angles
from diagnosis.clearing.spikes import fault_of_spikes
from diagnosis.clearing.untold_faults import fault_of_angle, fault_of_axle, fault_of_wheel
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_event import MachineEvent
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.sentence import mapped
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import FaultMode, Side

#: A component and its side.
Part = tuple[str, str]

_BESIDE_OTHERS = (Check.RESPONSE, Check.LASTING_RESPONSE, Check.CHANGE, Check.EXCESS, Check.LASTING_EXCESS)
_FAR, _ALONE = 3.0, 2.0  # times the limit of the all-clear, and times what the next wheel deviates by
_OTHERS = 1.5  # times the limit: where others deviate by more, speed per opening says little of this machine, ...
_BY_FAR = 5.0  # ... unless a wheel deviates this many times as far
_BY_FILE, _AS_FILED = 1.5, 0.5  # times the limit: a wheel that is off the machine file, and others that are not
_STILL, _DRAGS = 2.0, 1.3  # times the limit: an axle that does not answer, and one that may drag wheels along
_WHEELS = 3  # fewer have no others to be compared with
_HALF = 0.5  # of the time of a fault


def what_stands_out(checks: Sequence[Checked], cells: Cells, words: MachineWords) -> dict[str, Finding]:
    """Faults of either side by wheel or axle, where checks leave no doubt; nothing of wheels where a fault of one is stated.

    Parameters
    ----------
    checks : Sequence[Checked]
        From `diagnosis.clearing.checks`.
    cells : Cells
        The mission, with what is stated already.
    words : MachineWords
        How to speak of the machine.
    """
    jumping = {c.component: fault_of_jumps(c, cells) for c in checks if c.check is Check.JUMP and not c.passed}
    found = {component: fault for component, fault in jumping.items() if fault is not None}
    found |= {check.component: fault_of_angle(check, cells) for check in checks if _off_second_angle(check)}
    found |= {c: f for c, f in scaled_angles(checks, cells).items() if not cells.stated.get(c)}
    rough = {c.component for c in checks if c.check is Check.ROUGHNESS and not c.passed}
    for leaps in (fault_of_spikes, fault_of_drop_outs):
        found |= {wheel: fault for wheel in rough if (fault := leaps(wheel, cells)) is not None}
    axles = {c.component: fault_of_axle(c, cells) for c in checks if _does_not_answer(c, cells)}
    still = {component: fault for component, fault in axles.items() if fault is not None}
    found |= less_sure_together(still, checks, cells)
    alone = _alone(checks, cells) or _off_its_plant(checks, cells)
    wheel = alone or (None if _stated(cells) else _alone_not_following(checks, cells))
    if wheel is not None:
        agree = agree_twice(checks, wheel.component)
        told = fault_of_wheel(wheel, cells, alone=alone is not None, agree=agree)
        quick = told is not None and told.mode is FaultMode.OUTSIDE_TABLE  # as one is that a torque lets run
        if told is not None and (not quick or speeds_follow_openings(cells, surely=True)):
            found[wheel.component] = told
    return {
        component: replace(f, evidence=tuple(mapped(text, words.fill) for text in f.evidence))
        for component, f in found.items()
    }


def without_explained(
    found: Mapping[str, Finding], events: Sequence[MachineEvent], axles: Collection[str]
) -> dict[str, Finding]:
    """What stands out, by component, less what events of the whole machine explain; a wheel model that does not fit explains no axle, nor does a gyro."""
    if not events:
        return dict(found)
    return {part: f for part, f in found.items() if part in axles and all(e.model or e.body for e in events)}


def _times(check: Checked) -> float:
    """A check's value as a multiple of its limit."""
    return 0.0 if check.worst is None else check.worst / check.limit


def _does_not_answer(check: Checked, cells: Cells) -> bool:
    return check.check is Check.STILL and _times(check) >= _STILL and not cells.stated.get(check.component)


def _off_second_angle(check: Checked) -> bool:
    return (
        check.kind is Kind.STEER
        and (check.check, check.side) == (Check.SECOND_MEASUREMENT, Side.SENSOR)
        and _times(check) >= _FAR
    )


def _stated(cells: Cells) -> bool:
    return any(cells.stated.get(part) for part in (*cells.machine.wheels, *cells.machine.axles))


def _alone(checks: Sequence[Checked], cells: Cells) -> Checked | None:
    """The check of the one wheel that deviates, by far; None where there is no such wheel, or another part explains it."""
    if any(c.check is Check.STILL and _times(c) >= _DRAGS for c in checks):
        return None
    if _stated(cells):
        return None
    worst: dict[str, Checked] = {}
    twice = dict(zip(cells.machine.wheels, measured_twice(cells), strict=True))
    for check in checks:
        if check.kind is Kind.WHEEL and check.check in _BESIDE_OTHERS and _known(check):
            c = _by_usual_limit(check, usual_limits(twice[check.component], cells.machine.limits.clear_at))
            worst[c.component] = max(worst.get(c.component, c), c, key=_times)
    if len(worst) < _WHEELS or not speeds_follow_openings(cells):
        return None
    first, second, *_ = sorted(worst.values(), key=_times, reverse=True)
    alone = _times(second) <= max(_OTHERS, _times(first) / _BY_FAR) and _times(first) >= max(
        _FAR, _ALONE * _times(second)
    )
    return first if alone else None


def _off_its_plant(checks: Sequence[Checked], cells: Cells) -> Checked | None:
    """The check of the one wheel that is off the machine file's [plant] by what counts, while all others give what it says."""
    own = sorted((c for c in checks if c.check is Check.PLANT_RESPONSE), key=_times, reverse=True)
    if len(own) < _WHEELS or _stated(cells) or any(c.check is Check.STILL and _times(c) >= _DRAGS for c in checks):
        return None
    first, second, *_ = own
    return first if _times(first) >= _BY_FILE and _times(second) <= _AS_FILED else None


def _known(check: Checked) -> bool:
    """Whether it is known by how much a wheel deviates: beside wheels that all stand there is no share."""
    return check.worst is not None and np.isfinite(check.worst)


def without_followers(
    assessments: Mapping[Part, Assessment], checks: Sequence[Checked], cells: Cells
) -> dict[Part, Assessment]:
    """Assessments without what models state of wheels that follow, where the one that does not has no fault: they drag it along.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    checks : Sequence[Checked]
        From `diagnosis.clearing.checks`.
    cells : Cells
        The mission.
    """
    culprit = _alone_not_following(checks, cells)
    if culprit is None:
        return dict(assessments)
    shown = fault_of_wheel(culprit, cells, alone=False)
    if shown is None:
        return dict(assessments)
    return {
        part: without_findings(a, [f for f in a.findings if _during(f, shown)], cells.timeline.dt)
        if part[0] in cells.machine.wheels
        else a
        for part, a in assessments.items()
    }


def _during(f: Finding, other: Finding) -> bool:
    """Whether a model states that a part does nothing at all, at the time of another fault."""
    common = min(f.stop, other.stop) - max(f.start, other.start)
    return f.tier is Tier.MODEL and f.mode.total and common > _HALF * (f.stop - f.start)


def _alone_not_following(checks: Sequence[Checked], cells: Cells) -> Checked | None:
    """The response of the one wheel that does not do what it is told while all others do; None where there is none without a fault."""
    own = [c for c in checks if c.kind is Kind.WHEEL and c.worst is not None]
    tracking = sorted((c for c in own if c.check is Check.TRACKING), key=_times, reverse=True)
    if len(tracking) < _WHEELS or _times(tracking[0]) < max(_STILL, _BY_FAR * _times(tracking[1])):
        return None
    part = tracking[0].component
    answers = [
        c for c in own if c.component == part and c.check in (Check.RESPONSE, Check.LASTING_RESPONSE, Check.CHANGE)
    ]
    if cells.stated.get(part) or not answers or not speeds_follow_openings(cells):
        return None
    twice = dict(zip(cells.machine.wheels, measured_twice(cells), strict=True))[part]
    worst = max((_by_usual_limit(c, usual_limits(twice, cells.machine.limits.clear_at)) for c in answers), key=_times)
    return worst if _times(worst) >= _FAR else None


def _by_usual_limit(check: Checked, usual: Limits) -> Checked:
    """A check with the limit that it has whatever the other wheels do."""
    if check.check is Check.RESPONSE:
        return replace(check, limit=usual.below)
    if check.check is Check.EXCESS:
        return replace(check, limit=usual.above)
    if check.check is Check.CHANGE:
        return replace(check, limit=usual.changed)
    return replace(check, limit=usual.changed) if check.limit < usual.lasting_below else check
