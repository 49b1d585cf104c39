"""Which faults a scenario injects, and when."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from replay.faults import FaultMode, FaultSpec, Range, Side, drawn_modes, table_row
from replay.simulation.duty import Duty
from replay.simulation.options import SIMULATED_AXLES, SimulationOptions

_BRIEF_S, _BRIEF_SHARE = 0.2, 0.3  # length of brief stuck sensors [s], and share of ε that is left of partial faults
_NEVER_STOPPED = 0.12  # a fault begins where the machine drives at least this fast [m/s]


def faults_of(options: SimulationOptions, duty: Duty, rng: np.random.Generator) -> tuple[FaultSpec, ...]:
    """Faults to inject, by start: the given ones, or those of the scenario."""
    if options.faults is not None:
        faults = list(options.faults)
    elif options.scenario == "paper":
        faults = _paper_faults(options, duty, rng)
    elif options.scenario == "brief":
        faults = _brief_faults(options, duty, rng)
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
        mode, stop = _draw_mode(side, rng), float(rng.uniform(4.0, min(first - 2.0, 20.0)))
        early = draw_fault(wheel, side, mode, 0.0, stop, rng, steer=False)
        if not np.isnan(early.sat):  # a part that has not moved yet has no value to hold
            out.append(early)
    return tuple(sorted(out, key=lambda f: (f.start_s, f.component, f.side.value)))


def draw_fault(
    component: str, side: Side, mode: FaultMode, start_s: float, stop_s: float, rng: np.random.Generator, *, steer: bool
) -> FaultSpec:
    """One fault of a table row with a random severity, by the row's `Drawn`.

    Stuck sensors hold their value at onset or jump to another one; stuck valves stand open either way; noise and
    disturbances vary about a mean.

    Times in s.

    Raises
    ------
    ValueError
        Where random faults are not of this row.
    """
    row = table_row(side, mode)
    if row is None or row.drawn is None:
        raise ValueError(f"no random faults are drawn of {side} {mode}")
    drawn = row.drawn
    sign = float(rng.choice([-1.0, 1.0]))
    epsilon = 1.0 if drawn.epsilon is None else _uniform(drawn.epsilon, rng)
    sat_range = drawn.steer_sat if steer and drawn.steer_sat is not None else drawn.sat
    sat = 0.0 if sat_range is None else sign * _uniform(sat_range, rng)
    if drawn.held_share and rng.random() >= 1.0 - drawn.held_share:
        sat = math.nan
    std = 0.0 if drawn.sat_std is None else _uniform(drawn.sat_std, rng)
    tau = drawn.sat_tau_s[0] if len(drawn.sat_tau_s) == 1 else float(rng.choice(drawn.sat_tau_s))
    return FaultSpec(component, side, mode, round(start_s, 3), round(stop_s, 3), epsilon, sat, std, tau)


def _uniform(between: Range, rng: np.random.Generator) -> float:
    return float(rng.uniform(*between))


def _draw_mode(side: Side, rng: np.random.Generator) -> FaultMode:
    """Mode of a random fault of one side, each as probable as the others."""
    modes = drawn_modes(side)
    return modes[int(rng.integers(len(modes)))]


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
        wanted = [(s, m) for s in (Side.SENSOR, Side.ACTUATOR) for m in drawn_modes(s)]
        wanted = [w for w in wanted if not (busy and w == (Side.SENSOR, FaultMode.STUCK))]
        for number, j in enumerate(rng.permutation(len(wanted))):
            side, mode = wanted[j]
            # One fault in four may overlap one of the wheel's other side.
            place = free_place(duty, busy, side, 50.0, end, number % 4 == 3, rng)
            if place is not None:
                faults.append(draw_fault(wheel, side, mode, *place, rng, steer=False))
                busy.append((*place, side))
    return faults


def _brief_faults(options: SimulationOptions, duty: Duty, rng: np.random.Generator) -> list[FaultSpec]:
    """The paper's faults as far as a machine may go on with them.

    By Assumption 1 a stuck or silent sensor is tolerable while it is brief, by Assumption 2 a stuck or silent valve stops the
    machine: so the FR sensor is stuck for 0.2 s at each of its three times, no other part is stuck or silent, and partial
    losses have three tenths of their ε.
    """
    first = options.machine.wheels[0]
    faults = []
    for fault in _paper_faults(options, duty, rng):
        if not fault.mode.total:
            faults.append(replace(fault, epsilon=_BRIEF_SHARE * fault.epsilon))
        elif (fault.component, fault.side, fault.mode) == (first, Side.SENSOR, FaultMode.STUCK):
            faults.append(replace(fault, stop_s=round(fault.start_s + _BRIEF_S, 3)))
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
                mode = _draw_mode(side, rng)
                late = float(rng.uniform(0.5, 2.0)) if both and side is Side.ACTUATOR else 0.0
                faults.append(draw_fault(part, side, mode, t + late, stop, rng, steer=steer))
            t = stop + float(rng.uniform(4.0, 15.0))
    return faults


def _wait_for_motion(duty: Duty, t: float, end: float) -> float:
    grid: NDArray[np.float64] = np.arange(t, end, 0.25)
    moving = np.abs(duty.command(grid)[:, 0]) > _NEVER_STOPPED
    return float(grid[np.argmax(moving)]) if moving.any() else end
