"""Whether and where faults can be written into a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from replay.errors import ConfigError, check_range
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import Machine
from replay.signals.signal import Signals


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


def measured_name(component: str, side: Side, machine: Machine) -> str:
    """Channel that a fault of a part and side is written into."""
    if component in machine.axles:
        return f"steer.{component}.{'phi' if side is Side.SENSOR else 'u_applied'}"
    return f"wheel.{component}.{'v' if side is Side.SENSOR else 'u_applied'}"


def check_faults(
    faults: Sequence[FaultSpec], machine: Machine, signals: Signals, length: float, options: InjectionOptions
) -> None:
    """Raise a `ConfigError` where faults cannot be written into signals that last `length` [s]."""
    for fault in faults:
        _check(fault, machine, signals, length, options)
    ordered = sorted(faults, key=lambda f: (f.component, f.side.value, f.start_s))
    for a, b in pairwise(ordered):
        if (a.component, a.side) == (b.component, b.side) and b.start_s < a.stop_s:
            raise ConfigError(
                f"two {a.side} faults of {a.component} overlap at {b.start_s:g} s; let one end before the next begins"
            )


def _check(fault: FaultSpec, machine: Machine, signals: Signals, length: float, options: InjectionOptions) -> None:
    """Raise where a fault cannot be written into these signals."""
    who = f"{fault.side} fault of {fault.component}"
    parts = (*machine.wheels, *machine.axles)
    if fault.component not in parts:
        raise ConfigError(f"{who}: no such part; expected one of {', '.join(parts)}")
    if fault.side is Side.SENSOR_OR_ACTUATOR:
        raise ConfigError(f"{who}: side must be sensor or actuator")
    if fault.mode is FaultMode.OUTSIDE_TABLE:
        raise ConfigError(f"{who}: mode must be a row of the tables")
    if not 0.0 <= fault.start_s < fault.stop_s:
        raise ConfigError(
            f"{who}: {fault.start_s:g} to {fault.stop_s:g} s is not an interval; start must be before stop"
        )
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
    if fault.component in machine.unpowered:
        raise ConfigError(f"{who}: it has no drive (machine.unpowered)")
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
                f"{who}: --plant needs K and tau of wheel {fault.component}; give them in the machine file's [plant], or "
                "measure them with `mfhca fit`"
            )


def _need(who: str, name: str, signals: Signals) -> None:
    found = signals.items.get(name)
    if found is None or not np.isfinite(found.values).any():
        reason = signals.missing.get(name, "no sample of it is a number")
        raise ConfigError(f"{who}: {name} is not in the log ({reason}); name it in the machine file's [signals]")
