"""Faults for a whole recorded mission: drawn by the rows of the tables, injected, and written to a truth file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from replay.control.loop import replay_loop, stack
from replay.errors import ConfigError
from replay.faults import FaultMode, FaultSpec, Side, drawn_modes
from replay.injection.inject import InjectionOptions, inject_signals
from replay.machine.config import Machine
from replay.signals.signal import Signals
from replay.signals.timeline import Timeline, align
from replay.simulation.schedule import draw_fault, free_place
from replay.simulation.truths import spans_where
from replay.truth import MissionTruth, TruthSpan

Array = NDArray[np.float64]

_PAPER_SPEED = 0.36  # top speed for which `draw_fault` draws [m/s]
_PAPER_DRIVING = 0.05  # speed from which a machine drives for `free_place` [m/s]


def inject_mission(
    signals: Signals,
    faults: Sequence[FaultSpec],
    machine: Machine,
    seed: int = 0,
    options: InjectionOptions | None = None,
) -> tuple[Signals, MissionTruth]:
    """Write faults into a recorded mission; see `replay.injection.inject.inject_signals`.

    Parameters
    ----------
    signals : Signals
        As recorded.
    faults : Sequence[FaultSpec]
        Faults in mission time [s].
    machine : Machine
        The machine.
    seed : int
        Of what varies.
    options : InjectionOptions or None
        How; None: the defaults.

    Returns
    -------
    tuple[Signals, MissionTruth]
        Faulty signals, and what the truth file holds.

    Raises
    ------
    ConfigError
        Where a fault cannot be injected, or the recording already holds injected faults.
    LogError
        Where the signals do not make a mission.
    """
    if signals.open_loop:
        raise ConfigError(
            "faults were already injected into this recording, and its truth would be lost; inject all faults into the "
            "original at once"
        )
    timeline = align(signals)
    faulty, intervals = inject_signals(signals, faults, machine, seed, options)
    speed = _speeds(timeline, machine)
    driving = machine.limits.driving_speed
    rate = 1e9 / timeline.step_ns
    truth = MissionTruth(
        wheels=machine.wheels,
        rate_hz=rate,
        start_ns=timeline.start_ns,
        duration_s=timeline.size * timeline.dt,
        driving_speed=driving,
        intervals=intervals,
        masked=tuple(
            TruthSpan(i.component, i.start_s, i.stop_s) for i in intervals if i.side is Side.SENSOR and i.mode.total
        ),
        open_loop=True,
        driving=tuple(s for i, w in enumerate(machine.wheels) for s in spans_where(w, speed[:, i] > driving, rate)),
    )
    return faulty, truth


def _speeds(timeline: Timeline, machine: Machine) -> Array:
    """|v_c,i| as recorded or by L1, else |v_i| [m/s], shape (n, wheels); 0 where not known."""
    plain = replace(machine, control=replace(machine.control, law="none"))
    asked = replay_loop(timeline, plain).v_ref
    measured = stack(timeline, [f"wheel.{w}.v" for w in machine.wheels])
    return np.nan_to_num(np.abs(np.where(np.isfinite(asked).any(axis=0), asked, measured)))


@dataclass(frozen=True)
class _WheelDrive:
    """A wheel's speed over time, in shares of the driving speed: what `free_place` asks about."""

    speed: Array
    dt: float

    def command(self, t: Array) -> Array:
        """Speed at times t [s], shape (n, 1)."""
        rows = np.clip(np.round(t / self.dt).astype(np.int64), 0, self.speed.size - 1)
        return self.speed[rows][:, None]


def draw_faults(
    signals: Signals,
    machine: Machine,
    count: int,
    seed: int,
    *,
    epsilon: float | None = None,
    options: InjectionOptions | None = None,
    beside: Sequence[FaultSpec] = (),
) -> tuple[FaultSpec, ...]:
    """Draw faults of the wheels while they drive, row after row of the tables in random order.

    Parameters
    ----------
    signals : Signals
        As recorded; rows that this log cannot express are left out.
    machine : Machine
        Wheels and top speed, which scales the saturation terms.
    count : int
        Number of faults.
    seed : int
        The same seed gives the same faults.
    epsilon : float or None
        ε of inefficient and noisy faults; None: random.
    options : InjectionOptions or None
        Says whether valves' faults may act on the speed.
    beside : Sequence[FaultSpec]
        Faults that are there already and from which the drawn ones keep apart.

    Raises
    ------
    ConfigError
        Where the mission has no room for them.
    LogError
        Where the signals do not make a mission.
    """
    rng = np.random.default_rng([seed, 1])
    timeline = align(signals)
    speed = _speeds(timeline, machine) * (_PAPER_DRIVING / max(machine.limits.driving_speed, 1e-9))
    drives = {w: _WheelDrive(speed[:, i], timeline.dt) for i, w in enumerate(machine.wheels)}
    parts = {
        side: _parts(signals, machine, side, options or InjectionOptions()) for side in (Side.SENSOR, Side.ACTUATOR)
    }
    rows = [(side, mode) for side in parts if parts[side] for mode in drawn_modes(side)]
    faults: list[FaultSpec] = []
    while len(faults) < count:
        before = len(faults)
        for j in rng.permutation(len(rows)):
            side, mode = rows[j]
            drawn = _draw_one(side, mode, parts[side], drives, (*beside, *faults), rng) if len(faults) < count else None
            if drawn is not None:
                faults.append(_scaled(drawn, machine, epsilon))
        if len(faults) == before:
            raise ConfigError(
                f"the mission drives long enough for {before} of {count} faults of 3 to 12 s that keep apart; ask for "
                "fewer, or place them with --fault"
            )
    return tuple(sorted(faults, key=lambda f: (f.start_s, f.component, f.side.value)))


def _draw_one(
    side: Side,
    mode: FaultMode,
    parts: Sequence[str],
    drives: Mapping[str, _WheelDrive],
    taken: Sequence[FaultSpec],
    rng: np.random.Generator,
) -> FaultSpec | None:
    """A fault of one row on the first of the parts, in random order, that has a place free; None where none has."""
    for part in rng.permutation(parts).tolist():
        drive = drives[part]
        length = drive.speed.size * drive.dt
        busy = [(f.start_s, f.stop_s, f.side) for f in taken if f.component == part]
        place = free_place(drive, busy, side, min(20.0, 0.2 * length), length - 0.5, False, rng)
        if place is not None:
            return draw_fault(part, side, mode, *place, rng, steer=False)
    return None


def _parts(signals: Signals, machine: Machine, side: Side, options: InjectionOptions) -> list[str]:
    """Wheels whose sensor's or valve's faults this log can express."""

    def logged(name: str) -> bool:
        found = signals.items.get(name)
        return found is not None and bool(np.isfinite(found.values).any())

    if side is Side.SENSOR:
        return [w for w in machine.wheels if logged(f"wheel.{w}.v")]
    plant = machine.plant.wheels if options.plant else {}
    answering = [w for w in plant if logged(f"wheel.{w}.u") and logged(f"wheel.{w}.v")]
    return [w for w in machine.wheels if logged(f"wheel.{w}.u_applied") or w in answering]


def _scaled(fault: FaultSpec, machine: Machine, epsilon: float | None) -> FaultSpec:
    """Saturation term of a fault drawn for the paper's machine, in this machine's range."""
    scale = machine.max_speed / _PAPER_SPEED if fault.side is Side.SENSOR else machine.control.u_max
    strength = epsilon if epsilon is not None and not fault.mode.total else fault.epsilon
    return replace(fault, sat=fault.sat * scale, sat_std=fault.sat_std * scale, epsilon=strength)
