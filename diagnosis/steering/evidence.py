"""Evidence columns of a steering axle and the angle that its model gives, each value of a block held or interpolated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.evidence_columns import Pictured, steps_of
from diagnosis.steering.filter_state import SteeringPath
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.path import AxleFilter
from replay.faults import Side
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]


def evidence_columns(
    inputs: AxleInputs, axle: AxleFilter, path: SteeringPath, findings: Sequence[Finding]
) -> dict[Side, Pictured]:
    """Residual, threshold and expected angle of both sides, and every sample of them around the findings."""
    y = inputs.angle
    mean, std = path.mean, np.sqrt(np.maximum(path.variance, 0.0))
    step = steps_of(findings, y.size, inputs.timeline.dt)

    def held(x: Array) -> Array:
        return np.repeat(x, axle.blocks.length)[: y.size]

    def shared() -> Iterator[tuple[str, Array]]:
        residual = held(mean[:, 0])
        np.subtract(y, residual, out=residual)
        yield "residual", residual
        del residual
        yield "threshold", held(3 * std[:, 0])
        yield "expected", held(mean[:, 0])

    both = Pictured.of(step, shared())
    return {Side.SENSOR: both, Side.ACTUATOR: both}


def path_angle(axle: AxleFilter, path: SteeringPath, timeline: Timeline) -> Array:
    """Angle along a path at every step [rad]. Shape (n,)."""
    length = axle.blocks.length
    middles = np.arange(path.model.size) * length + (length - 1) / 2
    angle = timeline.store.column(np.float64, rows=timeline.size)
    for part in timeline.blocks():
        angle.append(np.interp(np.arange(part.start, part.stop), middles, path.mean[:, 0]))
    return angle.finish()
