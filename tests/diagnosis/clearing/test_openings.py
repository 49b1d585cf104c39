"""What a machine's commands are: openings, of which a speed is a multiple, or torques."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.clearing.cells import Frame
from diagnosis.clearing.measure import as_followed, compared, lowest_passed
from diagnosis.clearing.openings import speeds_follow_openings
from diagnosis.clearing.valves import OPENING

DT, SIZE = 0.1, 900
T = np.arange(SIZE) * DT
DRIVE = np.clip(1.5 * np.sin(2 * np.pi * T / 20.0), -1.0, 1.0)


def cells(speed: np.ndarray, command: np.ndarray, opening: np.ndarray) -> Any:
    columns = {"v": speed, "u": command, "u_applied": opening}
    return SimpleNamespace(
        dt=DT,
        frame=Frame(SIZE, 30, 5),
        machine=SimpleNamespace(max_speed=0.36),
        wheels=lambda leaf: columns[leaf],
        axles=lambda leaf: columns[leaf],
    )


@pytest.mark.parametrize("torque", [False, True])
def test_a_torque_is_no_speed(*, torque: bool) -> None:
    speed = 0.3 * lowest_passed(DRIVE, DT, 1.0)
    command = np.gradient(speed, DT) + 0.02 * np.sign(speed) if torque else DRIVE
    four = np.column_stack([speed] * 4), np.column_stack([command] * 4), np.full((SIZE, 4), np.nan)
    assert speeds_follow_openings(cells(*four)) is not torque


def test_openings_are_compared_behind_the_lag_that_valves_share() -> None:
    command = np.sign(np.sin(2 * np.pi * T / 2.4)) * (T % 12.0 < 6.0)
    late = lowest_passed(command, DT, 0.15)
    openings, commands = np.column_stack([late, late]), np.column_stack([command, command])
    of = cells(np.zeros((SIZE, 2)), commands, openings)
    followed = as_followed(of, openings, commands, OPENING)
    before, after = (np.nanmax(compared(of, late, x[:, 0], OPENING).off) for x in (commands, followed))
    assert after < 0.1 < before
    dead = np.column_stack([late, 0.0 * late])
    other = as_followed(of, dead, commands, OPENING)
    assert np.nanmax(compared(of, dead[:, 1], other[:, 1], OPENING).off) > 0.9
