"""The end of a mission in which an axle is not steered while the machine drives: a fault that begins there shows in nothing.

An angle that stays where it is tells no scale, and a valve at rest no loss. What was steered before speaks for both until then alone.
"""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import lasts
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

_MOST = 1.0 / 3.0  # of the mission
_LEAST_S, _DRIVES_S = 25.0, 10.0  # it must last, and the machine drive in it
_TURNS, _WITHIN_S = 0.04, 1.0  # of the way to the end stop, within such a time: less tells little
_DRIVES = 0.03  # of the top speed


def unsteered(cells: Cells, j: int) -> Checked:
    """For which share of the mission, up to its end, axle `j` is not steered while the machine drives now and then [1].

    0 where that lasts less than 25 s, or the machine does not drive in it for 10 s; of what is not known it may.
    """
    about = (Kind.STEER, cells.machine.axles[j], Side.SENSOR_OR_ACTUATOR, Check.UNSTEERED)
    last = _last_turn(cells.axles("phi")[:, j], max(1, round(_WITHIN_S / cells.dt)), _TURNS * cells.machine.max_steer)
    speed = np.abs(cells.wheels("v"))[last:]
    stands = (np.nan_to_num(speed) <= _DRIVES * cells.machine.max_speed).all(axis=1) & np.isfinite(speed).any(axis=1)
    drives = float(np.count_nonzero(~stands)) * cells.dt
    rest = cells.size - last
    long = rest * cells.dt >= _LEAST_S and drives >= _DRIVES_S
    return lasts(cells, about, rest / max(cells.size, 1) if long else 0.0, _MOST)


def _last_turn(angle: Array, reach: int, least: float) -> int:
    """The first cell after an angle, of shape (cells,) [rad], last moves by so much within so many cells; 0 where it never does."""
    if angle.size <= reach:
        return 0
    with np.errstate(invalid="ignore"):
        turns = np.flatnonzero(np.abs(angle[reach:] - angle[:-reach]) >= least)
    return int(turns[-1]) + reach if turns.size else 0
