"""Effort of each drive against what its motion takes, beside the other drives' efforts: torque that is lost behind an unchanged command.

A loop that holds the speed takes back what a motor loses, and what it asks for changes by the part that pulls alone, which is little of a duty: what
tells is the current or torque beside it. With the machine file's [effort] it is held against healthy missions, else against the rest of this one.
"""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.measure import alone, lasts
from diagnosis.efforts.assess import efforts_of, limit_of
from diagnosis.efforts.inputs import wheels_with_efforts
from diagnosis.efforts.relation import fitted, shares_of, usual_of
from diagnosis.efforts.windows import steps_of
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

_RUN_S = 12  # of driving
_LEAST, _MOST, _ALONE = (
    0.2,
    0.5,
    2.5,
)  # share that an effort may change by, at least and at most, and times the next one's
_WHEELS = 3  # of fewer, each is the other's measure
_LEARNED = 1  # of `LENGTHS_S`
_LEAST_LEARNED = 0.2  # a share, from which on an effort that healthy missions know counts


def effort_checks(cells: Cells) -> dict[str, Checked]:
    """The check of each wheel whose effort tells, by wheel; of one that hardly drives it does not.

    Healthy missions of a field robot (eleven, a user's) changed by 0.35 at most where the next wheel had 0.18, and else by 0.2; motors with a half and a
    quarter of their torque by 0.30 beside 0.06 and 0.54 beside 0.17.
    """
    return cells.once("efforts", lambda: _checks(cells))


def _checks(cells: Cells) -> dict[str, Checked]:
    learned, found = _learned(cells), _changes(cells)
    out = {}
    for wheel in {*found, *learned}:
        checks = [x for x in (found.get(wheel), learned.get(wheel)) if x is not None]
        out[wheel] = max(checks, key=lambda c: (c.worst or 0.0) / c.limit)
    return out


def _check(cells: Cells, wheel: str, value: float, limit: float) -> Checked:
    return lasts(cells, (Kind.WHEEL, wheel, Side.ACTUATOR, Check.EFFORT), value, limit)


def _learned(cells: Cells) -> dict[str, Checked]:
    efforts = efforts_of(cells.timeline, cells.machine)
    if efforts is None:
        return {}
    out = {}
    for i, (wheel, model) in enumerate(zip(efforts.wheels, efforts.models, strict=True)):
        off = np.abs(efforts.shares.over(i, _RUN_S)[0])
        if off.size:
            out[wheel] = _check(cells, wheel, float(off.max()), max(_LEAST_LEARNED, limit_of(model, _LEARNED)))
    return out


def _changes(cells: Cells) -> dict[str, Checked]:
    """By how much the share changes by which each effort is off this mission's own relation."""
    machine = cells.machine
    wheels = wheels_with_efforts(cells.timeline, machine)
    if len(wheels) < _WHEELS:
        return {}
    steps, least = steps_of(cells.timeline, machine, wheels), machine.limits.driving_speed
    efforts = np.nan_to_num(steps.effort)
    theta = [fitted(steps.terms(i, least), efforts[:, i], steps.use[:, i]) for i in range(len(wheels))]
    known = [t for t in theta if t is not None]
    if len(known) < len(wheels):
        return {}
    usual = [max(usual_of(efforts[:, i], steps.use[:, i]), 1e-12) for i in range(len(wheels))]
    shares = shares_of(steps, known, usual, least)
    runs = [shares.over(i, _RUN_S)[0] for i in range(len(wheels))]
    changes = [float(np.ptp(x)) if x.size else None for x in runs]
    return {
        w: _check(cells, w, change, alone(changes, i, _MOST, _LEAST, _ALONE))
        for i, (w, change) in enumerate(zip(wheels, changes, strict=True))
        if change is not None
    }
