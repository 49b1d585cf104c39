"""Faults that stand out although no row could be told: the findings, with their time, size, and the rows that they may be of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.clearing import axles, still
from diagnosis.clearing.cells import Array, Cells, Frame
from diagnosis.clearing.measure import compared
from diagnosis.clearing.responses import responses_of
from diagnosis.results.assessment import Finding
from diagnosis.results.clearing import Checked
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sizes import amount
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

_P = 0.95  # on tuning missions of fifteen machines 157 of 158 were faults of the part that is named, ...
_P_ABOVE = 0.75  # of a wheel that is too quick, set by hand: all others may be too slow instead
# ... of which these shares were of the row that it looks like, and of others: of 84 axles that stand still 54 were dead, others mostly stuck
# within their dead band or of no row; of 62 slow wheels 46 lost a share
_ROWS = {
    FaultMode.INEFFICIENT: {
        FaultMode.INEFFICIENT: 0.74,
        FaultMode.OUTSIDE_TABLE: 0.12,
        FaultMode.STUCK: 0.06,
        FaultMode.NO_SIGNAL: 0.04,
        FaultMode.NOISY: 0.04,
    },
    FaultMode.NO_SIGNAL: {
        FaultMode.NO_SIGNAL: 0.64,
        FaultMode.STUCK: 0.18,
        FaultMode.OUTSIDE_TABLE: 0.13,
        FaultMode.INEFFICIENT: 0.05,
    },
    FaultMode.OUTSIDE_TABLE: {FaultMode.OUTSIDE_TABLE: 1.0},
    FaultMode.NOISY: {FaultMode.NOISY: 1.0},
}
#: The same of wheels that stand: of 16 (campaigns) 7 were dead or locked, 8 stuck within their dead band or against their command.
_STANDS = {
    FaultMode.NO_SIGNAL: 0.44,
    FaultMode.STUCK: 0.44,
    FaultMode.OUTSIDE_TABLE: 0.06,
    FaultMode.INEFFICIENT: 0.06,
}
_BIASED = {
    FaultMode.OUTSIDE_TABLE: 0.7,
    FaultMode.INEFFICIENT: 0.15,
    FaultMode.NO_SIGNAL: 0.1,
    FaultMode.STUCK: 0.05,
}  # set by hand
_ALL = 0.9  # of the speed per opening, that is lost where nothing is left
_HALF, _LARGEST = 0.5, 0.8  # of the largest deviations, by this quantile: where a fault lasts


@dataclass(frozen=True)
class _Shown:
    """Where something deviates: sizes of a frame's windows, NaN where nothing is known."""

    frame: Frame
    size: Array


def fault_of_wheel(check: Checked, cells: Cells, *, alone: bool, agree: bool = False) -> Finding | None:
    """The fault of a wheel whose speed per opening is not that of the others; None where no window of driving shows it.

    Parameters
    ----------
    check : Checked
        Of its speed per opening, with its usual limit.
    cells : Cells
        The mission.
    alone : bool
        Whether it is the only one that deviates so far; else it is the only one that does not follow its command.
    agree : bool
        Whether its speed and its valve agree with second measurements of both.
    """
    speed, command, opening = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied"))
    used = np.where(np.isfinite(opening), opening, command)
    responses = responses_of(cells, speed, used, cells.reference, over_time=False)
    beside = responses.beside[:, cells.machine.wheels.index(check.component)]
    beside = np.where(np.isfinite(beside), beside, np.nan)  # beside wheels that all stand there is no share
    lost, gained = (float(np.nansum(np.maximum(x - check.limit, 0.0))) for x in (-beside, beside))
    below = lost >= gained
    shown = _Shown(cells.frame, -beside if below else beside)
    if not np.any(shown.size > check.limit):
        return None  # it was off where it crept alone: dead bands differ
    start, stop, size, spread = _where(shown, cells)
    half = max(check.limit, 2.0 * spread)
    low, middle, high = (-np.expm1(-x if below else x) for x in (size - half, size, size + half))
    mode = FaultMode.OUTSIDE_TABLE if not below else FaultMode.INEFFICIENT if middle < _ALL else FaultMode.NO_SIGNAL
    measured = "speed of {part} per {unit_command}".replace("{part}", check.component)
    text = (
        f"The {measured} is {'below' if below else 'above'} the other {{wheels}}' by {100 * abs(middle):.0f} %; "
        f"{100 * abs(np.expm1(-check.limit if below else check.limit)):.0f} % would already stand against an all-clear, and "
        + (
            "no other {wheel} deviates half as far."
            if alone
            else "all other {wheels} follow their commands far better."
        )
    )
    sizes = Epsilon(float(middle), float(min(low, high)), float(max(low, high)))
    side, why = (Side.ACTUATOR, _BEHIND) if below and agree else (Side.SENSOR_OR_ACTUATOR, UNTOLD)
    rows = _STANDS if mode is FaultMode.NO_SIGNAL else None
    return finding_of((start, stop), mode, sizes, (text, why), side, rows, p=_P if below else _P_ABOVE)


