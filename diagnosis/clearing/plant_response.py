"""Speed per opening of each wheel against the machine file's [plant]: what all wheels lose alike, no comparison of wheels shows."""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import lowest_passed
from diagnosis.clearing.responses import LAG_S, Responses
from diagnosis.estimation.valve_map import effective
from replay.machine.config import WheelPlant

#: Of the loss that counts [ln]: oil, load and supply change what a healthy machine gives by more than wheels differ.
LIMIT = 0.65
_LEAST_WINDOWS = 8
_UNSEEN = 0.1  # of the expected speed, by which the file does not know it


def beside_plant(cells: Cells, opening: Array, responses: Responses) -> list[float | None]:
    """ln of each wheel's usual speed over what its [plant] gives at the same openings; None where that is not known.

    Parameters
    ----------
    cells : Cells
        The mission.
    opening : Array, shape (cells, wheels)
        Openings, or their commands where they are not measured [of full].
    responses : Responses
        Of the wheels, which say where they are settled.
    """
    plants = cells.machine.plant.wheels
    return [
        _beside(cells, i, opening[:, i], plant, responses) if (plant := plants.get(wheel)) is not None else None
        for i, wheel in enumerate(cells.machine.wheels)
    ]


def _beside(cells: Cells, i: int, opening: Array, plant: WheelPlant, responses: Responses) -> float | None:
    given, unseen, _ = effective(opening, plant)
    passed = lowest_passed(plant.K * given, cells.dt, max(plant.tau, LAG_S))
    known = np.isfinite(opening) & (unseen * plant.K <= _UNSEEN * np.abs(passed))
    moved = responses.weight[:, i] * known
    expected = np.where(moved > 0.0, np.abs(passed), 0.0)
    frame = cells.frame
    full = frame.sums((moved > 0.0).astype(np.float64)) >= 0.5 * frame.length
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.where(full, np.log(frame.sums(moved) / frame.sums(expected)), np.nan)
    log = log[np.isfinite(log) & ~cells.explained(cells.machine.wheels[i])]
    return float(np.median(log)) if log.size >= _LEAST_WINDOWS else None
