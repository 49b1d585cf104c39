"""Which faults a scenario injects, and when."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from replay.faults import TABLE_MODES, FaultMode, FaultSpec, Side
from replay.simulation.duty import Duty
from replay.simulation.options import SIMULATED_AXLES, SimulationOptions

_NEVER_STOPPED = 0.12  # a fault begins where the machine drives at least this fast [m/s]


def faults_of(options: SimulationOptions, duty: Duty, rng: np.random.Generator) -> tuple[FaultSpec, ...]:
    """Faults to inject, by start: the given ones, or those of the scenario."""
    if options.faults is not None:
        faults = list(options.faults)
    elif options.scenario == "paper":
        faults = _paper_faults(options, duty, rng)
    elif options.scenario == "random":
        faults = _random_faults(options, duty, rng)
    else:
        faults = []
    return tuple(sorted(faults, key=lambda f: (f.start_s, f.component, f.side.value)))


def varied_onsets(
    options: SimulationOptions, faults: tuple[FaultSpec, ...], rng: np.random.Generator
) -> tuple[FaultSpec, ...]:
    """The scenario's faults, some of them growing, and more from the first sample on; given faults stay as they are."""
    if options.faults is not None or options.scenario == "healthy":
        return faults
    out = []
    for fault in faults:
        longest = min(options.ramp_max_s, 0.6 * (fault.stop_s - fault.start_s))
        ramp = round(float(rng.uniform(0.5, max(longest, 0.6))), 3)
        out.append(replace(fault, ramp_s=ramp) if rng.random() < options.ramp_share else fault)
    for wheel in options.machine.wheels:
        first = min([f.start_s for f in faults if f.component == wheel], default=options.duration_s)
        if rng.random() >= options.early_share or first < 6.0:
            continue
        side = Side.SENSOR if rng.random() < 0.5 else Side.ACTUATOR
        mode, stop = TABLE_MODES[int(rng.integers(4))], float(rng.uniform(4.0, min(first - 2.0, 20.0)))
        early = draw_fault(wheel, side, mode, 0.0, stop, rng, steer=False)
        if not np.isnan(early.sat):  # a part that has not moved yet has no value to hold
            out.append(early)
    return tuple(sorted(out, key=lambda f: (f.start_s, f.component, f.side.value)))


def draw_fault(
    component: str, side: Side, mode: FaultMode, start_s: float, stop_s: float, rng: np.random.Generator, *, steer: bool
) -> FaultSpec:
    """One fault of a table row with a random severity.

    Stuck sensors hold their value at onset or jump to another one; stuck valves stand open either way; noise and
    disturbances vary about a mean.
    """
    epsilon, sat, std, tau = 1.0, 0.0, 0.0, 0.0
    sign = float(rng.choice([-1.0, 1.0]))
    if mode is FaultMode.STUCK:
        if side is Side.SENSOR:
            level = float(rng.uniform(0.08, 0.4) if steer else rng.uniform(0.05, 0.35))
            sat = sign * level if rng.random() < 0.5 else float("nan")
        else:
            sat = sign * float(rng.uniform(0.04, 0.14))
    elif mode is FaultMode.INEFFICIENT:
        epsilon = float(rng.uniform(0.25, 0.75))
    elif mode is FaultMode.NOISY and side is Side.SENSOR:
        epsilon = float(rng.uniform(0.25, 0.5))
        sat = sign * float(rng.uniform(0.0, 0.1))
        std, tau = float(rng.uniform(0.06, 0.2)), float(rng.choice([0.0, 0.05]))
    elif mode is FaultMode.NOISY:
        epsilon = float(rng.uniform(0.3, 0.5))
        sat = sign * float(rng.uniform(0.05, 0.12))
        std, tau = float(rng.uniform(0.05, 0.12)), 0.8
    return FaultSpec(component, side, mode, round(start_s, 3), round(stop_s, 3), epsilon, sat, std, tau)


