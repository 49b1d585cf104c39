"""A speed sensor that is noisy for all of a mission: the fault does not become its own noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from diagnosis.wheels.filter_identification import of_usual_noise
from diagnosis.wheels.models import WheelFilterModel
from replay.machine.config import Noise


def usual(*noises: float, stated: float | None = None) -> list[float]:
    """Noise of every wheel, of a span of 2 m/s, of which the machine file may state the last one."""
    wheels = [WheelFilterModel(2.4, 0.25, noise, 0.0005, 0.0003, 0.014, 2.0, 0.15) for noise in noises]
    data: Any = SimpleNamespace(span=2.0, noise=[Noise()] * (len(noises) - 1) + [Noise(std=stated)])
    return [w.noise for w in of_usual_noise(wheels, data) if w is not None]


def test_noise_is_a_few_times_that_of_the_other_sensors_at_most() -> None:
    assert usual(0.005, 0.006, 0.005, 0.3) == [0.005, 0.006, 0.005, pytest.approx(0.025)]
    assert usual(0.001, 0.001, 0.3)[2] == pytest.approx(0.02)  # of the span


def test_what_all_have_is_theirs_and_what_is_stated_stays() -> None:
    assert usual(0.3, 0.3, 0.3) == [0.3, 0.3, 0.3]
    assert usual(0.005, 0.005, 0.3, stated=0.3)[2] == 0.3
    assert usual(0.3) == [0.3]
