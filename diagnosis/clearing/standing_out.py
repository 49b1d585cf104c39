"""One wheel, or an axle, that deviates so far that no other explanation is left, although no row could be told: a fault of either side.

What a part does per opening is compared with the other wheels without any model of a fault (`diagnosis.clearing.responses`). A
deviation of several times what stands against an all-clear, of one wheel alone, is a fault of its sensor or its valve; where
several deviate nobody knows which of them are healthy. An axle that stands still while it is commanded is one likewise. A steering
angle that is far off its second measurement is its sensor's fault, whatever the kind.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.clearing import axles
from diagnosis.clearing.cells import Array, Cells, Frame
from diagnosis.clearing.measure import compared
from diagnosis.clearing.responses import Limits, measured_twice, responses_of, speeds_follow_openings, usual_limits
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.limited import limited
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sizes import amount
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import FaultMode, Side, State

#: A component and its side.
Part = tuple[str, str]

_BESIDE_OTHERS = (Check.RESPONSE, Check.LASTING_RESPONSE, Check.EXCESS, Check.LASTING_EXCESS)
_FAR, _ALONE = 3.0, 2.0  # times the limit of the all-clear, and times what the next wheel deviates by
_OTHERS = 1.5  # times the limit: where others deviate by more, speed per opening says little of this machine, ...
_BY_FAR = 5.0  # ... unless a wheel deviates this many times as far
_STILL, _DRAGS = 2.0, 1.3  # times the limit: an axle that does not answer, and one that may drag wheels along
_WHEELS = 3  # fewer have no others to be compared with
_P = 0.93  # on tuning missions of nine machines 23 of 24 were faults of the part that is named, ...
# ... of which these shares were of the row that it looks like, and of others
_ROWS = {
    FaultMode.INEFFICIENT: {
        FaultMode.INEFFICIENT: 0.7,
        FaultMode.NO_SIGNAL: 0.1,
        FaultMode.STUCK: 0.1,
        FaultMode.NOISY: 0.1,
    },
    FaultMode.NO_SIGNAL: {
        FaultMode.NO_SIGNAL: 0.7,
        FaultMode.STUCK: 0.15,
        FaultMode.INEFFICIENT: 0.1,
        FaultMode.OUTSIDE_TABLE: 0.05,
    },
    FaultMode.OUTSIDE_TABLE: {FaultMode.OUTSIDE_TABLE: 1.0},
}
_ALL = 0.9  # of the speed per opening, that is lost where nothing is left
_BESIDE = 0.65  # how often a partial fault beside one of the other side was right
_LESS_SURE = "The other side has a fault that no row explains, which makes this one less probable."
_HALF, _LARGEST = 0.5, 0.8  # of the largest deviations, by this quantile: where a fault lasts
_OPEN = (CODE[State.HEALTHY], CODE[State.NOT_ASSESSED])
_COMMANDED = (*_OPEN, CODE[State.NOT_EXCITED])  # an axle that stands still under its command is excited


@dataclass(frozen=True)
class _Shown:
    """Where something deviates: sizes of a frame's windows, NaN where nothing is known."""

    frame: Frame
    size: Array


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
    found = {check.component: _angle(check, cells) for check in checks if _off_second_angle(check)}
    found |= {check.component: _axle(check, cells) for check in checks if _does_not_answer(check, cells)}
    if (wheel := _alone(checks, cells)) is not None:
        found[wheel.component] = _wheel(wheel, cells)
    return {
        component: replace(f, evidence=tuple(words.fill(text) for text in f.evidence)) for component, f in found.items()
    }


def with_findings(assessments: Mapping[Part, Assessment], found: Mapping[str, Finding]) -> dict[Part, Assessment]:
    """Assessments with one more fault of the sides that it may be of; what a model finds on the other side beside it is less sure."""
    out = {}
    for (component, side), a in assessments.items():
        finding = found.get(component)
        if finding is None:
            out[component, side] = a
        elif Side(side) in finding.side.sides:
            out[component, side] = _with(a, finding)
        else:
            own = (
                limited(f, _BESIDE, _LESS_SURE) if f.tier is Tier.MODEL and not f.mode.total else f for f in a.findings
            )
            out[component, side] = replace(a, findings=tuple(own))
    return out


def _with(a: Assessment, finding: Finding) -> Assessment:
    """An assessment with one more fault."""
    states = a.states.copy()
    inside = states[finding.start : finding.stop]
    inside[np.isin(inside, _COMMANDED if finding.mode is FaultMode.NO_SIGNAL else _OPEN)] = CODE[
        State(finding.mode.value)
    ]
    return replace(a, states=states, findings=tuple(sorted((*a.findings, finding), key=lambda f: f.start)))


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


def _alone(checks: Sequence[Checked], cells: Cells) -> Checked | None:
    """The check of the one wheel that deviates, by far; None where there is no such wheel, or another part explains it."""
    if any(c.check is Check.STILL and _times(c) >= _DRAGS for c in checks):
        return None
    if any(cells.stated.get(part) for part in (*cells.machine.wheels, *cells.machine.axles)):
        return None
    worst: dict[str, Checked] = {}
    twice = dict(zip(cells.machine.wheels, measured_twice(cells), strict=True))
    for check in checks:
        if check.kind is Kind.WHEEL and check.check in _BESIDE_OTHERS and check.worst is not None:
            c = _by_usual_limit(check, usual_limits(twice[check.component], cells.machine.limits.clear_at))
            worst[c.component] = max(worst.get(c.component, c), c, key=_times)
    if len(worst) < _WHEELS or not speeds_follow_openings(cells):
        return None
    first, second, *_ = sorted(worst.values(), key=_times, reverse=True)
    alone = _times(second) <= max(_OTHERS, _times(first) / _BY_FAR) and _times(first) >= max(
        _FAR, _ALONE * _times(second)
    )
    return first if alone else None


