"""Whether a mission shows what it says it would: `python tests/benchmarks/detectability.py --seeds reporting`.

Of a healthy mission, ``detectability`` states how large a fault of each part must be to be found at 95 % of the places at which it
may begin. The same mission is simulated again, in closed loop, with a fault of just that size at a place drawn at random, and
counts as found where a check of the all-clear does not clear its part. A signal that is lost, and one that stays at its last
value, have no size; theirs is the share of the places that was stated.

A simulated mission holds several faults: of different parts, and apart by more than the checks' windows. Those that last the
whole mission have one of their own, and one that the shared mission does not show in its own time is simulated again by itself.
``--alone`` gives each fault a mission of its own, with the same draws: what sharing changes.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence, Set
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hydrostatic
import numpy as np
from variation import recorded_signals

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.checks import cells_of, checks_of
from diagnosis.clearing.detectable import detectable, places_of
from diagnosis.clearing.gauges import gauges_of
from diagnosis.results.clearing import Checked
from diagnosis.results.detectability import Detectable, Deviation
from diagnosis.results.machine_words import HYDRAULIC
from replay.arrays.envelope import bucket_of
from replay.control.loop import replay_loop
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import Machine, haulotte
from replay.signals.signal import Signals
from replay.signals.timeline import align
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import STRUCTURES, StructureOptions

TIERS = ("base", "spool", "direct")
FIRST = {"tuning": 0, "reporting": 2000}
DEFAULT = "default"
_OFFSET_SHARE = 1e-3
_MOST_LOSS = 0.98
_MOST, _APART_S = (
    6,
    5.0,
)  # faults in a mission, and the time between them: windows, lags and what the loop does meanwhile
_WHOLE = 0.12  # of the faults: those of the whole mission have one place each, and need a mission each


@dataclass(frozen=True)
class Drawn:
    """A fault, and the row that states how surely it is found."""

    row: Detectable
    fault: FaultSpec

    @property
    def whole(self) -> bool:
        """Whether it lasts the whole mission."""
        return self.row.for_s is None


@dataclass(frozen=True)
class Tried:
    """One fault: whether it was found, the share at which it should be, and whether what is not cleared is its part alone."""

    machine: str
    seed: int
    tier: str
    part: str
    deviation: str
    for_s: float | None
    size: float | None
    stated: float
    found: bool
    alone: bool


def options_of(machine: str, seed: int, duration: float, faults: Sequence[FaultSpec]) -> SimulationOptions:
    """A mission of the simulator."""
    structure = None if machine == DEFAULT else StructureOptions(machine, seed)
    return SimulationOptions(
        scenario="healthy",
        seed=seed,
        duration_s=duration,
        rate_hz=200.0,
        imu=True,
        structure=structure,
        faults=tuple(faults),
    )


def recorded(
    machine: str, seed: int, duration: float, faults: Sequence[FaultSpec], tier: str
) -> tuple[Signals, Machine]:
    """A mission as a tier of evidence shows it, and its machine file."""
    if machine == hydrostatic.NAME:
        return hydrostatic.signals(seed, faults, duration, tier), hydrostatic.machine_of(hydrostatic.build(seed))
    return recorded_signals(simulate_mission(options_of(machine, seed, duration, faults)), tier), haulotte()


def cells_in(signals: Signals, machine: Machine) -> Cells:
    """What the checks are asked of; the law on the machine, whose fitting takes longest, is not."""
    timeline, machine = align(signals), replace(machine, control=replace(machine.control, law="none"))
    return cells_of(timeline, replay_loop(timeline, machine, bucket_of(timeline.size)), machine)


def fault_of(row: Detectable, start: float, stop: float, sign: float, scale: float) -> FaultSpec | None:
    """The fault of a row; None for what is not simulated. `scale` turns m/s into those of the paper's machine."""
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
    unit = scale if row.unit == "m/s" else 1.0
    if row.deviation is Deviation.OFFSET:
        return FaultSpec(*about, outside, start, stop, _OFFSET_SHARE, unit * sign * size / _OFFSET_SHARE)
    if row.deviation is Deviation.NOISY:
        return FaultSpec(*about, outside, start, stop, _OFFSET_SHARE, 0.0, unit * size / _OFFSET_SHARE)
    return None


