"""What an inertial unit could have shown of a lone speed, and what it could not, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.response.acceleration import acceleration_of
from diagnosis.response.by_acceleration import filled
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.vibration import Unit
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.plain_numbers import plain

Sides = tuple[Assessment, Assessment]


def noted(sides: Sides, data: FollowerData, unit: Unit | None, dt: float) -> Sides:
    """Sensor and drive of a lone drive, with what the unit could have shown among the notes of the sensor.

    Parameters
    ----------
    sides : tuple[Assessment, Assessment]
        As judged.
    data : FollowerData
        The drive.
    unit : Unit or None
        The inertial unit.
    dt : float
        Step [s].
    """
    if unit is None:
        return sides
    sensor, drive = sides
    return replace(sensor, notes=(*sensor.notes, unit_note(data, unit, sensor.findings, dt))), drive


def unit_note(data: FollowerData, unit: Unit, findings: Sequence[Finding], dt: float) -> str:
    """The sentence; `findings` are times that are no example of how the two belong together. Others as for `noted`."""
    width = cell_of(dt)
    y = filled(cells(data.y, width))
    aside = np.zeros(y.size, np.bool_)
    for f in findings:
        aside[f.start // width : f.stop // width + 1] = True
    related = acceleration_of(y, filled(cells(unit.acceleration, width)), aside, width * dt)
    if related is None:
        return (
            f"imu.acceleration does not follow the changes of {data.name}: another axis, a dead unit, wheels that spin, or too few changes; "
            "no speed is judged by it."
        )
    if not np.isfinite(related.least):
        return f"imu.acceleration follows the changes of {data.name} too loosely to judge it."
    return (
        f"imu.acceleration has {related.gain:.2f} × the changes of {data.name}; one of {plain(related.least, 2)} {{speed_unit}} or more from one reading to "
        "the next, there and back, would show where the body does not do it. Smaller ones, what comes slowly, and what is wrong all through do not show in it."
    )