def _paper_faults(options: SimulationOptions, duty: Duty, rng: np.random.Generator) -> list[FaultSpec]:
    """The FR sensor stuck at 30, 100 and 200 s, and every row of both tables on each wheel between 50 and 235 s."""
    faults = []
    first = options.machine.wheels[0]
    for start in (30.0, 100.0, 200.0):
        stop = min(start + float(rng.uniform(5.0, 8.0)), options.duration_s)
        if start < options.duration_s:
            faults.append(FaultSpec(first, Side.SENSOR, FaultMode.STUCK, start, round(stop, 3), 1.0, float("nan")))
    end = min(235.0, options.duration_s - 1.0)
    for wheel in options.machine.wheels:
        busy = [(f.start_s, f.stop_s, f.side) for f in faults if f.component == wheel]
        wanted = [(s, m) for s in (Side.SENSOR, Side.ACTUATOR) for m in TABLE_MODES]
        wanted = [w for w in wanted if not (busy and w == (Side.SENSOR, FaultMode.STUCK))]
        for number, j in enumerate(rng.permutation(len(wanted))):
            side, mode = wanted[j]
            # One fault in four may overlap one of the wheel's other side.
            place = free_place(duty, busy, side, 50.0, end, number % 4 == 3, rng)
            if place is not None:
                faults.append(draw_fault(wheel, side, mode, *place, rng, steer=False))
                busy.append((*place, side))
    return faults


class Drive(Protocol):
    """How a machine is driven."""

    def command(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Commands at times t [s], shape (n, k); the first is the speed [m/s]."""


def free_place(
    duty: Drive,
    busy: list[tuple[float, float, Side]],
    side: Side,
    begin: float,
    end: float,
    overlap: bool,
    rng: np.random.Generator,
) -> tuple[float, float] | None:
    """Interval of 3–12 s within begin…end [s] that starts in motion and keeps 1.5 s from the part's other faults."""
    for attempt in range(400):
        length = float(rng.uniform(3.0, 12.0)) * (1.0 if attempt < 200 else 0.5)
        if end - begin < length:
            return None
        start = float(rng.uniform(begin, end - length))
        apart = all(
            start > b + 1.5 or start + length < a - 1.5 or (overlap and other is not side) for a, b, other in busy
        )
        if apart and _drives(duty, start, start + length):
            return start, start + length
    return None


def _drives(duty: Drive, start: float, stop: float) -> bool:
    """Whether the machine moves when the fault begins and for most of its time."""
    speed = np.abs(duty.command(np.linspace(start, stop, 40))[:, 0])
    return bool(speed[0] > _NEVER_STOPPED and np.mean(speed > 0.05) > 0.8)


def _random_faults(options: SimulationOptions, duty: Duty, rng: np.random.Generator) -> list[FaultSpec]:
    """On each part one fault after another, pauses of 4–15 s between them, one in seven on both sides at once."""
    faults: list[FaultSpec] = []
    parts = options.machine.wheels + (SIMULATED_AXLES if options.steering_faults else ())
    quiet = min(20.0, 0.2 * options.duration_s)
    for part in parts:
        steer = part in SIMULATED_AXLES
        t = quiet + float(rng.uniform(0.0, 10.0))
        while t < options.duration_s - 4.0:
            stop = min(t + float(rng.uniform(4.0, 14.0)), options.duration_s - 0.5)
            t = _wait_for_motion(duty, t, options.duration_s)
            if t + 3.0 > stop:
                t = stop + 1.0
                continue
            both = rng.random() < 1 / 7
            sides = (Side.SENSOR, Side.ACTUATOR) if both else (Side.SENSOR if rng.random() < 0.5 else Side.ACTUATOR,)
            for side in sides:
                mode = TABLE_MODES[int(rng.integers(4))]
                late = float(rng.uniform(0.5, 2.0)) if both and side is Side.ACTUATOR else 0.0
                faults.append(draw_fault(part, side, mode, t + late, stop, rng, steer=steer))
            t = stop + float(rng.uniform(4.0, 15.0))
    return faults


def _wait_for_motion(duty: Duty, t: float, end: float) -> float:
    grid: NDArray[np.float64] = np.arange(t, end, 0.25)
    moving = np.abs(duty.command(grid)[:, 0]) > _NEVER_STOPPED
    return float(grid[np.argmax(moving)]) if moving.any() else end
