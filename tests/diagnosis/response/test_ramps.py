"""Ramps of a drive at its limit are no delay."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.kernel import follow
from diagnosis.response.ramps import at_its_limit, only_a_ramp
from diagnosis.response.spells import Spell
from replay.faults import FaultMode

Array = NDArray[np.float64]

STEPS, DT, BLOCKS = 5, 0.05, 400
H = STEPS * DT


def drive(y: Array, told: Array) -> Any:
    blocks = SimpleNamespace(start=np.arange(BLOCKS) * STEPS, mean=y, low=told - 0.02, high=told + 0.02)
    return SimpleNamespace(
        wheel=SimpleNamespace(blocks=blocks, dt=DT),
        driving=np.ones(BLOCKS, np.bool_),
        response=SimpleNamespace(answered=True),
    )


def commands() -> Array:
    """Gentle changes, and one swing from full speed forwards to full speed backwards."""
    gentle = 0.6 + 0.3 * np.sin(np.arange(BLOCKS) * H / 4.0)
    gentle[200:240] = np.where(np.arange(40) < 2, 0.6, -1.8)
    return np.asarray(gentle)


@pytest.mark.parametrize("late", [False, True])
def test_a_ramp_is_told_from_a_delay(late: bool) -> None:
    """Both come late to the swing; one climbs as fast as the drive ever does, the other is the swing itself, a second later."""
    told = follow(commands(), 0.6, 0.5, 5.0)
    y = np.roll(told, round(1.0 / H)) if late else follow(commands(), 0.6, 0.5, 0.6 * H)
    if late:
        y[:200], y[250:] = told[:200], told[250:]
    found: Any = SimpleNamespace(start=201 * STEPS, stop=222 * STEPS)
    assert at_its_limit(found, drive(y, told)) == (not late)
    spell = Spell(203, 215, FaultMode.INEFFICIENT, 0.9)
    assert only_a_ramp(spell, [found], drive(y, told), STEPS) == (not late)
    assert not only_a_ramp(spell._replace(own=True), [found], drive(y, told), STEPS)
    assert not only_a_ramp(spell._replace(start=300, stop=320), [found], drive(y, told), STEPS)
