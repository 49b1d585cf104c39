"""How an axle's rate at an opening depends on the speed of driving: tyres scrub where the machine stands, a pump on the engine gives more at speed.

One course for all axles of a machine, identified from the mission: of each window the rate over what the plant says of its opening.
A rate that falls with the speed is not believed of a machine, and neither is a course that does not explain every axle better: a fault
strikes one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.blocks import SensorNoise, SteeringBlocks, window_means
from diagnosis.steering.identification import LONG_S, usual_rate
from diagnosis.steering.plant import LEAST_WINDOWS, SteeringPlant
from diagnosis.steering.plant_fit import moving, tolerance_of
from diagnosis.steering.windows import Windows, windows_of
from replay.control.loop import Replay
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Speed = Callable[[NDArray[np.intp]], Array]

_KNOTS = np.array([0.0, 0.08, 0.25, 0.6])  # of the top speed
_SPREAD, _STEP = 0.4, 0.3  # of a rate: by how much a course may differ from 1, and from knot to knot
_SHARES = (0.4, 0.2, 0.1)  # of a rate, by which windows differ, from round to round
_ROUNDS = 4
_LEAST, _MOST = 0.5, 1.6
_BETTER = 0.97  # of the robust loss without it
_COUNTS = 0.03  # less is none


def body_speed(timeline: Timeline, replay: Replay, machine: Machine) -> Speed:
    """Median of the wheels' speeds at given steps [m/s], of their commands where none is known, else 0."""
    measured = [x for w in machine.wheels if (x := timeline.get(f"wheel.{w}.v")) is not None]

    def at(steps: NDArray[np.intp]) -> Array:
        commanded = _median(replay.v_ref[steps])
        if not measured:
            return np.nan_to_num(commanded)
        found = _median(np.column_stack([x[steps] for x in measured]))
        return np.nan_to_num(np.where(np.isfinite(found), found, commanded))

    return at


def _median(speeds: Array) -> Array:
    """Lower median of what is known in each row, whatever its sign; NaN where nothing is. From shape (n, wheels) to (n,)."""
    size = np.sort(np.abs(speeds), axis=1)  # NaN last
    middle = np.maximum(np.isfinite(size).sum(axis=1) - 1, 0) // 2
    return np.asarray(np.take_along_axis(size, middle[:, np.newaxis], axis=1)[:, 0])


def with_pace(
    axles: Sequence[SteeringBlocks],
    noises: Sequence[SensorNoise],
    plants: Sequence[SteeringPlant | None],
    speed: Speed,
    machine: Machine,
) -> list[SteeringBlocks]:
    """Blocks with the pace that the speed of driving gives their axles; as they are where none is seen.

    Parameters
    ----------
    axles : Sequence[SteeringBlocks]
        All axles that have blocks.
    noises : Sequence[SensorNoise]
        Of their angles.
    plants : Sequence[SteeringPlant or None]
        Identified at one pace.
    speed : Callable[[NDArray[np.intp]], Array]
        Of driving at given steps [m/s].
    machine : Machine
        Its top speed and end stops.
    """
    judged = [(b, n, p) for b, n, p in zip(axles, noises, plants, strict=True) if p is not None]
    if not judged:
        return list(axles)
    shares = [np.abs(speed(_middles(b))) / machine.max_speed for b, _, _ in judged]
    found = [
        _Axle(windows_of(b, n, machine.max_steer, LONG_S), p, s) for (b, n, p), s in zip(judged, shares, strict=True)
    ]
    scale = usual_rate([axle.part for axle in found])
    course = None if scale is None else _course(found, scale)
    if course is None:
        return list(axles)
    paces = iter(np.interp(s, _KNOTS, course) for s in shares)
    return [b if p is None else replace(b, pace=next(paces)) for b, p in zip(axles, plants, strict=True)]


class _Axle:
    """Windows of an axle, what its plant says of them [rad/s], and how its speed lies between the knots, shape (w, knots)."""

    def __init__(self, part: Windows, plant: SteeringPlant, share: Array) -> None:
        self.part = part
        self.rate = part.predicted(plant.valve, plant.lag, plant.play)
        middle = window_means(share, part.length)
        between = (middle[1:] + middle[:-1]) / 2
        self.hats = np.column_stack([np.interp(between, _KNOTS, row) for row in np.eye(_KNOTS.size)])

    def loss(self, course: Array, scale: float) -> tuple[float, int]:
        """Mean robust loss of a course, shape (knots,), and of how many windows it is."""
        rate = self.rate * (self.hats @ course)
        use = moving(self.part, rate, scale)
        r2 = ((self.part.rate - rate)[use] / tolerance_of(self.part, scale, _SHARES[-1])[use]) ** 2
        return float((r2 / (1.0 + r2)).mean()) if use.any() else 0.0, int(np.count_nonzero(use))


def _middles(blocks: SteeringBlocks) -> NDArray[np.intp]:
    """Step in the middle of every block, shape (m,)."""
    middle = np.arange(blocks.mean.size) * blocks.length + blocks.length // 2
    return np.minimum(middle, blocks.raw_u.size - 1)


def _course(axles: Sequence[_Axle], scale: float) -> Array | None:
    """Rate at each knot as a multiple of the usual one, shape (knots,); None where it makes no difference."""
    plain = np.ones(_KNOTS.size)
    course = plain
    steps = np.diff(np.eye(_KNOTS.size), axis=0)
    prior = np.eye(_KNOTS.size) / _SPREAD**2 + steps.T @ steps / _STEP**2
    for share in _SHARES:
        for _ in range(_ROUNDS):
            normal, right = prior.copy(), prior @ plain
            for axle in axles:
                tolerance = tolerance_of(axle.part, scale, share)
                design = axle.hats * (axle.rate / tolerance)[:, None]
                aim = axle.part.rate / tolerance
                weight = np.where(axle.part.good, 1.0 / (1.0 + (aim - design @ course) ** 2) ** 2, 0.0)
                weight *= min(1.0, axle.part.length * axle.part.dt)  # windows within a second are one observation
                normal += (design * weight[:, None]).T @ design
                right += design.T @ (weight * aim)
            course = _rising(np.linalg.solve(normal, right), np.diag(normal))
    course = np.clip(course, _LEAST * course.max(), _MOST * course.min())
    if np.ptp(course) < _COUNTS:
        return None
    losses = [(axle.loss(plain, scale), axle.loss(course, scale)) for axle in axles]
    told = [(before, after) for (before, n), (after, _) in losses if n >= LEAST_WINDOWS]
    return course if told and all(after < _BETTER * before for before, after in told) else None


def _rising(values: NDArray[np.floating[Any]], weights: NDArray[np.floating[Any]]) -> Array:
    """The values that never fall, nearest to some by weighted squares (pool adjacent violators); both of shape (knots,)."""
    pools: list[list[float]] = []  # mean, weight, number
    for value, weight in zip(values.tolist(), weights.tolist(), strict=True):
        pools.append([value, weight, 1])
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            later = pools.pop()
            first = pools[-1]
            total = first[1] + later[1]
            pools[-1] = [(first[0] * first[1] + later[0] * later[1]) / total, total, first[2] + later[2]]
    return np.repeat([p[0] for p in pools], [int(p[2]) for p in pools])
