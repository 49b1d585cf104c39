"""Write faults into recorded signals: L4 into a sensor's channel, L8 (7) into a valve's measured position.

The recorded controller never met these faults: the signals are open-loop from then on, and say so
(`Signals.open_loop`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.faults import FaultMode, FaultSpec, Side, fault_affected
from replay.injection.checks import InjectionOptions, check_faults, measured_name, mission_span
from replay.injection.edited_signals import Draft, saturation
from replay.injection.valve import inject_valve
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.signals.signal import Signal, Signals
from replay.truth import TruthInterval

__all__ = ["InjectionOptions", "inject_signals"]

Array = NDArray[np.float64]

_PAPER_SPEED = 0.36
# Noise of the simulator's second sensors, as a share of the paper's top speed, and in rad.
_SECOND_SPEED_SHARE, _SECOND_ANGLE_STD = 0.002 / _PAPER_SPEED, 0.001


def inject_signals(
    signals: Signals,
    faults: Sequence[FaultSpec],
    machine: Machine,
    seed: int = 0,
    options: InjectionOptions | None = None,
) -> tuple[Signals, tuple[TruthInterval, ...]]:
    """Write faults into recorded signals.

    Parameters
    ----------
    signals : Signals
        As recorded; left as they are.
    faults : Sequence[FaultSpec]
        Faults in mission time [s from the first wheel sample].
    machine : Machine
        Wheels, axles, noise, and with `InjectionOptions.plant` the wheel models.
    seed : int
        Of the varying saturation terms and second sensors; the same seed gives the same numbers.
    options : InjectionOptions or None
        How; None: the defaults.

    Returns
    -------
    tuple[Signals, tuple[TruthInterval, ...]]
        Faulty signals marked `open_loop` (unless there are no faults), and the faults by start.

    Raises
    ------
    ConfigError
        Where a fault names no part of the machine, a channel that is not logged, or a time beyond the mission, two
        faults of one part and side overlap, or a valve's fault cannot be expressed in this log.
    """
    chosen = options or InjectionOptions()
    start, stop = mission_span(signals)
    ordered = sorted(faults, key=lambda f: (f.start_s, f.component, f.side.value))
    length = (stop - start) * 1e-9
    check_faults(ordered, machine, signals, length, chosen)
    draft = Draft(dict(signals.items), machine, start, chosen)
    generators = np.random.default_rng(seed).spawn(len(ordered) + 1)
    # Valves first: a sensor's fault acts on the speed that the valve's fault leaves.
    sats = dict.fromkeys(range(len(ordered)), 0.0)
    for side in (Side.ACTUATOR, Side.SENSOR):
        if side is Side.SENSOR and chosen.keep_true:
            _add_second_sensors(draft, generators[-1])
        for i, fault in enumerate(ordered):
            if fault.side is side:
                inject = _inject_sensor if side is Side.SENSOR else inject_valve
                sats[i] = inject(draft, fault, generators[i])
    truth = tuple(_interval(f, machine, sats[i], length) for i, f in enumerate(ordered))
    notes = tuple(dict.fromkeys((*signals.notes, *draft.notes)))
    marked = replace(signals, items=draft.items, notes=notes, open_loop=signals.open_loop or bool(ordered))
    return marked, truth


def _inject_sensor(draft: Draft, fault: FaultSpec, rng: np.random.Generator) -> float:
    """L4: y = Q[(1 − ε)·v + ε·v_sat]; a stuck or silent sensor has no noise left."""
    name = measured_name(fault.component, fault.side, draft.machine)
    signal = draft.items[name]
    epsilon, sat, mean = saturation(draft, fault, name, rng)
    active = epsilon > 0.0
    values = signal.values.copy()
    values[active] = draft.rounded(name, fault_affected(values[active], epsilon[active], sat[active]))
    stamps, dead = signal.stamps, (epsilon == 1.0) & (fault.mode is FaultMode.NO_SIGNAL)
    values[dead] = 0.0 if draft.options.silent == "zero" else np.nan
    if draft.options.silent == "drop" and dead.any():
        stamps, values = stamps[~dead], values[~dead]
    draft.items[name] = replace(signal, stamps=stamps, values=values)
    return mean


def _add_second_sensors(draft: Draft, rng: np.random.Generator) -> None:
    """Keep each speed and steering channel as a second sensor with noise of its own, unless one was recorded."""
    machine, options = draft.machine, draft.options
    speed_std = options.second_speed_std
    speed_std = _SECOND_SPEED_SHARE * machine.max_speed if speed_std is None else speed_std
    angle_std = _SECOND_ANGLE_STD if options.second_angle_std is None else options.second_angle_std
    pairs = [(f"wheel.{w}.v", f"wheel.{w}.v_true", speed_std) for w in machine.wheels]
    pairs += [(f"steer.{a}.phi", f"steer.{a}.phi_true", angle_std) for a in machine.axles]
    for first, second, std in pairs:
        if first not in draft.items or second in draft.items:
            continue
        signal = draft.items[first]
        values = signal.values + std * rng.standard_normal(signal.values.size)
        if std > 0.0:
            values = np.round(values / (std / 2)) * (std / 2)
        origin = SignalSource(column=second)
        draft.items[second] = Signal(second, signal.stamps, values, origin, signal.source, False)


def _interval(fault: FaultSpec, machine: Machine, sat: float, length: float) -> TruthInterval:
    return TruthInterval.of(fault, "wheel" if fault.component in machine.wheels else "steer", sat, length)