UNTOLD = (
    "No row of the tables fits well enough to say whether the sensor or the {valve} fails: a second measurement of either "
    "would tell them apart."
)


_BEHIND = (
    "Its speed and the position of its {valve} both agree with their second measurements: what gives less lies behind the {valve}, such as a motor, "
    "a gear or a brake that drags."
)


def fault_of_axle(check: Checked, cells: Cells) -> Finding | None:
    """The fault of an axle that stands still while it is commanded, by that check of a mission; None where its valve opens late, but lives."""
    j = cells.machine.axles.index(check.component)
    shown = _Shown(still.still_frame(cells), still.commanded_still(cells, j))
    start, stop, _, _ = _where(shown, cells)
    assert check.worst is not None
    moves = f"a healthy one moves from {100 * check.limit:.0f}{{percent}} on."
    bias = still.rests_at(cells, j, (start, stop))
    if bias is not None:
        text = (
            f"The {check.component} axle rests again and again while its {{valve}} is commanded to {100 * bias:+.0f}{{percent}}, wherever "
            f"it is, and turns otherwise; {moves} So the {{valve}} seems to be off by as much."
        )
        return finding_of((start, stop), FaultMode.OUTSIDE_TABLE, None, (text,), Side.ACTUATOR, _BIASED)
    if still.opens_late(cells, j):
        return None
    text = f"The {check.component} axle stands still while its {{valve}} is commanded to {100 * check.worst:.0f}{{percent}}; {moves}"
    least = max(0.0, 1.0 - check.limit / check.worst)  # what is left of the command moves no axle
    return finding_of((start, stop), FaultMode.NO_SIGNAL, Epsilon(1.0, least, 1.0), (text, UNTOLD))


def fault_of_angle(check: Checked, cells: Cells) -> Finding:
    """The fault of a steering sensor that is off a second one, by that check of a mission."""
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
    found = finding_of((start, stop), FaultMode.OUTSIDE_TABLE, None, (text, _NO_ROW), side=Side.SENSOR)
    return replace(found, tier=Tier.DIRECT)


_NO_ROW = "No row of the tables explains that: an offset, a wrong scale, or both."


def finding_of(
    span: tuple[int, int],
    mode: FaultMode,
    size: Epsilon | None,
    evidence: tuple[str, ...],
    side: Side = Side.SENSOR_OR_ACTUATOR,
    rows_by: Mapping[FaultMode, float] | None = None,
    p: float = _P,
) -> Finding:
    """A fault that no model found.

    Parameters
    ----------
    span : tuple[int, int]
        Samples [start, stop).
    mode : FaultMode
        The row that it looks like.
    size : Epsilon or None
        Loss [1].
    evidence : tuple[str, ...]
        Sentences, with the machine's words to fill in.
    side : Side
        Of which it is.
    rows_by : Mapping[FaultMode, float] or None
        How its probability is shared among rows, that of `mode` first; None: as is usual for such a mode.
    p : float
        Of a fault of that side.
    """
    rows = tuple(Hypothesis(side.value, row.value, p * share) for row, share in (rows_by or _ROWS[mode]).items())
    return Finding(
        start=span[0],
        stop=span[1],
        side=side,
        mode=mode,
        probability=rows[0].p,
        hypotheses=(*rows, Hypothesis("none", State.HEALTHY.value, 1.0 - p)),
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
