"""Whether the numbers of a machine file that scale all wheels alike, its wheel diameter above all, fit the body's own speed and the command."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from replay.machine.config import Machine
from replay.machine.units import known_unit
from replay.setup.by_the_body import gain_of
from replay.signals.signal import Signal
from replay.signals.timeline import Timeline

_STEP_S = 0.1
_MOST = 100_000  # moments that are looked at
#: What wheels are compared with: its name, in words, and the factor beyond which nothing but a wrong number explains it.
_BODIES = (("odom.v", "odometry", 1.15), ("gnss.speed", "the satellite receiver", 1.15), ("cmd.v", "the command", 1.8))
_ROTATIONS = ("rad/s", "rpm", "deg/s", "rev/s")
_TWICE = 0.12  # ln; how near a factor must be to 2 for a radius that was given for a diameter
#: Factors between units that are taken for each other, and which.
_UNITS = (
    (60 / (2 * np.pi), "rad/s read as rpm"),
    (2 * np.pi / 60, "rpm read as rad/s"),
    (180 / np.pi, "rad/s read as deg/s"),
    (np.pi / 180, "deg/s read as rad/s"),
    (3.6, "m/s read as km/h"),
    (1 / 3.6, "km/h read as m/s"),
)
_NEAR = 0.06  # ln
_KMH = (2.5, 4.6)  # times the fastest wheel: a top speed in km/h
_REACHED = 0.999  # quantile


def scale_doubts(line: Timeline, machine: Machine, wheels: dict[str, Signal]) -> tuple[str, ...]:
    """Sentences on a wheel diameter, gear ratio, unit or top speed that the mission contradicts; none where all fit.

    Parameters
    ----------
    line : Timeline
        The mission.
    machine : Machine
        Its lengths.
    wheels : dict[str, Signal]
        Speeds of the wheels as they were recorded, by canonical name.
    """
    step = max(1, round(_STEP_S / line.dt), line.size // _MOST)
    speeds = [np.asarray(line.signals[n][::step], dtype=np.float64) for n in wheels if n in line.signals]
    if not speeds or machine.speed_unit != "m/s":
        return ()
    turning = all(known_unit(s.origin.unit) in _ROTATIONS for s in wheels.values())
    return (*_scaled(line, machine, np.mean(speeds, axis=0), step, turning), *_top(machine, speeds))


def _scaled(line: Timeline, machine: Machine, mean: NDArray[np.float64], step: int, turning: bool) -> Iterator[str]:
    """The first thing that measures or commands the body and contradicts the scale of its wheels."""
    for name, what, most in _BODIES:
        body = line.signals.get(name)
        if body is None:
            continue
        own, there = mean, np.asarray(body[::step], dtype=np.float64)
        if name == "gnss.speed":  # of satellites it has no sign, of a radar one
            own, there = np.abs(own), np.abs(there)
        factor = gain_of(own, there, line.dt * step)
        if factor is None or factor <= 0.0:
            continue
        if 1 / most <= factor <= most:
            if name != "cmd.v":
                return
            continue
        fits = "is the unit or gain of wheel.*.v right?"
        if turning and machine.geometry is not None:
            diameter = machine.geometry.wheel_diameter
            radius = " (is it the radius?)" if abs(np.log(factor / 2)) < _TWICE else ""
            fits = (
                f"is wheel_diameter = {diameter:g}{radius}, gear_ratio = {machine.gear_ratio:g} or the unit of wheel.*.v right? "
                f"A wheel of {diameter * factor:.3g} m would fit"
            )
        if unit := next((words for k, words in _UNITS if abs(np.log(factor / k)) < _NEAR), ""):
            fits = f"is the unit of wheel.*.v right ({unit}?)"
        yield f"by {what} the machine is {factor:.3g} times as fast as by its wheels throughout: {fits}"
        return


def _top(machine: Machine, speeds: list[NDArray[np.float64]]) -> Iterator[str]:
    """A top speed that is none of these wheels'."""
    fastest = max(float(np.nanquantile(np.abs(v), _REACHED)) for v in speeds if np.isfinite(v).any()) if speeds else 0.0
    top = machine.max_speed
    if "max_speed" in machine.assumed or fastest <= 0.0:
        return
    if _KMH[0] < top / fastest < _KMH[1]:
        yield f"max_speed = {top:g} m/s, and no wheel is faster than {fastest:.3g} m/s: is it in km/h? That would be max_speed = {top / 3.6:.3g}"
    elif fastest > 1.1 * top:
        yield f"max_speed = {top:g} m/s is that of the rim of a wheel, and one reaches {fastest:.3g} m/s: write max_speed = {np.ceil(10 * fastest) / 10:g}"