def _by_usual_limit(check: Checked, usual: Limits) -> Checked:
    """A check with the limit that it has whatever the other wheels do."""
    if check.check is Check.RESPONSE:
        return replace(check, limit=usual.below)
    if check.check is Check.EXCESS:
        return replace(check, limit=usual.above)
    return replace(check, limit=usual.changed) if check.limit < usual.lasting_below else check


def _wheel(check: Checked, cells: Cells) -> Finding:
    """The fault of a wheel whose speed per opening is not that of the others."""
    speed, command, opening = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied"))
    responses = responses_of(cells, speed, np.where(np.isfinite(opening), opening, command), cells.reference)
    beside = responses.beside[:, cells.machine.wheels.index(check.component)]
    lost, gained = (float(np.nansum(np.maximum(x - check.limit, 0.0))) for x in (-beside, beside))
    below = lost >= gained
    shown = _Shown(cells.frame, -beside if below else beside)
    start, stop, size, spread = _where(shown, cells)
    half = max(check.limit, 2.0 * spread)
    low, middle, high = (-np.expm1(-x if below else x) for x in (size - half, size, size + half))
    mode = FaultMode.OUTSIDE_TABLE if not below else FaultMode.INEFFICIENT if middle < _ALL else FaultMode.NO_SIGNAL
    measured = "speed of {part} per {unit_command}".replace("{part}", check.component)
    text = (
        f"The {measured} is {'below' if below else 'above'} the other {{wheels}}' by {100 * abs(middle):.0f} %; "
        f"{100 * abs(np.expm1(-check.limit if below else check.limit)):.0f} % would already stand against an all-clear, and no other "
        f"{{wheel}} deviates half as far."
    )
    sizes = Epsilon(float(middle), float(min(low, high)), float(max(low, high)))
    return _finding((start, stop), mode, sizes, (text, _UNTOLD))


_UNTOLD = (
    "No row of the tables fits well enough to say whether the sensor or the {valve} fails: a second measurement of either "
    "would tell them apart."
)


def _axle(check: Checked, cells: Cells) -> Finding:
    """The fault of an axle that stands still while it is commanded."""
    shown = _Shown(axles.still_frame(cells), axles.commanded_still(cells, cells.machine.axles.index(check.component)))
    start, stop, _, _ = _where(shown, cells)
    assert check.worst is not None
    text = (
        f"The {check.component} axle stands still while its {{valve}} is commanded to {100 * check.worst:.0f}{{percent}}; a healthy one "
        f"moves from {100 * check.limit:.0f}{{percent}} on."
    )
    least = max(0.0, 1.0 - check.limit / check.worst)  # what is left of the command moves no axle
    return _finding((start, stop), FaultMode.NO_SIGNAL, Epsilon(1.0, least, 1.0), (text, _UNTOLD))


def _angle(check: Checked, cells: Cells) -> Finding:
    """The fault of a steering sensor that is off a second one."""
    j = cells.machine.axles.index(check.component)
    angle, second = (cells.axles(leaf)[:, j] for leaf in ("phi", "phi_true"))
    beside = compared(cells, angle, second, axles.FLOOR_RAD)
    shown = _Shown(cells.frame, np.where(cells.explained(check.component), np.nan, beside.off))
    start, stop, _, _ = _where(shown, cells)
    first, last = start // cells.width, -(-stop // cells.width)
    apart = (angle - second)[first:last]
    middle, spread = float(np.nanmedian(apart)), float(np.nanstd(apart))
    constant = abs(middle) > 2.0 * spread
    text = f"The {check.component} steering angle is off its second measurement: " + (
        f"it reads {amount(abs(middle), 'rad', 2)} {'more' if middle > 0.0 else 'less'}, give or take {amount(spread, 'rad', 2)}, all the time."
        if constant
        else f"by {amount(float(np.sqrt(np.nanmean(apart**2))), 'rad', 2)} (root mean square)."
    )
    found = _finding((start, stop), FaultMode.OUTSIDE_TABLE, None, (text, _NO_ROW), side=Side.SENSOR)
    return replace(found, tier=Tier.DIRECT)


_NO_ROW = "No row of the tables explains that: an offset, a wrong scale, or both."


def _finding(
    span: tuple[int, int],
    mode: FaultMode,
    size: Epsilon | None,
    evidence: tuple[str, ...],
    side: Side = Side.SENSOR_OR_ACTUATOR,
) -> Finding:
    rows = tuple(Hypothesis(side.value, row.value, _P * share) for row, share in _ROWS[mode].items())
    return Finding(
        start=span[0],
        stop=span[1],
        side=side,
        mode=mode,
        probability=rows[0].p,
        hypotheses=(*rows, Hypothesis("none", State.HEALTHY.value, 1.0 - _P)),
        epsilon=size,
        sat=None,
        evidence=evidence,
        tier=Tier.MODEL,
    )


def _where(shown: _Shown, cells: Cells) -> tuple[int, int, float, float]:
    """Samples [start, stop) over which a deviation is at least half of its largest, its middle there, and how it is spread."""
    size = np.where(np.isfinite(shown.size), shown.size, -np.inf)
    largest = size[size > _HALF * size.max()]
    at = np.flatnonzero(size >= _HALF * np.quantile(largest, _LARGEST))
    first, last = (int(shown.frame.starts[k]) * cells.width for k in (at[0], at[-1]))
    stop = min(last + shown.frame.length * cells.width, cells.timeline.size)
    return first, stop, float(np.median(size[at])), float(np.std(size[at]) / np.sqrt(at.size))
