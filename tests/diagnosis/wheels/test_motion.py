"""How far wheels follow their commands."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.wheels.motion import MOST_AGAINST, against_command

T = np.arange(0.0, 100.0, 0.05)
COMMAND = np.tile(0.3 * np.sin(T / 4)[:, None], (1, 4))


def test_wheels_that_lag_follow_their_commands() -> None:
    late = np.roll(COMMAND, 4, axis=0)  # 0.2 s
    assert against_command(late, COMMAND) < 0.02


def test_one_sensor_is_not_the_machine() -> None:
    y = COMMAND.copy()
    y[:, 1] = 0.2
    assert against_command(y, COMMAND) == 0.0


def test_a_machine_that_runs_away_in_reverse() -> None:
    assert against_command(np.abs(COMMAND), COMMAND) == pytest.approx(0.5, abs=0.02)
    assert MOST_AGAINST < 0.5


@pytest.mark.parametrize("missing", [np.nan, 0.0])
def test_without_commands_nothing_is_against_them(missing: float) -> None:
    assert against_command(COMMAND, np.full(COMMAND.shape, missing)) == 0.0
