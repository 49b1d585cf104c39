"""Monte Carlo over what is uncertain: gain and lag of each wheel, and ε̂ of each partial fault."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.counterfactual.abduct import Abducted, weighted
from diagnosis.counterfactual.document import BandRow
from diagnosis.counterfactual.law import Law
from replay.counterfactual.predict import predict
from replay.counterfactual.world import CoupledPlant, RecordedWorld

Array = NDArray[np.float64]

_STEP_S = 0.004  # of the draws; what they give is compared with the same step
_LEAST_K, _LEAST_TAU = 0.04, 0.1  # relative standard deviations where the machine file states none
_TO_STD = 1.0 / 3.92  # of the width of 95 % bounds
_TAILS = (5.0, 95.0)
#: Share of a prediction by which identified wheel models were off in nine of ten missions of simulated machines, whatever was drawn.
ERROR_OFF, EFFORT_OFF = 0.07, 0.05


@dataclass(frozen=True)
class Spread:
    """Relative standard deviations of each wheel's gain and lag, shape (wheels,)."""

    K: Array
    tau: Array


def spread_of(abducted: Abducted) -> Spread:
    """What the machine file or `fit` states, else what identification in one mission was found to be good for."""
    plants = [p for p in abducted.fit.plants if p is not None]
    K = [max(p.K_std / p.K, 0.0) if p.K_std else max(_LEAST_K, abducted.fit.spread) for p in plants]
    tau = [p.tau_std / p.tau if p.tau_std else _LEAST_TAU for p in plants]
    return Spread(np.array(K), np.array(tau))


def bands(
    abducted: Abducted, laws: Sequence[Law], u_max: float, count: int, seed: int = 1
) -> Iterator[tuple[Array, Array]]:
    """Changes of mean |e| and mean |u| from the nominal prediction in every draw.

    All laws meet the same draws.

    Yields
    ------
    tuple[Array, Array]
        Of each law in order: differences of the error [m/s] and of the effort [fraction], each of shape (count,).
    """
    stride = max(1, int(_STEP_S / abducted.world.dt))
    thin = thinned(abducted, stride)
    rng = np.random.default_rng([seed, count])
    spread = spread_of(abducted)
    drawn = [_drawn(thin, spread, rng) for _ in range(count)]
    for law in laws:
        nominal = _means(thin, thin.world, thin.plant, law, u_max)
        found = np.array([_means(thin, world, plant, law, u_max) for world, plant in drawn]).reshape(-1, 2)
        yield found[:, 0] - nominal[0], found[:, 1] - nominal[1]


def band(value: float | None, changes: Array, off: float) -> BandRow | None:
    """90 % of the draws around a value, and what the wheel models themselves may be off.

    Parameters
    ----------
    value : float or None
        Nominal prediction.
    changes : Array, shape (draws,)
        What the draws change in it.
    off : float
        Relative error of the models, `ERROR_OFF` or `EFFORT_OFF` [1].
    """
    if value is None or not changes.size:
        return None
    low, high = np.percentile(changes, _TAILS)
    model = off * value
    return {
        "low": max(0.0, value - float(np.hypot(min(low, 0.0), model))),
        "high": value + float(np.hypot(max(high, 0.0), model)),
    }


def thinned(abducted: Abducted, stride: int) -> Abducted:
    """The same mission with every `stride`-th sample; faults keep their samples' times."""
    if stride == 1:
        return abducted
    world = abducted.world
    columns = {k: v[::stride] for k, v in vars(world).items() if k != "dt"}
    faults = tuple(
        replace(f, finding=replace(f.finding, start=-(-f.finding.start // stride), stop=-(-f.finding.stop // stride)))
        for f in abducted.faults
    )
    return replace(
        abducted,
        world=RecordedWorld(dt=world.dt * stride, **columns),
        known=abducted.known[::stride],
        faulty=abducted.faulty[::stride],
        faults=faults,
    )


def _drawn(abducted: Abducted, spread: Spread, rng: np.random.Generator) -> tuple[RecordedWorld, CoupledPlant]:
    """World and plant of one draw."""
    wheels = spread.K.size
    # half of the gain's variance is common to all wheels: one pump, one oil
    common, own = rng.standard_normal(), rng.standard_normal(wheels)
    K = np.exp(spread.K * (common + own) / np.sqrt(2.0))
    tau = np.exp(spread.tau * (rng.standard_normal() + rng.standard_normal(wheels)) / np.sqrt(2.0))
    epsilon = {}
    for j, fault in enumerate(abducted.faults):
        size = fault.finding.epsilon
        if size is not None and not fault.finding.mode.total:
            width = max(size.high - size.low, 0.0) * _TO_STD
            epsilon[j] = float(np.clip(size.value + width * rng.standard_normal(), min(size.value, 0.0), 1.0))
    sensor, valve = weighted(abducted, epsilon)
    plant = abducted.plant
    return (
        replace(abducted.world, let_sensor=sensor, let_valve=valve),
        plant._replace(speeds=plant.speeds * K[:, None], tau=plant.tau * tau),
    )


def _means(
    abducted: Abducted, world: RecordedWorld, plant: CoupledPlant, law: Law, u_max: float
) -> tuple[float, float]:
    found = predict(world, plant, law.controller, u_max, law.psi0, longest_step=_STEP_S)
    error = np.abs(world.speed + found.shift - world.v_ref)[abducted.known]
    return float(error.mean()) if error.size else np.nan, float(np.abs(found.u).mean())
