"""Which fault a stretch of a steering axle's path may be: the evidence of every explanation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.filter_state import SteeringPath
from diagnosis.steering.model_bank import (
    ACTUATOR,
    COLOURED,
    HEALTHY,
    HEALTHY_MODEL,
    INEFFICIENT,
    MODES,
    NO_SIGNAL,
    NOISY,
    SENSOR,
    STUCK,
)
from diagnosis.steering.path import AxleFilter, Models, evidence_of
from diagnosis.steering.path_refinement import run_out_evidence
from diagnosis.steering.valve_map import opening_for
from replay.faults import FaultMode, Side

_SENSOR_ROWS = (HEALTHY, STUCK, NO_SIGNAL, INEFFICIENT, NOISY, COLOURED)
_VALVE_ROWS = (STUCK, NO_SIGNAL, INEFFICIENT, NOISY)


class Explanation(NamedTuple):
    """A side and the filter's row that it is in; no side and `HEALTHY` for no fault."""

    side: Side | None
    row: int

    @property
    def mode(self) -> FaultMode | None:
        """The row's fault mode; None where it is healthy."""
        return None if self.side is None else MODES[self.side, self.row]


NO_FAULT = Explanation(None, HEALTHY)


def evidence_of_explanations(
    side: Side, a: int, b: int, axle: AxleFilter, known: SteeringPath, min_sat: float
) -> dict[Explanation, float]:
    """Log-evidence of every row that [a, b) may be in: on this side, on the other one instead, and of none.

    A valve stuck closed is one without control signal.

    Parameters
    ----------
    side : Side
        `SENSOR` or `ACTUATOR`, whose rows are faulty there.
    a, b : int
        First block and the one behind the last.
    axle : AxleFilter
        The axle.
    known : SteeringPath
        Most probable models.
    min_sat : float
        Smallest saturation term of a stuck valve [fraction of full opening].
    """
    models = known.model
    sensor, actuator = SENSOR[models[a:b]], ACTUATOR[models[a:b]]
    other_free = bool(np.mean((actuator if side is Side.SENSOR else sensor) == HEALTHY) > 0.5)
    out: dict[Explanation, float] = {}
    trial = models.copy()
    for named, rows in ((Side.SENSOR, _SENSOR_ROWS), (Side.ACTUATOR, _VALVE_ROWS)):
        if named is not side and not other_free:
            continue
        for row in rows:
            numbers = _models_with(side, named, row, sensor, actuator, axle)
            if numbers is None:
                continue
            trial[a:b] = numbers
            found = NO_FAULT if row == HEALTHY else Explanation(named, row)
            evidence = run_out_evidence(axle, known, trial, a, b)
            if found == (Side.ACTUATOR, STUCK) and abs(_opening_in(axle, known, trial, a, b)) < min_sat:
                found = Explanation(Side.ACTUATOR, NO_SIGNAL)
            out[found] = max(evidence, out.get(found, -np.inf))
    if NO_FAULT not in out:
        trial[a:b] = HEALTHY_MODEL
        out[NO_FAULT] = run_out_evidence(axle, known, trial, a, b)
    return out


def _models_with(
    side: Side, named: Side, row: int, sensor: NDArray[np.int64], actuator: NDArray[np.int64], axle: AxleFilter
) -> list[int] | None:
    """Models of a run of `side` if side `named` is in `row`; None where they are not to be considered."""
    if row == HEALTHY or named is side:
        pairs = [(row, ac) if side is Side.SENSOR else (s, row) for s, ac in zip(sensor, actuator, strict=True)]
    else:
        pairs = [(row, HEALTHY) if named is Side.SENSOR else (HEALTHY, row)] * sensor.size
    numbers = {pair: _model_number(*pair, redundant=axle.model.redundant) for pair in set(pairs)}
    if any(m < 0 or not axle.allowed[m] for m in numbers.values()):
        return None
    return [numbers[pair] for pair in pairs]


def _model_number(sensor: int, actuator: int, *, redundant: bool) -> int:
    """Model that combines two rows; -1 where there is none. Behind a dead sensor a valve is seen only if measured."""
    if sensor in (STUCK, NO_SIGNAL) and not redundant:
        actuator = HEALTHY
    found = np.flatnonzero((sensor == SENSOR) & (actuator == ACTUATOR))
    return int(found[0]) if found.size else -1


def _opening_in(axle: AxleFilter, known: SteeringPath, models: Models, a: int, b: int) -> float:
    """Opening of a valve that is taken for stuck in [a, b) [fraction]."""
    return stuck_opening(float(evidence_of(axle, known, models, a, b)[1][3]), axle)


def stuck_opening(b: float, axle: AxleFilter) -> float:
    """Opening [fraction] of a stuck valve whose state is b [rad/s]."""
    plant = axle.model.plant
    return b / plant.gain if axle.model.opening_measured else opening_for(b, plant.valve)