def draw(healthy: Cells, open_before: Set[str], faults: int, times: float, rng: np.random.Generator) -> list[Drawn]:
    """Faults of a healthy mission: random deviations of random rows, each at a random one of its places."""
    gauges = {(g.component, g.side): g for g in gauges_of(healthy)}
    rows = [r for r in detectable(healthy).rows if r.places and r.component not in open_before]
    scale, out = 0.36 / healthy.machine.max_speed, list[Drawn]()
    parts = [[r for r in rows if (r.for_s is None) == whole] for whole in (False, True)]
    for _ in range(10 * faults if all(parts) else 0):
        own = parts[int(rng.random() < _WHOLE)]
        kinds = sorted({r.deviation for r in own})
        chosen = kinds[int(rng.integers(len(kinds)))]
        own = [r for r in own if r.deviation is chosen]
        row = own[int(rng.integers(len(own)))]
        row = row if row.size is None else replace(row, size=times * row.size)
        places = places_of(gauges[row.component, row.side], healthy, row.for_s)
        at = int(rng.integers(places.first.size))
        span = float(places.first[at] * healthy.dt), float(places.last[at] * healthy.dt)
        fault = fault_of(row, *span, float(rng.choice((-1.0, 1.0))), scale)
        if fault is not None:
            out.append(Drawn(row, fault))
        if len(out) >= faults:
            break
    return out


def groups(drawn: Sequence[Drawn], *, alone: bool) -> list[list[Drawn]]:
    """Faults that one mission holds: of different parts, and apart."""
    out: list[list[Drawn]] = []
    for d in drawn:
        fits = [
            g
            for g in out
            if not (alone or d.whole or g[0].whole)
            and len(g) < _MOST
            and all(
                d.fault.component != o.fault.component
                and (d.fault.start_s > o.fault.stop_s + _APART_S or o.fault.start_s > d.fault.stop_s + _APART_S)
                for o in g
            )
        ]
        fits[0].append(d) if fits else out.append([d])
    return out


def run(machine: str, seed: int, duration: float, faults: int, times: float, alone: bool) -> list[Tried]:
    """Faults at what one mission states, `faults` of each tier."""
    rng, out = np.random.default_rng(seed), list[Tried]()
    for tier in TIERS:

        def failed(*drawn: Drawn, tier: str = tier) -> list[Checked]:
            """Checks that a mission with these faults does not pass."""
            cells = cells_in(*recorded(machine, seed, duration, [d.fault for d in drawn], tier))
            return [c for c in checks_of(cells, HYDRAULIC) if not c.passed]

        healthy = cells_in(*recorded(machine, seed, duration, (), tier))
        open_before = {c.component for c in checks_of(healthy, HYDRAULIC) if not c.passed}
        for group in groups(draw(healthy, open_before, faults, times, rng), alone=alone):
            together = failed(*group)
            for d in group:
                sure = len(group) == 1 or any(shows(c, d.fault) for c in together)
                own = together if sure else failed(d)
                known = open_before | {g.row.component for g in (group if sure else [d])}
                out.append(_tried(d, own, known, healthy, (machine, seed, tier)))
    return out


def shows(c: Checked, fault: FaultSpec) -> bool:
    """Whether it is this fault that a check does not pass, for none of the others in the mission is in its windows."""
    if c.component != fault.component or c.start_s is None or c.stop_s is None:
        return False
    return c.start_s < fault.stop_s and c.stop_s > fault.start_s


def _tried(d: Drawn, failed: Sequence[Checked], known: Set[str], healthy: Cells, about: tuple[str, int, str]) -> Tried:
    row = d.row
    found = any(c.component == row.component for c in failed)
    kind = "axle" if row.component in healthy.machine.axles else "wheel"
    part = f"{kind} {'sensor' if row.side is Side.SENSOR else 'valve'}"
    stated = 0.95 if row.unit else (row.share or 0.0)
    alone = found and all(c.component in known for c in failed)
    return Tried(*about, part, row.deviation, row.for_s, row.size, stated, found, alone)


