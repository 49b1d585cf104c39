"""Ratios of logged signals to what commands and kinematics make of them, over missions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.control.kinematics import commands_by_angles, wheel_commands
from replay.control.law_fit import MIN_EXPLAINED
from replay.control.loop import Replay, stack
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]


def _ratio(x: Array | None, reference: Array | None) -> float:
    """Median of x over its reference where that is large; NaN where there is too little."""
    if x is None or reference is None:
        return float("nan")
    both = np.isfinite(x) & np.isfinite(reference)
    if np.count_nonzero(both) < 100:
        return float("nan")
    large = both & (np.abs(reference) > 0.3 * np.quantile(np.abs(reference[both]), 0.95))
    large &= reference != 0
    return float(np.median(x[large] / reference[large])) if np.count_nonzero(large) >= 50 else float("nan")


@dataclass(frozen=True)
class Ratios:
    """Signals over what they should be, medians over the missions."""

    speed: dict[str, float]  # wheel.<W>.v | v_true over the wheel's command
    command: dict[str, float]  # logged v_ref, phi_ref over what L1, L2 give
    angle: dict[str, float]  # steer.<A>.phi | phi_true over the axle's command
    effort: dict[str, float]  # wheel.<W>.u over the wheel's command
    top: dict[str, float]  # 99.5 % quantile of |x|
    gain: float  # λ̂ of the best reading of the law; NaN where none explains the commands


def measure(timelines: Sequence[Timeline], replays: Sequence[Replay], machine: Machine) -> Ratios:
    """Measure every ratio that the missions log.

    Parameters
    ----------
    timelines, replays : Sequence
        The aligned missions and their replayed loops.
    machine : Machine
        Geometry and readings.
    """
    parts: list[dict[str, dict[str, float]]] = []
    for t, r in zip(timelines, replays, strict=True):
        one: dict[str, dict[str, float]] = {"speed": {}, "command": {}, "angle": {}, "effort": {}, "top": {}}
        commands = _commands(t, r, machine)
        for i, w in enumerate(machine.wheels):
            for leaf in ("v", "v_true"):
                one["speed"][f"wheel.{w}.{leaf}"] = _ratio(t.get(f"wheel.{w}.{leaf}"), r.v_ref[:, i])
            for leaf in ("u", "u_applied"):
                one["effort"][f"wheel.{w}.{leaf}"] = _ratio(t.get(f"wheel.{w}.{leaf}"), r.v_ref[:, i])
            if commands is not None:
                one["command"][f"wheel.{w}.v_ref"] = _ratio(t.get(f"wheel.{w}.v_ref"), commands[0][:, i])
        for j, a in enumerate(machine.axles):
            for leaf in ("phi", "phi_true"):
                one["angle"][f"steer.{a}.{leaf}"] = _ratio(t.get(f"steer.{a}.{leaf}"), r.phi_ref[:, j])
            if commands is not None and commands[1] is not None:
                one["command"][f"steer.{a}.phi_ref"] = _ratio(t.get(f"steer.{a}.phi_ref"), commands[1][:, j])
        for name, x in t.signals.items():
            known = np.abs(x[np.isfinite(x)])
            one["top"][name] = float(np.quantile(known, 0.995)) if known.size else float("nan")
        parts.append(one)
    gains = [r.fits[0].lambda_ for r in replays if r.fits and r.fits[0].explained > MIN_EXPLAINED]
    gain = float(np.median(gains)) if gains else float("nan")
    return Ratios(**{kind: _medians([p[kind] for p in parts]) for kind in parts[0]}, gain=gain)


def _commands(t: Timeline, r: Replay, machine: Machine) -> tuple[Array, Array | None] | None:
    """Commanded speeds of the wheels [m/s] and angles of the axles [rad] that the body's command gives, (n, wheels), (n, axles).

    Without a commanded yaw rate the angles give the speeds, and nothing gives the angles. None without a command.
    """
    speed, omega = t.get("cmd.v"), t.get("cmd.omega")
    if machine.geometry is None or speed is None:
        return None
    if omega is None:
        phi = stack(t, [f"steer.{axle}.phi" for axle in machine.axles])
        return commands_by_angles(r.phi_ref, phi, speed, machine.geometry), None
    mapped = wheel_commands(
        speed,
        omega,
        machine.geometry,
        dt=t.dt,
        max_steer=machine.max_steer,
        phi_dot=machine.control.phi_dot,
        phi_dot_hz=machine.control.phi_dot_hz,
        measured_angle=r.wheel_phi,
    )
    return mapped.speed, mapped.axle_angle


def _medians(parts: list[dict[str, float]]) -> dict[str, float]:
    names = dict.fromkeys(n for p in parts for n in p)
    values = {n: np.array([p[n] for p in parts if np.isfinite(p.get(n, np.nan))]) for n in names}
    return {n: float(np.median(v)) for n, v in values.items() if v.size}
