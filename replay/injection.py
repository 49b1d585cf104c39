"""Write faults into recorded signals: L4 into a sensor's channel, L8 (7) into a valve's measured position.

The recorded controller never met these faults: the signals are open-loop from then on, and say so
(`Signals.open_loop`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from replay.checks import check_range
from replay.errors import ConfigError
from replay.faults import FaultMode, FaultSpec, Side, fault_affected
from replay.machine import Machine, WheelPlant
from replay.resolution import rounding_step, white_noise
from replay.signals import Signal, Signals
from replay.sources import SignalSource
from replay.timeline import median_period
from replay.truth import TruthInterval

Array = NDArray[np.float64]

_PAPER_SPEED = 0.36
# Noise of the simulator's second sensors, as a share of the paper's top speed, and in rad.
_SECOND_SPEED_SHARE, _SECOND_ANGLE_STD = 0.002 / _PAPER_SPEED, 0.001
_QUIET = 0.1  # quantile over windows that stands for a valve at rest
_TOLERANCE_S = 1e-9


@dataclass(frozen=True)
class InjectionOptions:
    """How faults are written into signals.

    Attributes
    ----------
    silent : str
        What a sensor without signal logs: ``zero``, ``nan``, or ``drop`` (no sample).
    keep_true : bool
        Whether every speed and steering channel is also kept as a second sensor (``v_true``, ``phi_true``), with
        noise of its own. A second sensor that was recorded stays as it was.
    second_speed_std, second_angle_std : float or None
        Noise of that second sensor [m/s], [rad]; None: 0.6 % of the top speed, 1 mrad.
    plant : bool
        Whether a valve's fault also changes the recorded speed, by the linear wheel model of the machine file.
    """

    silent: Literal["zero", "nan", "drop"] = "zero"
    keep_true: bool = False
    second_speed_std: float | None = None
    second_angle_std: float | None = None
    plant: bool = False

    def __post_init__(self) -> None:
        """Check values."""
        if self.silent not in ("zero", "nan", "drop"):
            raise ConfigError(f"silent = {self.silent!r} is not known; expected zero, nan or drop")
        for name, value in (("speed", self.second_speed_std), ("angle", self.second_angle_std)):
            if value is not None:
                check_range(f"noise of the second {name} sensor", value, 0.0, 1e6, "m/s or rad")


def mission_span(signals: Signals) -> tuple[int, int]:
    """First and last stamp of the wheels' signals [ns]: mission time counts from the first.

    Raises
    ------
    ConfigError
        Where no wheel signal has two samples.
    """
    ends = [
        (s.stamps[0], s.stamps[-1]) for n, s in signals.items.items() if n.startswith("wheel.") and s.stamps.size > 1
    ]
    if not ends:
        raise ConfigError(
            "no wheel signal with at least two samples was found, so there is nothing to inject into; run `mfhca "
            "channels` to see how signals map"
        )
    return int(min(a for a, _ in ends)), int(max(b for _, b in ends))


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
    for fault in ordered:
        _check(fault, machine, signals, (stop - start) * 1e-9, chosen)
    _check_overlap(ordered)
    draft = _Draft(dict(signals.items), machine, start, chosen)
    generators = np.random.default_rng(seed).spawn(len(ordered) + 1)
    # Valves first: a sensor's fault acts on the speed that the valve's fault leaves.
    sats = dict.fromkeys(range(len(ordered)), 0.0)
    for side in (Side.ACTUATOR, Side.SENSOR):
        if side is Side.SENSOR and chosen.keep_true:
            _add_second_sensors(draft, generators[-1])
        for i, fault in enumerate(ordered):
            if fault.side is side:
                inject = _inject_sensor if side is Side.SENSOR else _inject_actuator
                sats[i] = inject(draft, fault, generators[i])
    length = (stop - start) * 1e-9
    truth = tuple(_interval(f, machine, sats[i], length) for i, f in enumerate(ordered))
    notes = tuple(dict.fromkeys((*signals.notes, *draft.notes)))
    marked = replace(signals, items=draft.items, notes=notes, open_loop=signals.open_loop or bool(ordered))
    return marked, truth


class _Draft:
    """Signals while faults are written into them."""

    def __init__(self, items: dict[str, Signal], machine: Machine, start: int, options: InjectionOptions) -> None:
        self.items, self.machine, self.start, self.options = items, machine, start, options
        self.clean = dict(items)
        self.notes: list[str] = []
        self._steps: dict[str, float] = {}

    def step(self, name: str) -> float:
        """Rounding step of a channel as recorded; 0 where its values lie on no grid."""
        if name not in self._steps:
            known = self.machine.noise.get(name)
            given = known.lsb if known is not None else None
            self._steps[name] = rounding_step(self.clean[name].values) if given is None else given
        return self._steps[name]

    def rounded(self, name: str, values: Array) -> Array:
        """Values on the channel's own grid, which runs through a recorded value."""
        step, recorded = self.step(name), self.clean[name].values
        if step <= 0.0:
            return values
        anchor = float(recorded[np.isfinite(recorded)][0])
        anchor -= float(np.round(anchor / step)) * step
        return np.asarray(anchor + np.round((values - anchor) / step) * step + 0.0, np.float64)

    def time(self, name: str) -> Array:
        """Mission time of each sample [s]."""
        return np.asarray((self.items[name].stamps - self.start) * 1e-9, np.float64)


