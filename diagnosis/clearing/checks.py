"""All checks of a mission."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from diagnosis.clearing.axles import axle_checks
from diagnosis.clearing.cells import Cells
from diagnosis.clearing.jumps import jump_checks
from diagnosis.clearing.wheels import wheel_checks
from diagnosis.clearing.yaw import yaw_checks
from diagnosis.results.clearing import Checked
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.result import FaultInterval
from diagnosis.results.vocabulary import Severity
from diagnosis.results.wheel_model import WheelModelFit
from replay.control.loop import Replay
from replay.machine.config import Machine
from replay.signals.timeline import Timeline


def cells_of(
    timeline: Timeline,
    replay: Replay,
    machine: Machine,
    faults: Sequence[FaultInterval] = (),
    model: WheelModelFit | None = None,
    kept: dict[str, Any] | None = None,
) -> Cells:
    """A mission in cells.

    Parameters
    ----------
    timeline, replay, machine
        The aligned mission, the replayed loop and the machine.
    faults : Sequence[FaultInterval]
        What is stated: it need not be asked again whether something is wrong with such a part at that time.
    model : WheelModelFit or None
        Of the wheels on the ground.
    kept : dict[str, Any] or None
        What was computed of this mission already, whatever is stated of it; more is added.
    """
    stated: dict[str, list[tuple[float, float]]] = {}
    for f in faults:
        if f.severity is not Severity.INFO:
            stated.setdefault(f.component, []).append((f.start_s, f.stop_s))
    plants = () if model is None or not model.reliable else model.plants
    held = {w: p.grip for w, p in zip(machine.wheels, plants, strict=False) if p is not None and p.grip is not None}
    carried = {w: grip / (1.0 + grip) for w, grip in held.items()}
    may_carry = 0.0 if model is None else model.may_hold
    return Cells(timeline, replay, machine, stated, carried, may_carry, {} if kept is None else kept)


def checks_of(cells: Cells, words: MachineWords) -> tuple[Checked, ...]:
    """Whatever the log allows to ask of each part, whichever evidence judged it: more evidence never hides a fault."""
    return tuple(replace(c, words=words) for c in cells.once_beside("checks", lambda: _checks(cells)))


def _checks(cells: Cells) -> tuple[Checked, ...]:
    clear_at = cells.machine.limits.clear_at
    with warnings.catch_warnings():  # windows without any value
        warnings.simplefilter("ignore", RuntimeWarning)
        return (
            *wheel_checks(cells, clear_at),
            *axle_checks(cells, clear_at),
            *yaw_checks(cells),
            *jump_checks(cells, clear_at),
        )
