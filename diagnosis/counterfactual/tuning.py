"""Gains of a law from healthy missions: what keeps its error and wear least in their worlds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from diagnosis.counterfactual.abduct import Abducted
from diagnosis.counterfactual.bands import thinned
from diagnosis.counterfactual.law import Law
from replay.controllers.choice import Controller
from replay.counterfactual.predict import predict

EVALUATIONS = 150
WEAR_S = 3e-5  # error that a total variation of 1 per second is worth [m/s·s]
_STEP_S = 0.002


def tuned(law: Law, missions: Sequence[Abducted], u_max: float) -> Law:
    """The law with gains tuned by Nelder and Mead's simplex over their logarithms.

    Cost: mean |e| + 3e-5 s · total variation of u per second, on average over the missions.

    Parameters
    ----------
    law : Law
        Where to begin; its reading stays. Of MFHCA ζ alone is tuned, for the paper gives the others.
    missions : Sequence[Abducted]
        Healthy ones.
    u_max : float
        Largest opening [fraction].
    """
    controller = law.controller
    keys = ("zeta",) if controller.name == "mfhca" else tuple(controller.own)
    bounds = controller.kind.bounds
    thin = [thinned(m, max(1, int(_STEP_S / m.world.dt))) for m in missions]

    def with_gains(x: np.ndarray) -> Controller:
        found = {k: min(float(np.exp(v)), bounds[k][1] if k in bounds else 1e6) for k, v in zip(keys, x, strict=True)}
        return replace(controller, values={**controller.values, **found})

    def cost(x: np.ndarray) -> float:
        return float(np.mean([_cost(m, with_gains(x), law.psi0, u_max) for m in thin]))

    first = np.log([max(controller.own[k], 1e-6) for k in keys])
    simplex = np.vstack([first, first + 0.5 * np.eye(first.size)])
    options = {"maxfev": EVALUATIONS, "initial_simplex": simplex, "adaptive": True}
    done = minimize(cost, first, method="Nelder-Mead", options=options)
    best = done.x if done.fun < cost(first) else first
    return replace(law, controller=with_gains(best))


def _cost(mission: Abducted, controller: Controller, psi0: tuple[float, ...], u_max: float) -> float:
    world = mission.world
    found = predict(world, mission.plant, controller, u_max, psi0)
    error = np.abs(world.speed + found.shift - world.v_ref)[mission.known]
    wear = np.abs(np.diff(found.u, axis=0)).mean() / world.dt
    return float(error.mean() + WEAR_S * wear) if error.size and np.isfinite(error).all() else 1e3
