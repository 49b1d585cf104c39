"""Steering angles that jump: no axle turns quicker than it ever does for a while, so that what jumps is a reading."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.untold_faults import finding_of
from diagnosis.results.assessment import Finding
from diagnosis.results.clearing import Check, Checked, after_s
from diagnosis.results.sizes import amount
from diagnosis.results.vocabulary import Kind
from diagnosis.steering.jumps import LEAST_RAD, READINGS, jumps, quickest_of, readings_of
from replay.faults import FaultMode, Side

_APART_S, _ABOUT_S = 0.5, 1.0  # of one jump to the next, and about stated faults
_ROWS = {
    FaultMode.OUTSIDE_TABLE: 0.5,
    FaultMode.INEFFICIENT: 0.4,
    FaultMode.STUCK: 0.1,
}  # a change of scale jumps likewise


def jump_checks(cells: Cells, clear_at: float) -> Iterator[Checked]:
    """Checks of all axles whose angles are read often enough; `clear_at` is the share of an angle that counts [1]."""
    read = {axle: _readings(cells, axle) for axle in cells.machine.axles}
    known = {axle: r for axle, r in read.items() if r is not None}
    quickest = max((quickest_of(*r) for r in known.values()), default=0.0)
    for axle, (t, y) in known.items():
        jumped, of, at = jumps(t, y, quickest)
        share = _untold(cells, axle, jumped / of, at)
        if not share.size:
            continue
        k = int(np.argmax(share))
        start = max(0.0, float(at[k]) - cells.dt)
        size = float(share[k] * of[k])
        limit = clear_at * (float(of[k]) if size else LEAST_RAD)
        yield Checked(Kind.STEER, axle, Side.SENSOR, Check.JUMP, size, limit, start, start + 2 * cells.dt)


def fault_of_jumps(check: Checked, cells: Cells) -> Finding | None:
    """The fault of a steering sensor whose angle jumps more than once, by that check of a mission; None where once is all.

    Its time is that from the first jump to the last, for what changes a reading at once changes it back.
    """
    read = {axle: r for axle in cells.machine.axles if (r := _readings(cells, axle)) is not None}
    quickest = max(quickest_of(*r) for r in read.values())
    t, y = read[check.component]
    jumped, of, at = jumps(t, y, quickest)
    found = at[_untold(cells, check.component, jumped / of, at) > cells.machine.limits.clear_at]
    apart = np.flatnonzero(np.diff(found, prepend=-np.inf) > _APART_S)
    if apart.size < 2:
        return None
    largest = float(np.max(np.abs(y[READINGS:] - y[:-READINGS])[np.isin(t[READINGS:], found)], initial=0.0))
    text = (
        f"The angle of the {check.component} axle jumps {apart.size} times, by {amount(largest, 'rad', 2)} at most, within "
        f"{1e3 * READINGS * float(np.median(np.diff(t))):.0f} ms; the quickest that any axle turns for a while is "
        f"{amount(quickest, 'rad/s', 2)}. So it is the reading that jumps, not the axle."
    )
    dt = cells.timeline.dt
    span = int(found[0] / dt), min(int(np.ceil(found[-1] / dt)) + 1, cells.timeline.size)
    return finding_of(span, FaultMode.OUTSIDE_TABLE, None, (text,), Side.SENSOR, _ROWS)


def _untold(cells: Cells, axle: str, share: Array, at: Array) -> Array:
    """Shares of jumps, 0 about what is stated of an axle."""
    for a, b in cells.stated.get(axle, ()):
        share = np.where((at >= a - _ABOUT_S) & (at <= b + max(_ABOUT_S, after_s(a, b))), 0.0, share)
    return share


def _readings(cells: Cells, axle: str) -> tuple[Array, Array] | None:
    """Times [s] and angles [rad] of an axle's readings; None for too few, or too rare ones."""
    name = f"steer.{axle}.phi"
    y = cells.timeline.get(name)
    return None if y is None else readings_of(y, cells.timeline.fresh[name], cells.timeline.dt)
