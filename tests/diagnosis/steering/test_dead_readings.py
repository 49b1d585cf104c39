"""Angles that stay where nobody asks them to leave."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.steering.dead_readings import at_rest

N = 1_000


def axle(mean: np.ndarray, command: np.ndarray) -> Any:
    """An axle with readings of .2 mrad steps in blocks of 20 ms [rad], and the rate that its command asks for [rad/s]."""
    noise = SimpleNamespace(white=1e-8, lsb=2e-4)
    return SimpleNamespace(
        blocks=SimpleNamespace(dt=0.02, count=np.ones(N), mean=mean),
        driven=SimpleNamespace(command=command),
        model=SimpleNamespace(noise=noise, rate_error=0.01, stop=0.6),
    )


@pytest.mark.parametrize(("first", "asked", "rests"), [(0.0, 0.0, True), (2e-4, 0.0, False), (0.0, 0.3, False)])
def test_an_angle_that_never_changes_says_nothing_where_nobody_asks_it_to(
    first: float, asked: float, *, rests: bool
) -> None:
    """One that changed before, or that is asked to, may be dead."""
    mean = np.zeros(N)
    mean[:20:2] = first
    command = np.zeros(N)
    command[500:600] = asked
    assert at_rest(axle(mean, command), 20, N, command_logged=True) is rests
    if not first:
        assert at_rest(axle(mean, command), 0, N, command_logged=True) is rests


def test_an_angle_that_trembles_where_it_rests_lives_and_one_that_only_ever_moved_elsewhere_shows_nothing() -> None:
    mean, command = np.zeros(N), np.zeros(N)
    mean[0:900:2], mean[900:] = 2e-4, np.linspace(0.0, 0.3, 100)
    command[900:] = 0.3
    assert at_rest(axle(mean, command), 0, 900, command_logged=True)
    mean[:900] = 0.0
    assert at_rest(axle(mean, command), 0, 900, command_logged=True)


@pytest.mark.parametrize(("asked_s", "after", "rests"), [(0.4, 0.0, True), (0.4, 0.03, False), (1.6, 0.0, False)])
def test_an_angle_that_reads_on_from_where_it_stayed_missed_no_brief_motion(
    asked_s: float, after: float, *, rests: bool
) -> None:
    """Its axle stood within its dead band; a sensor that was dead would read on from elsewhere, and longer motion is made."""
    mean, command = np.zeros(N), np.zeros(N)
    mean[:400:2], mean[600:] = 2e-4, after
    command[500 : 500 + round(asked_s / 0.02)] = 0.1
    assert at_rest(axle(mean, command), 400, 600, command_logged=True) is rests
