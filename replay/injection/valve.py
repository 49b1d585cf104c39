"""A valve's fault, L8 (7): on its measured position, and on the recorded speed by a linear wheel model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from replay.faults import FaultSpec, fault_affected
from replay.injection.checks import measured_name
from replay.injection.edited_signals import Draft, held_value, saturation, strength, varying
from replay.machine.config import WheelPlant
from replay.signals.resolution import white_noise
from replay.signals.timeline import median_period

Array = NDArray[np.float64]

_QUIET = 0.1  # quantile over windows that stands for a valve at rest


def inject_valve(draft: Draft, fault: FaultSpec, rng: np.random.Generator) -> float:
    """L8 (7) on the measured position, whose sensor keeps its noise, and on the speed where a wheel model is used.

    Gives the mean saturation term as a fraction of full opening [1].
    """
    name = measured_name(fault.component, fault.side, draft.machine)
    plant = draft.machine.plant.wheels.get(fault.component) if draft.options.plant else None
    mean = fault.sat
    seeds = rng.integers(2**63, size=2)
    if name in draft.items:
        signal = draft.items[name]
        epsilon, sat, mean = saturation(draft, fault, name, np.random.default_rng(seeds[0]))
        active = epsilon > 0.0
        values = signal.values.copy()
        lost = np.sqrt(1.0 - (1.0 - epsilon[active]) ** 2)
        noise = _position_noise(draft, name) * lost * rng.standard_normal(lost.size)
        values[active] = draft.rounded(name, fault_affected(values[active], epsilon[active], sat[active]) + noise)
        draft.items[name] = replace(signal, values=values)
    if plant is not None and fault.component in draft.machine.wheels:
        mean = _respond(draft, fault, plant, mean, np.random.default_rng(seeds[0]))
    return mean


def _position_noise(draft: Draft, name: str) -> float:
    """Noise of a valve's position sensor: the machine file's, else that of its quiet windows."""
    known = draft.machine.noise.get(name)
    if known is not None and known.std is not None:
        return known.std
    signal = draft.clean[name]
    period = median_period(signal.stamps) * 1e-9
    return float(np.nan_to_num(white_noise(signal.values, period, _QUIET))) if period > 0 else 0.0


def _respond(draft: Draft, fault: FaultSpec, plant: WheelPlant, mean: float, rng: np.random.Generator) -> float:
    """Add the wheel model's answer Δv = K·lowpass(u_v − u_a), beyond its dead zone, to the wheel's speed channels."""
    command = draft.items[f"wheel.{fault.component}.u"]
    t = draft.time(command.name)
    u = np.nan_to_num(command.values)
    epsilon = strength(fault, t)
    active = epsilon > 0.0
    if np.isnan(mean):
        mean = held_value(fault, t, command.values)
    sat = np.full(t.size, mean)
    sat[active] += varying(fault, t[active], rng)
    change = np.where(active, _opened(fault_affected(u, epsilon, sat), plant) - _opened(u, plant), 0.0)
    for leaf in ("v", "v_true"):
        name = f"wheel.{fault.component}.{leaf}"
        if name in draft.items:
            signal = draft.items[name]
            dt = max(median_period(signal.stamps), 1) * 1e-9
            row = np.round((signal.stamps - signal.stamps[0]) * 1e-9 / dt).astype(np.int64)
            grid = signal.stamps[0] + np.round(np.arange(int(row[-1]) + 1) * dt * 1e9).astype(np.int64)
            latest = np.searchsorted(command.stamps, grid, side="right") - 1
            drive = np.where(latest >= 0, change[np.maximum(latest, 0)], 0.0)
            a = float(np.exp(-dt / plant.tau))
            answer = plant.K * lfilter([0.0, 1.0 - a], [1.0, -a], drive)
            values = draft.rounded(name, signal.values + answer[row])
            values = np.where(answer[row] == 0.0, signal.values, values)
            draft.items[name] = replace(signal, values=values)
    return mean


def _opened(u: Array, plant: WheelPlant) -> Array:
    """Opening beyond the dead zone [fraction]."""
    return np.asarray(np.sign(u) * np.maximum(np.abs(u) - plant.dead, 0.0), np.float64)
