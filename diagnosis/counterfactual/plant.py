"""The plant of a counterfactual mission from the wheel models of the diagnosis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.wheel_model import WheelModelFit
from replay.counterfactual.world import CoupledPlant
from replay.machine.config import Machine, WheelPlant

Array = NDArray[np.float64]

_SPAN = 2.2  # of the top speed, as the wheel models have it
_SLIDES_AT = 0.057  # slip from which a tyre transmits no more, of the span: the middle of what the wheel models try
_GRIP = 2.2  # where neither machine file nor mission shows it


def coupled_plant(fit: WheelModelFit, machine: Machine, *, coupled: bool) -> CoupledPlant:
    """Plant of all wheels.

    Parameters
    ----------
    fit : WheelModelFit
        Models of all wheels; none is missing.
    machine : Machine
        Pump and largest opening.
    coupled : bool
        Whether the tyres tie the wheels to a body whose geometry is known.
    """
    plants = [p for p in fit.plants if p is not None]
    u_max, pumped = machine.control.u_max, machine.plant.flow is not None
    maps = [_map(p, u_max, beyond=pumped) for p in plants]
    openings = np.unique(np.concatenate([o for o, _ in maps]))
    grip = np.array([_GRIP if p.grip is None else p.grip for p in plants]) * coupled
    return CoupledPlant(
        tau=np.array([p.tau for p in plants]),
        openings=np.tile(openings, (len(plants), 1)),
        speeds=np.array([np.interp(openings, o, s) for o, s in maps]),
        play=np.array([p.hysteresis / 2 for p in plants]),
        grip=grip,
        most=grip * _SLIDES_AT * _SPAN * machine.max_speed,
        creep=0.0,
        flow=np.inf if machine.plant.flow is None else machine.plant.flow,
    )


def _map(plant: WheelPlant, u_max: float, *, beyond: bool) -> tuple[Array, Array]:
    """Openings and speeds of a valve; `beyond` what was seen it goes on where a pump ends it."""
    if plant.openings:
        speeds = np.array(plant.speeds)
        return np.array(plant.openings), speeds + np.array(plant.unseen) if beyond and plant.unseen else speeds
    edge = max(plant.dead, 1e-9)
    top = plant.K * max(u_max - edge, 0.0)
    return np.array([-u_max, -edge, edge, u_max]), np.array([-top, 0.0, 0.0, top])
