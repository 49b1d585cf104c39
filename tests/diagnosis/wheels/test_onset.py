"""Onsets and ends at the raw rate, and what the shape of an onset says."""

from __future__ import annotations

import numpy as np

from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.wheels.models import A_GAIN, S_GAIN, S_STUCK, WheelFilterModel
from diagnosis.wheels.onset import onset_sentence, refined, released
from replay.faults import Side

MODEL = WheelFilterModel(
    K=2.4,
    tau=0.25,
    noise=0.004,
    constant_noise=0.0005,
    rounding=0.0003,
    load=0.014,
    span=0.8,
    valve_span=0.15,
)
DT = 0.001
Array = np.ndarray


def jumping(size: int = 200, at: int = 100) -> Array:
    y = 0.2 + 0.002 * np.sin(np.arange(size) / 3)
    y[at:] -= 0.15
    return y


def test_a_sensors_fault_begins_where_it_jumps() -> None:
    y = jumping()
    for start in (92, 100, 113):
        assert refined(start, y, 20, S_GAIN, 0.004) == 100
    assert refined(150, y, 20, S_GAIN, 0.004) == 150
    assert refined(92, y, 20, A_GAIN, 0.004) == 92  # a valve's bends
    assert refined(0, y[:1], 20, S_GAIN, 0.004) == 0


def test_a_stuck_sensor_begins_with_the_last_change() -> None:
    y = 0.2 + 0.002 * np.sin(np.arange(200) / 3)
    y[103:] = y[103]
    assert refined(110, y, 20, S_STUCK, 0.004) == 103
    assert refined(150, y, 20, S_STUCK, 0.004) == 129
    assert refined(0, y[103:], 20, S_STUCK, 0.004) == 0


def test_onsets_in_words() -> None:
    y = jumping()

    def words(start: int, side: Side, y: Array = y, dt: float = DT) -> str:
        return HYDRAULIC.fill(onset_sentence(start, y, MODEL, dt, "v", side))

    assert "jumps by 0.15 m/s" in words(100, Side.SENSOR)
    assert words(100, Side.SENSOR).endswith("(38 times its noise). A sensor can do this, a wheel cannot.")
    assert words(100, Side.SENSOR, dt=0.02).endswith("(38 times its noise).")  # in 20 ms a wheel can
    assert words(100, Side.ACTUATOR).endswith("a fault of the valve alone does not explain this.")
    assert "changes with the lag of the wheel" in words(100, Side.ACTUATOR, dt=0.02)
    assert "changes with the lag of the wheel" in words(50, Side.ACTUATOR)
    assert "no step of v exceeds" in words(50, Side.SENSOR)
    assert "from the first sample" in words(0, Side.SENSOR)
    assert "falls silent" in words(5, Side.SENSOR, np.full(9, np.nan))


def test_a_stuck_sensor_ends_where_it_moves_again() -> None:
    y = 0.2 + 0.002 * np.sin(np.arange(200) / 3)
    y[:103] = y[102]
    assert [released(stop, y, 20) for stop in (95, 103, 110)] == [103, 103, 103]
    assert released(50, y, 20) == 50  # nothing moves nearby
