"""How an axle's rate at an opening depends on the speed of driving: tyres scrub where the machine stands, a pump on the engine gives more at speed.

One course for all axles of a machine, identified from the mission: of each window the rate over what the plant says of its opening.
A rate that falls with the speed is not believed of a machine, and neither is a course that does not explain every axle better: a fault
strikes one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.blocks import SensorNoise, SteeringBlocks, window_means
from diagnosis.steering.identification import LONG_S, identify_plants, usual_rate
from diagnosis.steering.plant import LEAST_WINDOWS, SteeringPlant
from diagnosis.steering.plant_fit import packed, predicted_by, robust_loss, tolerance_of
from diagnosis.steering.windows import Windows, windows_of
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
_FITS = 0.1  # robust loss of an axle that needs none
_SCRUB = np.array([0.7, 0.8, 0.95, 1.0])  # of heavy machines: from where a map is found that is not bent by standing
_REFINED = 2  # times


def body_speed(timeline: Timeline, machine: Machine, commanded: Array | None = None) -> Speed:
    """Median of the wheels' speeds at given steps [m/s], of their commands, of shape (n, wheels), where none is known, else 0."""
    measured = [x for w in machine.wheels if (x := timeline.get(f"wheel.{w}.v")) is not None]

    def at(steps: NDArray[np.intp]) -> Array:
        found = np.full(steps.size, np.nan)
        if measured:
            found = _median(np.column_stack([x[steps] for x in measured]))
        if commanded is not None:
            found = np.asarray(np.where(np.isfinite(found), found, _median(commanded[steps])))
        return np.asarray(np.nan_to_num(found))

    return at


def _median(speeds: Array) -> Array:
    """Lower median of what is known in each row, whatever its sign; NaN where nothing is. From shape (n, wheels) to (n,)."""
    size = np.sort(np.abs(speeds), axis=1)  # NaN last
    middle = np.maximum(np.isfinite(size).sum(axis=1) - 1, 0) // 2
    return np.asarray(np.take_along_axis(size, middle[:, np.newaxis], axis=1)[:, 0])


def identified(
    axles: Sequence[SteeringBlocks],
    noises: Sequence[SensorNoise],
    speed: Speed,
    machine: Machine,
    known: Sequence[SteeringPlant | None],
) -> tuple[list[SteeringBlocks], list[SteeringPlant | None]]:
    """Blocks with the pace that the speed of driving gives their axles, 1 where none is seen, and the plants at that pace.

    Parameters
    ----------
    axles : Sequence[SteeringBlocks]
        All axles that have blocks.
    noises : Sequence[SensorNoise]
        Of their angles.
    speed : Callable[[NDArray[np.intp]], Array]
        Of driving at given steps [m/s], from shape (k,) to (k,).
    machine : Machine
        Its top speed and end stops.
    known : Sequence[SteeringPlant or None]
        What is known of each axle before the mission.
    """
    shares = [np.abs(speed(_middles(b))) / machine.max_speed for b in axles]

    def at(course: Array) -> _Fit:
        plain = bool((course == 1.0).all())
        blocks = [
            b if plain else replace(b, pace=np.interp(s, _KNOTS, course)) for b, s in zip(axles, shares, strict=True)
        ]
        plants = identify_plants(blocks, noises, machine.max_steer, known)
        parts = [
            _Axle(windows_of(b, n, machine.max_steer, LONG_S), p, s)
            for b, n, p, s in zip(blocks, noises, plants, shares, strict=True)
            if p is not None
        ]
        return _Fit(course, blocks, plants, parts)

    best = at(np.ones(_KNOTS.size))
    if max(best.losses, default=0.0) < _FITS:
        return best.blocks, best.plants
    tried = at(_SCRUB)
    best = tried if tried.explains(best, _BETTER) else best
    for _ in range(_REFINED):
        course = best.next_course()
        if course is None or not (tried := at(course)).explains(best, _BETTER if (best.course == 1.0).all() else 1.0):
            break
        best = tried
    return best.blocks, best.plants


@dataclass(frozen=True, eq=False)
class _Fit:
    """Axles identified at one course, shape (knots,)."""

    course: Array
    blocks: list[SteeringBlocks]
    plants: list[SteeringPlant | None]
    parts: list[_Axle]

    @cached_property
    def scale(self) -> float | None:
        """Rate at which the axles usually turn [rad/s]; None where they turn too little."""
        return usual_rate([axle.part for axle in self.parts]) if self.parts else None

    @cached_property
    def losses(self) -> list[float]:
        """Mean robust loss of each axle that turns often enough."""
        if self.scale is None:
            return []
        often = [axle for axle in self.parts if axle.plant.windows >= LEAST_WINDOWS]
        return [robust_loss([axle.part], axle.constants, self.scale, _SHARES[-1]) for axle in often]

    def explains(self, other: _Fit, share: float) -> bool:
        """Whether it leaves less than a share of what another one leaves of every axle."""
        own, before = self.losses, other.losses
        return bool(own) and len(own) == len(before) and all(a < share * b for a, b in zip(own, before, strict=True))

    def next_course(self) -> Array | None:
        """What the rates of these plants are at each knot as a multiple of what they would be at one pace; None where it makes no difference."""
        if self.scale is None:
            return None
        course = _course(self.parts, self.scale, self.course)
        return None if np.abs(course - self.course).max() < _COUNTS else course


class _Axle:
    """Windows of an axle, what its plant says of them at one pace [rad/s], and how its speed lies between the knots, shape (w, knots)."""

    def __init__(self, part: Windows, plant: SteeringPlant, share: Array) -> None:
        self.part, self.plant = part, plant
        self.constants = packed(plant.valve, plant.lag, plant.play)
        self.rate = predicted_by(replace(part, pace=np.ones(part.pace.size)), self.constants)
        middle = window_means(share, part.length)
        between = (middle[1:] + middle[:-1]) / 2
        self.hats = np.column_stack([np.interp(between, _KNOTS, row) for row in np.eye(_KNOTS.size)])


def _middles(blocks: SteeringBlocks) -> NDArray[np.intp]:
    """Step in the middle of every block, shape (m,)."""
    middle = np.arange(blocks.mean.size) * blocks.length + blocks.length // 2
    return np.minimum(middle, blocks.raw_u.size - 1)


def _course(axles: Sequence[_Axle], scale: float, before: Array) -> Array:
    """Rate at each knot as a multiple of the one at one pace, shape (knots,), from the course `before` on."""
    course = before
    steps = np.diff(np.eye(_KNOTS.size), axis=0)
    prior = np.eye(_KNOTS.size) / _SPREAD**2 + steps.T @ steps / _STEP**2
    for share in _SHARES:
        for _ in range(_ROUNDS):
            normal, right = prior.copy(), prior @ np.ones(_KNOTS.size)
            for axle in axles:
                tolerance = tolerance_of(axle.part, scale, share)
                design = axle.hats * (axle.rate / tolerance)[:, None]
                aim = axle.part.rate / tolerance
                weight = np.where(axle.part.good, 1.0 / (1.0 + (aim - design @ course) ** 2) ** 2, 0.0)
                weight *= min(1.0, axle.part.length * axle.part.dt)  # windows within a second are one observation
                normal += (design * weight[:, None]).T @ design
                right += design.T @ (weight * aim)
            course = _rising(np.linalg.solve(normal, right), np.diag(normal))
    return np.clip(course, _LEAST * course.max(), _MOST * course.min())


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