def run_all(
    machines: Sequence[str], seeds: Sequence[int], duration: float, faults: int, times: float, jobs: int, *, alone: bool
) -> Iterator[Tried]:
    """Outcomes as they come."""
    with ProcessPoolExecutor(jobs) as pool:
        futures = [pool.submit(run, m, s, duration, faults, times, alone) for s in seeds for m in machines]
        for done, future in enumerate(as_completed(futures), 1):
            print(f"\r{done} of {len(futures)} missions   ", end="", file=sys.stderr, flush=True)
            yield from future.result()
    print(file=sys.stderr)


_SIZELESS = (Deviation.NO_SIGNAL, Deviation.STUCK)
Key = tuple[str, str, str, str, str]


def keys_of(t: Tried) -> Iterator[Key]:
    """Lines of the table that a fault counts in: machine, tier, part, deviation, length."""
    sized = "without" if t.deviation in _SIZELESS else "with a size"
    length = "mission" if t.for_s is None else f"{t.for_s:g} s"
    yield "all", "all", "all", sized, ""
    yield "all", t.tier, "all", sized, ""
    yield "all", "all", "all", sized, length
    yield t.machine, t.tier, "all", sized, ""
    yield "all", t.tier, t.part, t.deviation, length


def table(tried: Sequence[Tried]) -> Iterator[str]:
    """A line for all, each tier, length, machine, and each part, deviation and length."""
    yield f"{'machine':<15}{'evidence':<9}{'part':<14}{'deviation':<13}{'for':<9}{'faults':>7}{'stated':>8}{'found':>8}{'alone':>8}"
    count: Counter[Key] = Counter()
    sums: Counter[tuple[Key, str]] = Counter()
    for t in tried:
        for key in keys_of(t):
            count[key] += 1
            for name in ("stated", "found", "alone"):
                sums[key, name] += getattr(t, name)
    for key in sorted(count, key=lambda k: (5 - k.count("all") - k.count(""), k)):
        machine, tier, part, deviation, length = key
        n = count[key]
        stated, found = sums[key, "stated"] / n, sums[key, "found"] / n
        alone = sums[key, "alone"] / max(1, sums[key, "found"])
        yield f"{machine:<15}{tier:<9}{part:<14}{deviation:<13}{length:<9}{n:>7}{stated:>8.3f}{found:>8.3f}{alone:>8.3f}"


def main() -> None:
    """State, inject, count."""
    parser = argparse.ArgumentParser(description="Found share of faults of the size that missions say they show.")
    parser.add_argument("--seeds", choices=FIRST, default="tuning")
    parser.add_argument("--first", type=int, default=0, help="added to the first seed")
    parser.add_argument("--missions", type=int, default=4, help="of each machine")
    parser.add_argument("--faults", type=int, default=40, help="of each mission and tier")
    parser.add_argument("--duration", type=float, default=75.0, help="length of a mission [s]")
    parser.add_argument("--machines", nargs="+", default=None, help="default, hydrostatic, structures by name")
    parser.add_argument("--times", type=float, default=1.0, help="what is stated, times this")
    parser.add_argument("--alone", action="store_true", help="a simulated mission for each fault")
    parser.add_argument("--json", type=Path, default=None, help="every fault, a line each, added to this file")
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    named = [DEFAULT, hydrostatic.NAME, *(n for n, s in STRUCTURES.items() if s.kind == asked.seeds)]
    seeds = range(FIRST[asked.seeds] + asked.first, FIRST[asked.seeds] + asked.first + asked.missions)
    tried: list[Tried] = []
    work = asked.machines or named, seeds, asked.duration, asked.faults, asked.times, asked.jobs
    for t in run_all(*work, alone=asked.alone):
        tried.append(t)
        if asked.json is not None:
            with asked.json.open("a", encoding="utf-8") as out:
                out.write(json.dumps(asdict(t)) + "\n")
    print("\n".join(table(tried)))


if __name__ == "__main__":
    main()
