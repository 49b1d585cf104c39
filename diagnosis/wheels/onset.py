"""Onset and end of a run at the raw rate, and what the shape of the onset says."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.models import S_OU_LARGE, S_STUCK, TOTAL_SENSOR, WheelFilterModel
from replay.faults import Side

Array = NDArray[np.float64]

_SILENT = 10  # readings after an onset that are looked at for silence


def onset_sentence(start: int, y: Array, model: WheelFilterModel, dt: float, name: str, side: Side) -> str:
    """What the shape of the onset says: a sensor's fault may jump by more than a wheel can, a valve's bends.

    `y` of shape (n,); `dt` in s.
    """
    low, high = max(1, start - 2), min(y.size, start + 3)
    if side is Side.SENSOR and start and not np.isfinite(y[start + _SILENT : start + 2 * _SILENT]).any():
        return f"At its onset {name} falls silent."
    if high <= low or start == 0:
        return "The fault was present from the first sample, so its onset gives no evidence."
    steps = np.abs(np.nan_to_num(y[low:high] - y[low - 1 : high - 1]))
    largest = float(steps.max())
    fastest = float(np.nan_to_num(np.abs(y[low - 1 : high])).max())
    able = (model.K + fastest) * min(1.0, dt / model.tau)  # by a wheel whose valve opens wholly the other way
    jump = f"At its onset {name} jumps by {largest:.2g} {{speed_unit}} within one sample ({largest / model.noise:.0f} times its noise)"
    beyond = largest > max(8 * model.noise, able)
    if side is Side.ACTUATOR:
        if beyond:
            return f"{jump}: a fault of the {{valve}} alone does not explain this."
        return (
            f"At its onset {name} changes with the lag of the {{wheel}}, and no step exceeds {largest:.2g} {{speed_unit}}: this is how a {{wheel}} "
            "reacts when its {valve} fails."
        )
    if beyond:
        return f"{jump}. A sensor can do this, a {{wheel}} cannot."
    return (
        f"{jump}."
        if largest > 8 * model.noise
        else f"At its onset no step of {name} exceeds {largest:.2g} {{speed_unit}}."
    )


def refined(start: int, y: Array, reach: int, m: int, noise: float) -> int:
    """Onset of a sensor's fault at the raw rate: it jumps within one sample, or stops changing.

    Parameters
    ----------
    start : int
        Sample at which the run begins, to a block.
    y : Array, shape (n,)
        Measured speed [m/s].
    reach : int
        Samples to look around.
    m : int
        Model of the run.
    noise : float
        White noise of the sensor [m/s].
    """
    low, high = max(1, start - reach), min(y.size, start + reach + 1)
    if high - low < 2 or not (S_STUCK <= m <= S_OU_LARGE):
        return start
    steps = np.abs(np.nan_to_num(y[low:high] - y[low - 1 : high - 1]))
    at = int(np.argmax(steps))
    if steps[at] > 8 * noise:
        return low + at
    if m in TOTAL_SENSOR:
        moving = np.flatnonzero(steps > 0)
        return low + int(moving[-1]) if moving.size else low - 1
    return start


def released(stop: int, y: Array, reach: int) -> int:
    """First sample at which a constant sensor moves again, within `reach` samples of `stop`. `y` of shape (n,)."""
    low, high = max(1, stop - reach), min(y.size, stop + reach + 1)
    moved = np.flatnonzero(np.nan_to_num(y[low:high] - y[low - 1 : high - 1]) != 0)
    return low + int(moved[0]) if moved.size else stop
