"""Signals while faults are written into them, and the terms of L4 and L8 (7) at their samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from replay.errors import ConfigError
from replay.faults import FaultMode, FaultSpec
from replay.injection.checks import InjectionOptions
from replay.machine.config import Machine
from replay.signals.resolution import rounding_step
from replay.signals.signal import Signal

Array = NDArray[np.float64]

_TOLERANCE_S = 1e-9


class Draft:
    """Signals while faults are written into them."""

    def __init__(self, items: dict[str, Signal], machine: Machine, start: int, options: InjectionOptions) -> None:
        self.items, self.machine, self.start, self.options = items, machine, start, options
        self.clean = dict(items)
        self.notes: list[str] = []
        self._steps: dict[str, float] = {}

    def step(self, name: str) -> float:
        """Rounding step of a channel as recorded; 0 where its values lie on no grid. In the channel's unit."""
        if name not in self._steps:
            known = self.machine.noise.get(name)
            given = known.lsb if known is not None else None
            self._steps[name] = rounding_step(self.clean[name].values) if given is None else given
        return self._steps[name]

    def rounded(self, name: str, values: Array) -> Array:
        """Values on the channel's own grid, which runs through a recorded value. Both of shape (n,)."""
        step, recorded = self.step(name), self.clean[name].values
        if step <= 0.0:
            return values
        anchor = float(recorded[np.isfinite(recorded)][0])
        anchor -= float(np.round(anchor / step)) * step
        return np.asarray(anchor + np.round((values - anchor) / step) * step + 0.0, np.float64)

    def time(self, name: str) -> Array:
        """Mission time of each sample [s]. Shape (n,)."""
        return np.asarray((self.items[name].stamps - self.start) * 1e-9, np.float64)


def strength(fault: FaultSpec, t: Array) -> Array:
    """ε at each time: 0 outside the fault, growing over its ramp. Both of shape (n,), times in s."""
    active = (t >= fault.start_s - _TOLERANCE_S) & (t < fault.stop_s - _TOLERANCE_S)
    grown = np.ones(t.size) if fault.ramp_s == 0.0 else np.clip((t - fault.start_s) / fault.ramp_s, 0.0, 1.0)
    return np.where(active, fault.epsilon * grown, 0.0)


def varying(fault: FaultSpec, t: Array, rng: np.random.Generator) -> Array:
    """Varying part of the saturation term at each time: white, or first-order with the fault's correlation time.

    Both of shape (n,), times in s, the term in the channel's unit.
    """
    if fault.sat_std == 0.0 or t.size == 0:
        return np.zeros(t.size)
    if fault.sat_tau_s == 0.0:
        return np.asarray(fault.sat_std * rng.standard_normal(t.size), np.float64)
    steps = np.diff(t)
    dt = float(np.median(steps)) if steps.size else fault.sat_tau_s
    dt = max(dt, 1e-4 * fault.sat_tau_s)
    row = np.round((t - t[0]) / dt).astype(np.int64)
    a = float(np.exp(-dt / fault.sat_tau_s))
    white = rng.standard_normal(int(row[-1]) + 1)
    white[1:] *= np.sqrt(1.0 - a * a)
    return np.asarray(fault.sat_std * lfilter([1.0], [1.0, -a], white)[row], np.float64)


def held_value(fault: FaultSpec, t: Array, values: Array) -> float:
    """Mean saturation term; for a part that stays where it was, its last value before the fault.

    `t` [s] and `values` of shape (n,), the term in the unit of the values.
    """
    if not np.isnan(fault.sat):
        return fault.sat
    known = np.flatnonzero(np.isfinite(values))
    before = known[t[known] < fault.start_s - _TOLERANCE_S]
    return float(values[before[-1] if before.size else known[0]])


def saturation(draft: Draft, fault: FaultSpec, name: str, rng: np.random.Generator) -> tuple[Array, Array, float]:
    """ε and saturation term at each sample of a channel, and the term's mean.

    Both of shape (n,), ε a fraction, the term in the channel's unit.

    Raises
    ------
    ConfigError
        Where no sample of the channel lies in the fault.
    """
    t, values = draft.time(name), draft.items[name].values
    epsilon = strength(fault, t)
    active = epsilon > 0.0
    if not active.any():
        raise ConfigError(
            f"{fault.side} fault of {fault.component}: {name} has no sample from {fault.start_s:g} to {fault.stop_s:g} s"
        )
    mean = held_value(fault, t, values)
    if fault.mode is FaultMode.STUCK and abs(mean) < draft.machine.limits.min_sat:
        draft.notes.append(
            f"{name} is stuck at {mean:.3g} from {fault.start_s:g} s, which counts as no signal (limits.min_sat = "
            f"{draft.machine.limits.min_sat:g})"
        )
    sat = np.full(t.size, mean)
    sat[active] += varying(fault, t[active], rng)
    return epsilon, sat, mean
