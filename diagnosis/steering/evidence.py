"""Evidence columns of a steering axle and the angle that its model gives, each value of a block held or interpolated.

A sensor is held against the axle's most probable angle, a valve against what a healthy one makes of the command from that angle half a
second ago. A threshold is three standard deviations of such a residual while both are healthy.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.evidence_columns import Pictured, steps_of
from diagnosis.steering.filter_state import SteeringPath
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.model_bank import HEALTHY, SENSOR
from diagnosis.steering.path import AxleFilter
from diagnosis.steering.windows import lagged
from replay.faults import Side
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_ASKED_S = 0.5  # in which a valve's rate becomes an angle


class _Expected(NamedTuple):
    """Angle that a healthy part gives in m blocks, and the threshold of what is measured less that [rad]; NaN where nothing is expected."""

    angle: Array
    threshold: Array


def evidence_columns(
    inputs: AxleInputs, axle: AxleFilter, path: SteeringPath, findings: Sequence[Finding]
) -> dict[Side, Pictured]:
    """Residual, threshold and expected angle of both sides, and every sample of them around the findings."""
    y = inputs.angle
    step = steps_of(findings, y.size, inputs.timeline.dt)

    def held(x: Array) -> Array:
        return np.repeat(x, axle.blocks.length)[: y.size]

    def series(expected: _Expected) -> Iterator[tuple[str, Array]]:
        residual = held(expected.angle)
        np.subtract(y, residual, out=residual)
        yield "residual", residual
        del residual
        yield "threshold", held(expected.threshold)
        yield "expected", held(expected.angle)

    by = {Side.SENSOR: _of_sensor(axle, path), Side.ACTUATOR: _of_valve(axle, path)}
    return {side: Pictured.of(step, series(expected)) for side, expected in by.items()}


def _of_sensor(axle: AxleFilter, path: SteeringPath) -> _Expected:
    """The axle's most probable angle; what a healthy sensor may differ from it by is its noise."""
    noise = axle.model.noise.white + np.maximum(path.variance[:, 0], 0.0)
    return _Expected(path.mean[:, 0], 3.0 * np.sqrt(noise))


def _of_valve(axle: AxleFilter, path: SteeringPath) -> _Expected:
    """Where a healthy valve at the recorded command moves the axle to; nothing is expected behind a sensor that is not healthy."""
    dt, plant, angle = axle.blocks.dt, axle.model.plant, path.mean[:, 0]
    n = max(1, round(_ASKED_S / dt))
    if angle.size <= n:
        return _Expected(np.full(angle.size, np.nan), np.full(angle.size, np.nan))
    unknown = ~np.isfinite(axle.driven.command) | (SENSOR[path.model] != HEALTHY)
    decay = axle.constants.axle.rate_decay
    rate = lagged(np.nan_to_num(axle.driven.command), decay)
    window = sliding_window_view(rate, n)[1:]
    asked = angle[:-n] + dt * window.sum(axis=1)
    error = sliding_window_view(axle.driven.spread**2 + axle.model.rate_error**2, n)[1:].mean(axis=1) * (n * dt) ** 2
    late = (rate[n:] - rate[:-n]) * plant.lag * np.hypot(axle.model.lag_spread, plant.lag_std)
    variance = error + late**2 + np.maximum(path.variance[:-n, 0], 0.0) + axle.model.noise.white
    expected = np.clip(asked, *axle.model.stops)
    threshold = 3.0 * np.sqrt(variance) + plant.play
    gone = sliding_window_view(unknown, n + 1).any(axis=1)
    first = np.full(n, np.nan)
    return _Expected(*(np.concatenate([first, np.where(gone, np.nan, x)]) for x in (expected, threshold)))


def path_angle(axle: AxleFilter, path: SteeringPath, timeline: Timeline) -> Array:
    """Angle along a path at every step [rad]. Shape (n,)."""
    length = axle.blocks.length
    middles = np.arange(path.model.size) * length + (length - 1) / 2
    angle = timeline.store.column(np.float64, rows=timeline.size)
    for part in timeline.blocks():
        angle.append(np.interp(np.arange(part.start, part.stop), middles, path.mean[:, 0]))
    return angle.finish()
