"""Where a steering valve's command asks for a motion that its sensor can show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum
from diagnosis.steering.path import AxleFilter
from replay.arrays.quantiles import median_of


def exercised(axle: AxleFilter) -> NDArray[np.bool_]:
    """Blocks in which the command moves the axle by much more than the sensor's noise. Shape (m,)."""
    width = max(1, round(0.5 / axle.blocks.dt))
    travel = np.abs(moving_sum(np.nan_to_num(axle.driven.command), width)) * axle.blocks.dt
    model, noise = axle.model, axle.model.noise
    least = 10 * np.sqrt(noise.white / max(1.0, width * float(median_of(axle.blocks.count)))) + noise.lsb
    return np.asarray(travel > max(least, 0.5 * model.rate_error, 1e-3 * model.stop))


def asked(axle: AxleFilter, start: int, stop: int) -> tuple[int, int, float]:
    """First and last block of [start, stop) in which a motion is asked for, and for how long in all [s]."""
    shown = np.flatnonzero(exercised(axle)[start:stop])
    if not shown.size:
        return start, start, 0.0
    return start + int(shown[0]), start + int(shown[-1]) + 1, shown.size * axle.blocks.dt
