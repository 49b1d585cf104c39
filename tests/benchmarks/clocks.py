"""How well the clocks of two files are brought together; run as `python tests/benchmarks/clocks.py [--count N]`.

Each seed is a simulated mission with faults, recorded twice: by a PLC at 1 kHz with the mission's own sensor faults, and by a
ROS side at 100 or 200 Hz with noise, rounding, late sampling and faults of its own, over another part of the mission, on a
clock that is off and drifts. Seeds below 1000 are for tuning, those from 2000 for published figures.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from replay.clocks.align import estimate
from replay.log.source_options import SignalSource
from replay.signals.signal import Signal
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

SHARED = ("speeds", "commands", "both", "one speed")


@dataclass(frozen=True)
class Case:
    """What is recorded twice, how the other clock runs, and whether the ROS side repeats the PLC's samples."""

    shared: str
    offset_s: float
    drift_ppm: float
    rate_hz: float
    bridge: bool


@dataclass(frozen=True)
class Outcome:
    """Largest error of a stamp [s], stated bound [s], CPU time [s]; NaN errors where it was refused."""

    case: Case
    error: float
    bound: float
    cpu: float
    reason: str


def drawn(rng: np.random.Generator) -> Case:
    """A case of a seed: offsets of milliseconds to hours, whole hours among them."""
    offset = float(rng.choice([-1.0, 1.0])) * 10 ** rng.uniform(-3, 4)
    if rng.random() < 0.3:
        offset = 3600.0 * float(rng.integers(-3, 4)) + float(rng.normal(0.0, 0.3))
    return Case(
        str(rng.choice(SHARED)),
        offset,
        float(rng.uniform(-200, 200)),
        float(rng.choice([100.0, 200.0])),
        bool(rng.random() < 0.3),
    )


def two_files(
    mission: SimulatedMission, case: Case, rng: np.random.Generator
) -> tuple[dict[str, Signal], dict[str, Signal], NDArray[np.float64]]:
    """Signals of the PLC (reference) and of the ROS side, and mission times of the ROS side's samples [s]."""
    wheels = mission.options.machine.wheels[: 1 if case.shared == "one speed" else None]
    names = [f"wheel.{w}.v" for w in wheels] if case.shared != "commands" else []
    names += ["cmd.v", "cmd.omega"] if case.shared in ("commands", "both") else []
    reference = {n: _signal(n, stamps, values) for n, stamps, values in mission.series()}
    duration = mission.options.duration_s
    t = np.arange(rng.uniform(0.0, 0.15) * duration, rng.uniform(0.85, 1.0) * duration, 1.0 / case.rate_hz)
    t = t + rng.uniform(0.0, 0.2 / case.rate_hz, t.size)
    since = t - t[0]
    own = mission.options.start_ns + np.rint(
        (t[0] + case.offset_s + since * (1.0 + case.drift_ppm * 1e-6)) * 1e9
    ).astype(np.int64)
    grid = np.arange(mission.options.samples) / mission.options.rate_hz
    other = {}
    for name in names:
        if case.bridge:
            values = mission.columns[name][np.searchsorted(grid, t, side="right") - 1]
        elif name in mission.actual:
            lsb = rng.uniform(0.001, 0.005)
            values = np.interp(t, grid, mission.actual[name]) + rng.uniform(0.002, 0.006) * rng.standard_normal(t.size)
            values = np.round(values / lsb) * lsb
        else:
            values = mission.columns[name][np.searchsorted(grid, t, side="right") - 1]
        values = values.copy()
        if name.startswith("wheel.") and rng.random() < 0.5:  # a fault of this copy alone
            first = int(rng.uniform(0.1, 0.7) * t.size)
            rows = slice(first, first + int(rng.uniform(2.0, 15.0) * case.rate_hz))
            values[rows] = rng.choice([values[first], 0.0, np.nan])
        other[name] = _signal(name, own, values)
    return reference, other, t


