"""An axle's angle beside its command while its valve rests: a loop that is content with an angle has read the commanded one.

What is recorded of that sensor may be another: a channel that drifts off, or that loses a share on its way to the log, leaves the loop as it is.
The rate per opening shows none of it, and the axle turns the machine as it is told.
"""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import worst
from diagnosis.clearing.still import answered
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

#: rad; where the valve of a healthy axle rested, its angle was off its command by at most .024 (own and fifteen other machines, tuning).
OFF = 0.06
_DRIVES = 0.03  # of the top speed: a loop that is switched off with the drive holds nothing
_COMES = 0.02  # rad, by which a command may move in a window: what follows it is late


def commanded_angle(cells: Cells, j: int) -> Checked:
    """How far the angle of axle `j` is off its command in windows in which its valve is told to rest and the machine drives [rad].

    Open where either is not logged, or an axle's valve never rests.
    """
    about = (Kind.STEER, cells.machine.axles[j], Side.SENSOR_OR_ACTUATOR, Check.COMMANDED_ANGLE)
    return worst(cells, about, off_command(cells, j), OFF)


def off_command(cells: Cells, j: int) -> Array:
    """The mean of what an angle is off its command [rad] in each window, NaN where its valve does not rest, shape (windows,)."""
    angle, asked, command = (cells.axles(leaf)[:, j] for leaf in ("phi", "phi_ref", "u"))
    frame, speed = cells.frame, np.abs(cells.wheels("v"))
    fastest = np.where(np.isfinite(speed), speed, 0.0).max(axis=1, initial=0.0)
    rests = frame.rms(command) <= answered(cells)
    held = np.asarray(np.sqrt(np.maximum(frame.mean(asked**2) - frame.mean(asked) ** 2, 0.0))) <= _COMES
    drives = frame.mean(fastest) > _DRIVES * cells.machine.max_speed
    return np.asarray(np.where(rests & held & drives, np.abs(frame.mean(angle - asked)), np.nan))