def measured_name(component: str, side: Side, machine: Machine) -> str:
    """Channel that a fault of a part and side is written into."""
    if component in machine.axles and component not in machine.wheels:
        return f"steer.{component}.{'phi' if side is Side.SENSOR else 'u_applied'}"
    return f"wheel.{component}.{'v' if side is Side.SENSOR else 'u_applied'}"


def _check(fault: FaultSpec, machine: Machine, signals: Signals, length: float, options: InjectionOptions) -> None:
    """Raise where a fault cannot be written into these signals."""
    who = f"{fault.side} fault of {fault.component}"
    parts = (*machine.wheels, *(a for a in machine.axles if a not in machine.wheels))
    if fault.component not in parts:
        raise ConfigError(f"{who}: no such part; expected one of {', '.join(parts)}")
    if fault.side is Side.SENSOR_OR_ACTUATOR:
        raise ConfigError(f"{who}: side must be sensor or actuator")
    if fault.mode is FaultMode.OUTSIDE_TABLE:
        raise ConfigError(f"{who}: mode must be a row of the tables")
    if not 0.0 <= fault.start_s < fault.stop_s:
        raise ConfigError(f"{who}: {fault.start_s:g} to {fault.stop_s:g} s is no interval; start must be before stop")
    if fault.start_s >= length:
        raise ConfigError(f"{who}: starts at {fault.start_s:g} s, the log lasts {length:.3f} s")
    check_range(f"{who}: epsilon", fault.epsilon, 0.0, 1.0, "")
    check_range(f"{who}: sat_std", fault.sat_std, 0.0, 1e6, "")
    check_range(f"{who}: sat_tau_s", fault.sat_tau_s, 0.0, 1e6, "s")
    check_range(f"{who}: ramp_s", fault.ramp_s, 0.0, fault.stop_s - fault.start_s, "s, at most its length")
    name = measured_name(fault.component, fault.side, machine)
    if fault.side is Side.SENSOR:
        _need(who, name, signals)
        return
    wheel = fault.component in machine.wheels
    if name not in signals.items and not (options.plant and wheel):
        also = "; or let the recorded speed answer by the machine file's wheel model with --plant" if wheel else ""
        raise ConfigError(
            f"{who}: the valve's position {name} is not logged, and the recorded speed did not answer to the fault, so "
            f"it cannot be written into this log{also}"
        )
    if options.plant and wheel:
        _need(who, f"wheel.{fault.component}.u", signals)
        _need(who, f"wheel.{fault.component}.v", signals)
        if fault.component not in machine.plant.wheels:
            raise ConfigError(
                f"{who}: --plant needs K and tau of wheel {fault.component}; give them in the machine file's "
                f"[plant.{fault.component}]"
            )


def _need(who: str, name: str, signals: Signals) -> None:
    found = signals.items.get(name)
    if found is None or not np.isfinite(found.values).any():
        reason = signals.missing.get(name, "no sample of it is a number")
        raise ConfigError(f"{who}: {name} is not in the log ({reason}); name it in the machine file's [signals]")


def _check_overlap(faults: Sequence[FaultSpec]) -> None:
    ordered = sorted(faults, key=lambda f: (f.component, f.side.value, f.start_s))
    for a, b in pairwise(ordered):
        if (a.component, a.side) == (b.component, b.side) and b.start_s < a.stop_s:
            raise ConfigError(
                f"two {a.side} faults of {a.component} overlap at {b.start_s:g} s; let one end before the next begins"
            )


def _strength(fault: FaultSpec, t: Array) -> Array:
    """ε at each time: 0 outside the fault, growing over its ramp."""
    active = (t >= fault.start_s - _TOLERANCE_S) & (t < fault.stop_s - _TOLERANCE_S)
    grown = np.ones(t.size) if fault.ramp_s == 0.0 else np.clip((t - fault.start_s) / fault.ramp_s, 0.0, 1.0)
    return np.where(active, fault.epsilon * grown, 0.0)


def _varying(fault: FaultSpec, t: Array, rng: np.random.Generator) -> Array:
    """Varying part of the saturation term at each time: white, or first-order with the fault's correlation time."""
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


def _held(fault: FaultSpec, t: Array, values: Array) -> float:
    """Mean saturation term; for a part that stays where it was, its last value before the fault."""
    if not np.isnan(fault.sat):
        return fault.sat
    known = np.flatnonzero(np.isfinite(values))
    before = known[t[known] < fault.start_s - _TOLERANCE_S]
    return float(values[before[-1] if before.size else known[0]])


