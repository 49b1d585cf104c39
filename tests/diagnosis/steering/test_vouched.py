"""How long health is believed of an axle that is not steered."""

from __future__ import annotations

import numpy as np

from diagnosis.steering.states import vouched

DT = 0.5


def believed(shortest: float = np.inf, *, seen: bool = False) -> float:
    """Seconds of the pause between two obeyed movements, of 8 s, in which the axle is called healthy."""
    shown = np.ones(36, np.bool_)
    shown[10:26] = False
    return float(vouched(np.ones(36, np.bool_), shown, DT, seen=seen, shortest=shortest)[10:26].sum() * DT)


def test_between_two_movements_that_were_obeyed_no_fault_is_believed_to_come_and_go() -> None:
    assert believed() == 8.0
    assert believed(seen=True) == 8.0


def test_after_a_fault_that_did_come_and_go_health_is_believed_for_no_longer_than_that_one_lasted() -> None:
    assert believed(3.0) == 6.0  # three seconds behind the one movement, three before the other
    assert believed(1.0, seen=True) == 2.0
