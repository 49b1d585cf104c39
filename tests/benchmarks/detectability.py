"""Whether a mission shows what it says it would: `python tests/benchmarks/detectability.py --seeds reporting`.

Of a healthy mission, ``detectability`` states how large a fault of each part must be to be found at 95 % of the places at which it
may begin. The same mission is simulated again, in closed loop, with a fault of just that size at a place drawn at random, and
counts as found where a check of the all-clear does not clear its part. A signal that is lost, and one that stays at its last
value, have no size; theirs is the share of the places that was stated.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from variation import recorded_signals

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.checks import cells_of, checks_of
from diagnosis.clearing.detectable import detectable, places_of
from diagnosis.clearing.gauges import gauges_of
from diagnosis.results.detectability import Detectable, Deviation
from diagnosis.results.machine_words import HYDRAULIC
from replay.arrays.envelope import bucket_of
from replay.control.loop import replay_loop
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import haulotte
from replay.signals.timeline import align
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import STRUCTURES, StructureOptions

TIERS = ("base", "spool", "direct")
FIRST = {"tuning": 0, "reporting": 2000}
DEFAULT = "default"
_OFFSET_SHARE = 1e-3
_MOST_LOSS = 0.98


@dataclass(frozen=True)
class Tried:
    """One fault: whether it was found, and the share at which it should be."""

    machine: str
    tier: str
    part: str
    deviation: str
    for_s: float | None
    stated: float
    found: bool


def options_of(machine: str, seed: int, duration: float) -> SimulationOptions:
    """A healthy mission."""
    structure = None if machine == DEFAULT else StructureOptions(machine, seed)
    return SimulationOptions(
        scenario="healthy", seed=seed, duration_s=duration, rate_hz=200.0, imu=True, structure=structure
    )


def cells(options: SimulationOptions, tier: str) -> Cells:
    """A mission as a tier of evidence shows it."""
    timeline, machine = align(recorded_signals(simulate_mission(options), tier)), haulotte()
    return cells_of(timeline, replay_loop(timeline, machine, bucket_of(timeline.size)), machine)


def fault_of(row: Detectable, start: float, stop: float, sign: float) -> FaultSpec | None:
    """The fault of a row; None for what is not simulated."""
    outside, size = FaultMode.OUTSIDE_TABLE, row.size or 0.0
    about = (row.component, row.side)
    if row.deviation is Deviation.NO_SIGNAL:
        return FaultSpec(*about, FaultMode.NO_SIGNAL, start, stop)
    if row.deviation is Deviation.STUCK:
        return FaultSpec(*about, FaultMode.STUCK, start, stop, 1.0, float("nan"))
    if row.size is None or not size > 0.0:
        return None
    if row.deviation is Deviation.INEFFICIENT:
        return FaultSpec(*about, FaultMode.INEFFICIENT, start, stop, min(size, _MOST_LOSS))
    if row.deviation is Deviation.EXCESS and size <= 1.0:
        return FaultSpec(*about, outside, start, stop, -size)
    if row.deviation is Deviation.OFFSET:
        return FaultSpec(*about, outside, start, stop, _OFFSET_SHARE, sign * size / _OFFSET_SHARE)
    if row.deviation is Deviation.NOISY:
        return FaultSpec(*about, outside, start, stop, _OFFSET_SHARE, 0.0, size / _OFFSET_SHARE)
    return None


def run(machine: str, seed: int, duration: float, faults: int) -> list[Tried]:
    """Faults at what one mission states, `faults` of each tier."""
    options, rng, out = options_of(machine, seed, duration), np.random.default_rng(seed), []
    for tier in TIERS:
        healthy = cells(options, tier)
        open_before = {c.component for c in checks_of(healthy, HYDRAULIC) if not c.passed}
        gauges = {(g.component, g.side): g for g in gauges_of(healthy)}
        rows = [r for r in detectable(healthy).rows if r.places and r.component not in open_before]
        done = 0
        for k in rng.permutation(len(rows)):
            row = rows[k]
            places = places_of(gauges[row.component, row.side], healthy, row.for_s)
            at = int(rng.integers(places.first.size))
            span = float(places.first[at] * healthy.dt), float(places.last[at] * healthy.dt)
            fault = fault_of(row, *span, float(rng.choice((-1.0, 1.0))))
            if fault is None:
                continue
            stated = 0.95 if row.unit else (row.share or 0.0)
            checks = checks_of(cells(replace(options, faults=(fault,)), tier), HYDRAULIC)
            found = any(c.component == row.component and not c.passed for c in checks)
            kind = "axle" if row.component in healthy.machine.axles else "wheel"
            part = f"{kind} {'sensor' if row.side is Side.SENSOR else 'valve'}"
            out.append(Tried(machine, tier, part, row.deviation, row.for_s, stated, found))
            done += 1
            if done >= faults:
                break
    return out


def run_all(machines: Sequence[str], seeds: Sequence[int], duration: float, faults: int, jobs: int) -> Iterator[Tried]:
    """Outcomes as they come."""
    with ProcessPoolExecutor(jobs) as pool:
        futures = [pool.submit(run, m, s, duration, faults) for m in machines for s in seeds]
        for done, future in enumerate(as_completed(futures), 1):
            print(f"\r{done} of {len(futures)} missions   ", end="", file=sys.stderr, flush=True)
            yield from future.result()
    print(file=sys.stderr)


def table(tried: Sequence[Tried]) -> Iterator[str]:
    """A line for each machine, tier, part, deviation and length."""
    yield f"{'machine':<15}{'evidence':<9}{'part':<14}{'deviation':<13}{'for':<9}{'faults':>7}{'stated':>8}{'found':>8}"
    keys = [
        *sorted({(t.machine, t.tier, "all", "", "") for t in tried}),
        *sorted({("all", "all", t.part, t.deviation, str(t.for_s or "mission")) for t in tried}),
        ("all", "all", "all", "with a size", ""),
        ("all", "all", "all", "without", ""),
    ]
    for machine, tier, part, deviation, length in keys:
        own = [
            t
            for t in tried
            if machine in (t.machine, "all")
            and tier in (t.tier, "all")
            and part in (t.part, "all")
            and (
                deviation in ("", t.deviation)
                or deviation == ("without" if t.deviation in (Deviation.NO_SIGNAL, Deviation.STUCK) else "with a size")
            )
            and length in ("", str(t.for_s or "mission"))
        ]
        if own:
            stated, found = float(np.mean([t.stated for t in own])), float(np.mean([t.found for t in own]))
            yield f"{machine:<15}{tier:<9}{part:<14}{deviation:<13}{length:<9}{len(own):>7}{stated:>8.3f}{found:>8.3f}"


def main() -> None:
    """State, inject, count."""
    parser = argparse.ArgumentParser(description="Found share of faults of the size that missions say they show.")
    parser.add_argument("--seeds", choices=FIRST, default="tuning")
    parser.add_argument("--first", type=int, default=0, help="added to the first seed")
    parser.add_argument("--missions", type=int, default=8, help="of each machine")
    parser.add_argument("--faults", type=int, default=40, help="of each mission and tier")
    parser.add_argument("--duration", type=float, default=75.0, help="length of a mission [s]")
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    machines = [DEFAULT, *(n for n, s in STRUCTURES.items() if s.kind == asked.seeds)]
    seeds = range(FIRST[asked.seeds] + asked.first, FIRST[asked.seeds] + asked.first + asked.missions)
    print("\n".join(table(list(run_all(machines, seeds, asked.duration, asked.faults, asked.jobs)))))


if __name__ == "__main__":
    main()
