"""Predict a recorded mission under a law: the checked wrapper around the compiled worlds."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from replay.controllers.choice import Controller, controller_state
from replay.counterfactual.kernel import Signals, scan, world_state
from replay.counterfactual.world import CoupledPlant, OtherWorld, RecordedWorld
from replay.errors import ConfigError


def predict(
    recorded: RecordedWorld,
    plant: CoupledPlant,
    controller: Controller,
    u_max: float,
    psi0: tuple[float, ...] = (),
    longest_step: float = 0.002,
) -> OtherWorld:
    """Run the recorded mission under a controller.

    Parameters
    ----------
    recorded : RecordedWorld
        The mission.
    plant : CoupledPlant
        Its wheels.
    controller : Controller
        The law that answers in the other world.
    u_max : float
        Largest opening [fraction].
    psi0 : tuple[float, ...]
        Ψ̂(0) of each wheel, for MFHCA; empty: 0.
    longest_step : float
        Longest step of the integration [s]; slower logs are divided.

    Raises
    ------
    ConfigError
        Where the columns do not have one shape, or hold NaN where they must not.
    """
    columns = {f.name: np.ascontiguousarray(getattr(recorded, f.name)) for f in fields(recorded) if f.name != "dt"}
    shapes = {x.shape for x in columns.values()}
    if len(shapes) != 1 or recorded.y.ndim != 2:
        raise ConfigError(f"counterfactual: columns of shapes {sorted(shapes)}; expected one shape (n, wheels)")
    for name, values in columns.items():
        if name != "speed" and not np.isfinite(values).all():
            raise ConfigError(f"counterfactual: {name} has values that are no numbers; fill them first")
    n, wheels = recorded.y.shape
    start = controller_state(wheels)
    if controller.name == "mfhca" and psi0:
        start[:, 0] = psi0
    out = [np.empty((n, wheels)) for _ in range(4)]
    substeps = max(1, int(np.ceil(recorded.dt / longest_step - 1e-9)))
    scan(
        Signals(**columns),
        recorded.dt,
        substeps,
        controller.kind.code,
        controller.gains(),
        u_max,
        plant,
        world_state(wheels, start),
        *out,
    )
    return OtherWorld(*out)