def _signal(name: str, stamps: NDArray[np.int64], values: NDArray[np.float64]) -> Signal:
    return Signal(name, stamps, values, SignalSource(column=name), "", True)


def judge(seed: int, duration_s: float, given: Case | None) -> Outcome:
    """Record a mission twice and compare the clocks."""
    rng = np.random.default_rng([seed, 11])
    case = drawn(rng)
    if given is not None:
        case = Case(case.shared, given.offset_s, given.drift_ppm, case.rate_hz, case.bridge)
    mission = simulate_mission(SimulationOptions(scenario="random", seed=seed, duration_s=duration_s))
    reference, other, t = two_files(mission, case, rng)
    begin = time.process_time()
    clock, line, between = estimate(reference, other)
    cpu = time.process_time() - begin
    if line is None:
        return Outcome(case, np.nan, np.nan, cpu, clock.reason)
    stamps = next(iter(other.values())).stamps
    true = mission.options.start_ns + np.rint(t * 1e9).astype(np.int64)
    moved = stamps + between + np.rint(line.lag((stamps - stamps[0]) * 1e-9) * 1e9).astype(np.int64)
    error = moved - true if clock.method == "estimated" else stamps - true
    return Outcome(case, float(np.abs(error).max()) * 1e-9, clock.uncertainty_s or np.nan, cpu, "")


def main() -> None:
    """Judge all seeds and print."""
    parser = argparse.ArgumentParser(description="Error of stamps after the clocks of two files were compared.")
    parser.add_argument("--first", type=int, default=2000, help="first seed")
    parser.add_argument("--count", type=int, default=20, help="number of missions")
    parser.add_argument("--duration", type=float, default=240.0, help="length of a mission [s]")
    parser.add_argument("--offset", type=float, help="offset of all [s]; default: drawn")
    parser.add_argument("--drift", type=float, help="drift of all [ppm]; default: drawn")
    parser.add_argument("--detail", action="store_true", help="a line per mission")
    asked = parser.parse_args()
    given = None
    if asked.offset is not None or asked.drift is not None:
        given = Case("", asked.offset or 0.0, asked.drift or 0.0, 0.0, False)
    outcomes = []
    for seed in range(asked.first, asked.first + asked.count):
        o = judge(seed, asked.duration, given)
        outcomes.append(o)
        if asked.detail:
            c = o.case
            found = o.reason or f"error {o.error * 1e3:7.3f} ms, bound {o.bound * 1e3:7.3f} ms"
            print(
                f"{seed} {c.shared:9} {c.rate_hz:3.0f} Hz {'bridge' if c.bridge else 'sensor'} {c.offset_s:+12.3f} s "
                f"{c.drift_ppm:+6.1f} ppm: {found}, {o.cpu:.2f} s CPU",
                flush=True,
            )
    print(f"seeds {asked.first}–{asked.first + asked.count - 1}, {asked.duration:g} s")
    for name in ("all", *SHARED):
        mine = [o for o in outcomes if name in ("all", o.case.shared)]
        done = [o for o in mine if not o.reason]
        if not mine:
            continue
        errors = np.array([o.error for o in done]) * 1e3
        figures = "–"
        if len(done):
            covered = sum(o.error <= o.bound for o in done)
            figures = (
                f"largest error of a stamp: median {np.median(errors):.3f}, p95 {np.percentile(errors, 95):.3f}, worst "
                f"{errors.max():.3f} ms; bound median {statistics.median(o.bound for o in done) * 1e3:.3f} ms, covers {covered} of {len(done)}"
            )
        print(f"{name:10} {len(mine)} missions, {len(mine) - len(done)} refused; {figures}")
    print(
        f"CPU median {statistics.median(o.cpu for o in outcomes):.3f} s, largest {max(o.cpu for o in outcomes):.3f} s"
    )


if __name__ == "__main__":
    main()
