"""How much noise a healthy angle sensor may have: a fault that lasts the whole mission is no noise of its own.

A sensor's noise is found in its median window, and so a fault that fills more than half of the mission would become it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.steering.blocks import SensorNoise, SteeringBlocks, noise_of, noise_windows
from diagnosis.steering.inputs import AxleInputs
from replay.arrays.quantiles import quantile_of
from replay.machine.config import Machine

_SMALL, _LARGE = 0.01, 0.03  # of the end stop: up to the first it is a sensor's own, beyond the second it never is
_OTHERS = 4.0  # times the least noise of another axle's sensor
_TWO, _SPAN, _LEAST = (
    10.0,
    (0.2, 0.8),
    5,
)  # times the power, between these quantiles: two kinds, of so many windows each
_RATE_S, _QUICK = 0.5, 0.99  # over which rates are taken, and the quantile that tells what an axle is able to


def with_usual_noises(axles: Sequence[AxleInputs], machine: Machine) -> list[AxleInputs]:
    """Axles whose sensors have no more noise than a healthy one may have; what is stated in the machine file stays.

    Where a sensor has two kinds of windows, its own noise is that of the kind that is nearer to what the other axles'
    sensors have, and of a lone one the quieter. Readings that leave each other by less than the axle turns between them
    may be its motion, and stay.

    Parameters
    ----------
    axles : Sequence[AxleInputs]
        All axles.
    machine : Machine
        Its end stops and stated noises.
    """
    of = {a.name: a.noise.white for a in axles if a.blocks is not None}
    told = {a.name: _told(a, [x for n, x in of.items() if n != a.name], machine) for a in axles}
    of = {n: told[n].std for n in of}
    return [
        replace(a, noise=told[a.name] if a.blocks is None else _bounded(a, told[a.name], of, machine)) for a in axles
    ]


def _told(axle: AxleInputs, others: Sequence[float], machine: Machine) -> SensorNoise:
    """The noise of an axle's sensor, of one of two kinds of windows where it has two; powers of `others` [rad²]."""
    noise = axle.noise
    if axle.blocks is None or _stated(axle, machine):
        return noise
    powers, samples = noise_windows(axle.blocks)
    if powers.size < 2 * _LEAST:
        return noise
    low, high = quantile_of(np.log(powers), _SPAN)
    quiet = np.log(powers) < (low + high) / 2
    few = min(np.count_nonzero(quiet), np.count_nonzero(~quiet)) < _LEAST  # they tell no noise of their own
    if few or high - low < np.log(_TWO):
        return noise
    kinds = [noise_of(powers[part], samples, noise.step, noise.lsb, machine.max_steer) for part in (quiet, ~quiet)]
    if kinds[1].std < _able(axle.blocks):
        return noise
    if not others:
        return kinds[0]
    usual = np.log(min(others))
    return min(kinds, key=lambda kind: abs(float(np.log(kind.white)) - usual))


def _stated(axle: AxleInputs, machine: Machine) -> bool:
    """Whether the machine file says what noise an axle's sensor has."""
    known = machine.noise.get(axle.names[0])
    return known is not None and known.std is not None


def _bounded(axle: AxleInputs, noise: SensorNoise, of: Mapping[str, float], machine: Machine) -> SensorNoise:
    """A noise that is at most a few times that `of` other axles [rad], and a share of the way to the end stop."""
    if axle.blocks is None or _stated(axle, machine) or noise.std < _able(axle.blocks):
        return noise
    others = min((std for name, std in of.items() if name != axle.name), default=np.inf)
    most = min(max(_SMALL * machine.max_steer, _OTHERS * others), _LARGE * machine.max_steer)
    return noise if noise.std <= most else replace(noise, white=most**2 + noise.step)


def _able(blocks: SteeringBlocks) -> float:
    """How far the axle turns from reading to reading where it turns quickly [rad]."""
    known = np.flatnonzero(blocks.count > 0)
    reach = max(1, round(_RATE_S / blocks.dt))
    if known.size <= reach:
        return np.inf
    mean, at = blocks.mean[known], known * blocks.dt
    rates = np.abs(mean[reach:] - mean[:-reach]) / (at[reach:] - at[:-reach])
    between = float(at[-1] - at[0] + blocks.dt) / float(blocks.count[known].sum())
    return float(quantile_of(rates, _QUICK)) * between
