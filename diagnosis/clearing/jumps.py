"""Steering angles that jump: no axle turns quicker than it ever does for a while, so that what jumps is a reading."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.untold_faults import finding_of
from diagnosis.estimation.angle_jumps import LEAST_RAD, Jumps, jumps_of, quickest_of, readings
from diagnosis.results.assessment import Finding
from diagnosis.results.clearing import Check, Checked, after_s
from diagnosis.results.sizes import amount
from diagnosis.results.vocabulary import Kind
from replay.faults import FaultMode, Side

_APART_S, _ABOUT_S = 0.5, 1.0  # of one jump to the next, and about stated faults
_ROWS = {
    FaultMode.OUTSIDE_TABLE: 0.5,
    FaultMode.INEFFICIENT: 0.4,
    FaultMode.STUCK: 0.1,
}  # a change of scale jumps likewise


def jump_checks(cells: Cells, clear_at: float) -> Iterator[Checked]:
    """Checks of all axles whose angles are read often enough; `clear_at` is the share of an angle that counts [1]."""
    for axle, (found, _) in _found(cells).items():
        share = _untold(cells, axle, found)
        k = int(np.argmax(share)) if share.size and share.max() > 0.0 else None
        if k is None:
            yield Checked(Kind.STEER, axle, Side.SENSOR, Check.JUMP, 0.0, clear_at * LEAST_RAD)
            continue
        start = max(0.0, float(found.at_s[k]) - cells.dt)
        size, limit = float(found.size[k]), clear_at * float(found.of[k])
        yield Checked(Kind.STEER, axle, Side.SENSOR, Check.JUMP, size, limit, start, start + 2 * cells.dt)


def fault_of_jumps(check: Checked, cells: Cells) -> Finding | None:
    """The fault of a steering sensor whose angle jumps more than once, by that check of a mission; None where once is all.

    Its time is that from the first jump to the last, for what changes a reading at once changes it back.
    """
    jumps, quickest = _found(cells)[check.component]
    beyond = _untold(cells, check.component, jumps) > cells.machine.limits.clear_at
    found = jumps.at_s[beyond]
    apart = np.flatnonzero(np.diff(found, prepend=-np.inf) > _APART_S)
    if apart.size < 2:
        return None
    largest = float(jumps.size[beyond].max())
    text = (
        f"The angle of the {check.component} axle jumps {apart.size} times, by {amount(largest, 'rad', 2)} at most, from one reading to the next "
        f"ones; the quickest that any axle turns for a while is {amount(quickest, 'rad/s', 2)}. So it is the reading that jumps, not the axle."
    )
    dt = cells.timeline.dt
    span = int(found[0] / dt), min(int(np.ceil(found[-1] / dt)) + 1, cells.timeline.size)
    return finding_of(span, FaultMode.OUTSIDE_TABLE, None, (text,), Side.SENSOR, _ROWS)


def _found(cells: Cells) -> dict[str, tuple[Jumps, float]]:
    """Jumps of all axles whose angles are read often enough, and the largest rate of any of them [rad/s]."""
    return cells.once("jumps", lambda: _searched(cells))


def _searched(cells: Cells) -> dict[str, tuple[Jumps, float]]:
    read = {}
    for axle in cells.machine.axles:
        name = f"steer.{axle}.phi"
        y = cells.timeline.get(name)
        if y is not None:
            read[axle] = (y, cells.timeline.fresh[name], cells.timeline.dt)
    rates = {axle: rate for axle, r in read.items() if (rate := quickest_of(readings(*r))) is not None}
    quickest = max(rates.values(), default=0.0)
    return {axle: (jumps_of(readings(*read[axle]), quickest), quickest) for axle in rates}


def _untold(cells: Cells, axle: str, found: Jumps) -> Array:
    """Shares of jumps, 0 about what is stated of an axle."""
    share = found.size / found.of
    for a, b in cells.stated.get(axle, ()):
        told = (found.at_s >= a - _ABOUT_S) & (found.at_s <= b + max(_ABOUT_S, after_s(a, b)))
        share = np.where(told, 0.0, share)
    return np.asarray(share)
