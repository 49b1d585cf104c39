"""A steering axle's plant as the machine file has it, and what it makes believe before a mission is seen."""

from __future__ import annotations

import numpy as np

from diagnosis.steering.plant import OPEN_LIMIT, OPEN_LIMIT_STD, SteeringPlant
from diagnosis.steering.plant_fit import DEAD, LAG, LIMITS, PLAY, SIZE, SLOPES
from diagnosis.steering.valve_map import ValveMap
from replay.machine.axle_plant import AxlePlant

# what changes from mission to mission, by temperature and wear: shares of slopes, limits and lag, dead bands [fraction],
# play [rad]
_SLOPE_DRIFT, _LIMIT_DRIFT, _LAG_DRIFT, _DEAD_DRIFT, _PLAY_DRIFT = 0.04, 0.04, 0.1, 0.001, 2e-4
_ENOUGH = 1000  # windows behind a plant of healthy missions


def axle_plant_of(plant: SteeringPlant) -> AxlePlant:
    """The entry in the machine file."""
    std, valve = np.sqrt(np.diag(plant.cov)), plant.valve
    seen = [std[LIMITS.start + i] < 0.9 * OPEN_LIMIT_STD for i in range(2)]
    return AxlePlant(
        slope_up=valve.slope_up,
        slope_down=valve.slope_down,
        dead_up=valve.dead_up,
        dead_down=valve.dead_down,
        lag=plant.lag,
        play=plant.play,
        limit_up=valve.limit_up if seen[0] else None,
        limit_down=valve.limit_down if seen[1] else None,
        misfit=plant.misfit,
        seen_up=plant.seen[1],
        seen_down=-plant.seen[0],
        slope_up_std=float(std[0] * valve.slope_up),
        slope_down_std=float(std[1] * valve.slope_down),
        dead_up_std=float(std[2]),
        dead_down_std=float(std[3]),
        lag_std=float(std[LAG] * plant.lag),
        play_std=float(std[PLAY]),
    )


def plant_before(known: AxlePlant) -> SteeringPlant:
    """The plant of an axle before a mission, its covariance with what changes between missions."""
    reach = (known.seen_up - known.dead_up, known.seen_down - known.dead_down)
    open_limits = [
        OPEN_LIMIT * s * max(r, 0.01) for s, r in zip((known.slope_up, known.slope_down), reach, strict=True)
    ]
    limits = [g if g is not None else o for g, o in zip((known.limit_up, known.limit_down), open_limits, strict=True)]
    valve = ValveMap(known.slope_up, known.slope_down, known.dead_up, known.dead_down, limits[0], limits[1])
    var = np.zeros(SIZE)
    shares = np.array([known.slope_up_std / known.slope_up, known.slope_down_std / known.slope_down])
    var[SLOPES] = shares**2 + _SLOPE_DRIFT**2
    var[DEAD] = np.array([known.dead_up_std, known.dead_down_std]) ** 2 + _DEAD_DRIFT**2
    given = np.array([known.limit_up is not None, known.limit_down is not None])
    var[LIMITS] = np.where(given, _LIMIT_DRIFT, OPEN_LIMIT_STD) ** 2
    var[LAG] = (known.lag_std / known.lag) ** 2 + _LAG_DRIFT**2
    var[PLAY] = known.play_std**2 + _PLAY_DRIFT**2
    return SteeringPlant(
        valve, known.lag, known.play, np.diag(var), known.misfit, _ENOUGH, (-known.seen_down, known.seen_up)
    )
