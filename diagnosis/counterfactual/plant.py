"""The plant of a counterfactual mission from the wheel models of the diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.assess import ComponentResult
from diagnosis.results.wheel_model import WheelModelFit
from diagnosis.wheels.motion import in_motion
from diagnosis.wheels.wheel_channels import wheel_channels
from diagnosis.wheels.wheel_fit import wheel_fit
from replay.control.loop import Replay, any_finite, stack
from replay.controllers.choice import Controller
from replay.counterfactual.predict import predict
from replay.counterfactual.world import CoupledPlant, RecordedWorld
from replay.machine.config import Machine, WheelPlant
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_SPAN = 2.2  # of the top speed, as the wheel models have it
_SLIDES_AT = 0.057  # slip from which a tyre transmits no more, of the span: the middle of what the wheel models try
_LIGHTER = 0.8  # of the load, from which another wheel model is believed rather than the diagnosis's
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


def wheel_fits(timeline: Timeline, replay: Replay, machine: Machine, found: ComponentResult) -> list[WheelModelFit]:
    """Models of the driven wheels that come into question: the diagnosis's, and where those were found in the mission, ones without the body."""
    channels, motion = (
        wheel_channels(timeline, machine),
        in_motion(measured_angle(timeline, machine), machine, timeline),
    )
    fits = [found.wheel_model or wheel_fit(channels, replay, timeline, machine, motion)]
    if fits[0] is not None and fits[0].identified and machine.plant.coupling != "free":
        free = replace(machine, plant=replace(machine.plant, coupling="free"))
        own = wheel_fit(channels, replay, timeline, free, motion)
        fits.append(own)
        if own is not None:
            fits.append(replace(own, plants=tuple(None if p is None else replace(p, grip=None) for p in own.plants)))
    driven = [replace(f, plants=tuple(f.plants[i] for i in machine.driven_columns)) for f in fits if f is not None]
    return [f for f in driven if all(p is not None for p in f.plants)]


def lightest(
    fits: Sequence[WheelModelFit], world: RecordedWorld, machine: Machine, *, coupled: bool
) -> tuple[WheelModelFit, CoupledPlant]:
    """The model that leaves the wheels the least load in the recorded world, by its median.

    What drives a wheel beside its own valve (the body, when it is taken to tie the wheels more or less than it does) ends up in
    the load, which stays as it was in every other world.
    """
    best: tuple[float, WheelModelFit, CoupledPlant] | None = None
    seen = np.isfinite(world.speed)
    for fit in fits:
        plant = coupled_plant(fit, machine, coupled=coupled)
        load = float("inf")
        if len(fits) > 1 and seen.any():
            load = float(np.median(np.abs(predict(world, plant, Controller("p"), machine.control.u_max).load[seen])))
        if best is None or load < _LIGHTER * best[0]:
            best = load, fit, plant
    assert best is not None  # there is one fit at least
    return best[1], best[2]


def measured_angle(timeline: Timeline, machine: Machine) -> Array:
    """Measured angles of the axles [rad], the second sensor where there is one, shape (n, axles)."""
    measured, second = (stack(timeline, [f"steer.{a}.{x}" for a in machine.axles]) for x in ("phi", "phi_true"))
    return np.where(any_finite(second), second, measured) if machine.axles else measured
