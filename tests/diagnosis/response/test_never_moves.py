"""A drive that is told as much as moves its twin and never reads anything is named; one that is told nothing, or stands with the machine, is not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.never_moves import unmoved
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

DT = 0.1
T = np.arange(0.0, 60.0, DT)
ON = (T > 10.0) & (T < 40.0)
MOVES = np.where(ON, 0.4, 0.0)
OPEN = np.where(ON, 0.6, 0.0)
NONE = np.zeros(T.size)


def modes(own: Array, other: Array, opening: Array, others: Array) -> list[tuple[FaultMode, Side]]:
    found = unmoved("L", {"L": own, "R": other}, {"L": opening, "R": others}, 0.1, DT)
    return [(f.mode, f.side) for f in found]


def test_a_drive_that_never_moves_beside_its_twin_is_named_with_its_sensor() -> None:
    assert modes(NONE, MOVES, OPEN, OPEN) == [(FaultMode.NO_SIGNAL, Side.SENSOR_OR_ACTUATOR)]


def test_what_moves_or_is_told_little_or_stands_with_the_machine_is_not_named() -> None:
    assert modes(MOVES, MOVES, OPEN, OPEN) == []
    assert modes(NONE, MOVES, NONE, OPEN) == []
    assert modes(NONE, MOVES, 0.1 * OPEN, OPEN) == []
    assert modes(NONE, NONE, OPEN, OPEN) == []
    first, second = np.where(T < 25.0, MOVES, 0.0), np.where(T < 25.0, 0.0, OPEN)
    assert modes(NONE, first, second, OPEN) == []  # told where the other stands
