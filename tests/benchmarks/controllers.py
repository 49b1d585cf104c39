"""Gains of the controller classes: tuned on one healthy mission of the simulator, with 150 evaluations each.

    python tests/benchmarks/controllers.py                 # tune all, print gains and costs
    python tests/benchmarks/controllers.py fuzzy neural    # some of them

Cost: mean |v_a − v_c| over the wheels [m/s] + 3e-5 s · total variation of u per second, on the first 130 s of the paper's drive
without faults or ice (seed 1), averaged over two plants: the default one, and one whose spools lag by 0.05 s, without which
the tuned loops ring. Nelder and Mead's simplex over the logarithms of the gains, from the defaults in the code.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.optimize import minimize

from replay.controllers.choice import CONTROLLER_NAMES, Controller
from replay.simulation.options import SimulationOptions
from replay.simulation.plant_options import PlantOptions
from replay.simulation.run import simulate_mission

EVALUATIONS, SEED, DURATION_S, RATE_HZ = 150, 1, 130.0, 250.0
WEAR_S = 3e-5
PLANTS = (PlantOptions(), PlantOptions(valve_lag=0.05))
FREE = {"mfhca": ("zeta",)}  # the paper gives MFHCA's own parameters


def cost(controller: Controller) -> float:
    """Tracking error with what the valves wear, on average over the plants."""
    return float(np.mean([_cost(controller, plant) for plant in PLANTS]))


def _cost(controller: Controller, plant: PlantOptions) -> float:
    options = SimulationOptions(
        scenario="paper",
        seed=SEED,
        duration_s=DURATION_S,
        rate_hz=RATE_HZ,
        faults=(),
        ice=0.0,
        plant=plant,
        controller=controller,
    )
    mission = simulate_mission(options)
    wheels = options.machine.wheels
    e = np.array([mission.actual[f"wheel.{w}.v"] - mission.actual[f"wheel.{w}.v_ref"] for w in wheels])
    u = np.array([mission.columns[f"wheel.{w}.u"] for w in wheels])
    # neighbouring recorded samples are independent in noise: their difference is that of neighbouring control steps
    wear = np.abs(np.diff(u, axis=1)).mean() * 1000.0
    return float(np.abs(e).mean() + WEAR_S * wear)


def tuned(name: str) -> tuple[dict[str, float], float, float]:
    """Gains, cost with the defaults, and cost with the gains."""
    start = Controller(name, {"zeta": 2600.0} if name == "mfhca" else {})
    keys = FREE.get(name, tuple(start.own))
    bounds = start.kind.bounds

    def gains(x: np.ndarray) -> dict[str, float]:
        found = {k: float(np.exp(v)) for k, v in zip(keys, x, strict=True)}
        return {k: min(v, 0.999) if k in bounds else min(v, 1e6) for k, v in found.items()}

    first = np.log([max(start.own[k], 1e-6) for k in keys])
    simplex = np.vstack([first, first + 0.5 * np.eye(first.size)])
    done = minimize(
        lambda x: cost(Controller(name, gains(x))),
        first,
        method="Nelder-Mead",
        options={"maxfev": EVALUATIONS, "initial_simplex": simplex, "adaptive": True},
    )
    return gains(done.x), cost(start), float(done.fun)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=CONTROLLER_NAMES)
    for name in parser.parse_args().names:
        values, before, after = tuned(name)
        print(
            f"{name}: {before:.5f} -> {after:.5f}  " + ", ".join(f"{k}={v:.4g}" for k, v in values.items()), flush=True
        )