def _saturation(draft: _Draft, fault: FaultSpec, name: str, rng: np.random.Generator) -> tuple[Array, Array, float]:
    """ε and saturation term at each sample of a channel, and the term's mean."""
    t, values = draft.time(name), draft.items[name].values
    epsilon = _strength(fault, t)
    active = epsilon > 0.0
    if not active.any():
        raise ConfigError(
            f"{fault.side} fault of {fault.component}: {name} has no sample from {fault.start_s:g} to {fault.stop_s:g} s"
        )
    mean = _held(fault, t, values)
    if fault.mode is FaultMode.STUCK and abs(mean) < draft.machine.limits.min_sat:
        draft.notes.append(
            f"{name} is stuck at {mean:.3g} from {fault.start_s:g} s, which is as good as no signal (limits.min_sat = "
            f"{draft.machine.limits.min_sat:g})"
        )
    sat = np.full(t.size, mean)
    sat[active] += _varying(fault, t[active], rng)
    return epsilon, sat, mean


def _inject_sensor(draft: _Draft, fault: FaultSpec, rng: np.random.Generator) -> float:
    """L4: y = Q[(1 − ε)·v + ε·v_sat]; a stuck or silent sensor has no noise left."""
    name = measured_name(fault.component, fault.side, draft.machine)
    signal = draft.items[name]
    epsilon, sat, mean = _saturation(draft, fault, name, rng)
    active = epsilon > 0.0
    values = signal.values.copy()
    values[active] = draft.rounded(name, fault_affected(values[active], epsilon[active], sat[active]))
    stamps, dead = signal.stamps, (epsilon == 1.0) & (fault.mode is FaultMode.NO_SIGNAL)
    values[dead] = 0.0 if draft.options.silent == "zero" else np.nan
    if draft.options.silent == "drop" and dead.any():
        stamps, values = stamps[~dead], values[~dead]
    draft.items[name] = replace(signal, stamps=stamps, values=values)
    return mean


def _inject_actuator(draft: _Draft, fault: FaultSpec, rng: np.random.Generator) -> float:
    """L8 (7) on the measured position, whose sensor keeps its noise, and on the speed where a wheel model is used."""
    name = measured_name(fault.component, fault.side, draft.machine)
    plant = draft.machine.plant.wheels.get(fault.component) if draft.options.plant else None
    mean = fault.sat
    seeds = rng.integers(2**63, size=2)
    if name in draft.items:
        signal = draft.items[name]
        epsilon, sat, mean = _saturation(draft, fault, name, np.random.default_rng(seeds[0]))
        active = epsilon > 0.0
        values = signal.values.copy()
        lost = np.sqrt(1.0 - (1.0 - epsilon[active]) ** 2)
        noise = _position_noise(draft, name) * lost * rng.standard_normal(lost.size)
        values[active] = draft.rounded(name, fault_affected(values[active], epsilon[active], sat[active]) + noise)
        draft.items[name] = replace(signal, values=values)
    if plant is not None and fault.component in draft.machine.wheels:
        mean = _respond(draft, fault, plant, mean, np.random.default_rng(seeds[0]))
    return mean


def _position_noise(draft: _Draft, name: str) -> float:
    """Noise of a valve's position sensor: the machine file's, else that of its quiet windows."""
    known = draft.machine.noise.get(name)
    if known is not None and known.std is not None:
        return known.std
    signal = draft.clean[name]
    period = median_period(signal.stamps) * 1e-9
    return float(np.nan_to_num(white_noise(signal.values, period, _QUIET))) if period > 0 else 0.0


def _respond(draft: _Draft, fault: FaultSpec, plant: WheelPlant, mean: float, rng: np.random.Generator) -> float:
    """Add the linear plant's answer Δv = K·lowpass(u_v − u_a) to the wheel's speed channels."""
    command = draft.items[f"wheel.{fault.component}.u"]
    t = draft.time(command.name)
    u = np.nan_to_num(command.values)
    epsilon = _strength(fault, t)
    active = epsilon > 0.0
    if np.isnan(mean):
        mean = _held(fault, t, command.values)
    sat = np.full(t.size, mean)
    sat[active] += _varying(fault, t[active], rng)
    change = np.where(active, fault_affected(u, epsilon, sat) - u, 0.0)
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


def _add_second_sensors(draft: _Draft, rng: np.random.Generator) -> None:
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
        draft.notes.append(f"{second} is the recorded {first} with the noise of a second sensor added")


def _interval(fault: FaultSpec, machine: Machine, sat: float, length: float) -> TruthInterval:
    kind = "wheel" if fault.component in machine.wheels else "steer"
    stop = min(fault.stop_s, length)
    return TruthInterval(
        fault.component,
        kind,
        fault.side,
        fault.mode,
        fault.start_s,
        stop,
        fault.epsilon,
        sat,
        fault.sat_std,
        fault.ramp_s,
    )
