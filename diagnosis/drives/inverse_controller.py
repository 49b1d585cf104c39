"""Inverse controller model: the speed that the controller saw, from its command and effort.

A proportional-integral controller answers to every change of speed, so that command and effort alone imply which speed
it saw (`replay.machine.drive_model.InverseController`). A logged speed that differs from it is not what the controller acted on: its
channel is at fault. A fault that the controller saw too leaves no difference; other evidence must show that one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.drives.inputs import DriveRecord, stretches
from replay.machine.drive_model import InverseController

Array = NDArray[np.float64]

_SETTLE_S = 0.6  # from this much of a stretch the controller's state before it is found


def high_passed(x: Array, memory_s: float, dt: float) -> Array:
    """First-order high-pass of x with its first value as the level before it, shape (n,). `memory_s` and `dt` in s."""
    from scipy.signal import lfilter

    a = memory_s / (memory_s + dt)
    return np.asarray(lfilter([a, -a], [1.0, -a], x - x[0]), dtype=np.float64)


def led(x: Array, lead: int) -> Array:
    """x earlier by `lead` steps; the ends are held. Both of shape (n,)."""
    return x[np.clip(np.arange(x.size) + lead, 0, x.size - 1)]


def fading(size: int, memory_s: float, dt: float) -> Array:
    """What is left of the integral state before the first of `size` samples, shape (size,).

    `memory_s` and `dt` in s.
    """
    return np.asarray(np.exp(-np.arange(size) * dt / memory_s), dtype=np.float64)


def implied_speed(model: InverseController, record: DriveRecord) -> Array:
    """Speed that the effort implies: the one that the controller saw. NaN where it is not logged; shape (n,).

    The state of the controller before a stretch is unknown: it is found from the measured speed of the stretch's first
    0.6 s and fades with the integral time.

    Parameters
    ----------
    model : InverseController
        Of this drive.
    record : DriveRecord
        The mission.
    """
    out = np.full(record.y.size, np.nan)
    for part in stretches(np.isfinite(record.command) & np.isfinite(record.u), len(model.gains) + 2):
        u = high_passed(record.u[part], model.memory_s, record.dt)
        x = record.command[part] + model.setpoint * high_passed(record.command[part], model.memory_s, record.dt)
        for i, gain in enumerate(model.gains):
            x = x + gain * led(u, model.first + i)
        fade = fading(x.size, model.memory_s, record.dt)
        head = slice(0, max(3, round(_SETTLE_S / record.dt)))
        rest, w = (record.y[part] - x)[head], fade[head]
        known = np.isfinite(rest)
        if known.any():
            x = x + fade * float(np.median(rest[known] / w[known]))
        out[part] = x
    return out
