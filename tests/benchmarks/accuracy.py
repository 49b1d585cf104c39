"""Scores of the diagnosis on simulated missions; run as `python tests/benchmarks/accuracy.py [--quick] [--detail]`.

Limits and models may be tuned on the missions of `TUNING` alone; figures that are published come from `REPORTING`
(``--seeds reporting``), which no choice has seen. One line per evidence, coupling and ice (free wheels have no ground
to slip on): paper and random missions together, and the false alarms of healthy missions.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.evaluate import evaluate_report
from diagnosis.outcomes import Counts, add
from diagnosis.pipeline import diagnose_signals
from diagnosis.scores import figures
from replay.errors import MfhcaError
from replay.machine import haulotte
from replay.signals import Signal, Signals
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission
from replay.sources import SignalSource

TUNING = range(20)
REPORTING = range(1000, 1020)
SEEDS = {"tuning": TUNING, "reporting": REPORTING}

EVIDENCE = ("direct", "spool", "base")
COUPLINGS = ("free", "ground")
ICE = (0.0, 0.25)
SCENARIOS = ("paper", "random", "healthy")
# Signals that a mission logged with less evidence lacks; all else is the same.
_LACKS: dict[str, tuple[str, ...]] = {
    "direct": (),
    "spool": ("_true",),
    "base": ("_true", ".u_applied", "imu.yaw_rate", "gnss.lat", "gnss.lon"),
}


@dataclass(frozen=True)
class Task:
    """One mission to simulate, and the evidence levels to diagnose it with."""

    scenario: str
    coupling: str
    ice: float
    seed: int
    duration: float
    rate: float
    evidence: tuple[str, ...]


def signals_of(mission: SimulatedMission, evidence: str) -> Signals:
    """Signals as a log with less evidence would give them."""
    columns = [(name, mission.stamps, values) for name, values in mission.columns.items()]
    columns += [(name, group.stamps, values) for group in mission.slow for name, values in group.columns.items()]
    items = {
        name: Signal(name, stamps, values, SignalSource(column=name), "simulated", guessed=False)
        for name, stamps, values in columns
        if not name.endswith(_LACKS[evidence])
    }
    return Signals(items=items, missing={})


def run_task(task: Task) -> dict[str, dict[str, Counts] | str]:
    """Counts by evidence level, or the error that ended the diagnosis."""
    mission = simulate_mission(
        SimulationOptions(
            scenario=task.scenario,  # type: ignore[arg-type]
            seed=task.seed,
            duration_s=task.duration,
            rate_hz=task.rate,
            coupling=task.coupling,  # type: ignore[arg-type]
            ice=task.ice,
        )
    )
    out: dict[str, dict[str, Counts] | str] = {}
    for evidence in task.evidence:
        try:
            result = diagnose_signals(signals_of(mission, evidence), haulotte())
            out[evidence] = dict(evaluate_report(result.report, mission.truth, str(task)).groups)
        except MfhcaError as error:
            out[evidence] = f"{task}: {error}"
    return out


def run_all(tasks: Sequence[Task], jobs: int) -> Iterator[tuple[Task, dict[str, dict[str, Counts] | str]]]:
    with ProcessPoolExecutor(jobs) as pool:
        futures = {pool.submit(run_task, task): task for task in tasks}
        begin = time.perf_counter()
        for done, future in enumerate(as_completed(futures), 1):
            left = (time.perf_counter() - begin) / done * (len(tasks) - done)
            print(f"\r{done} of {len(tasks)} missions, {left:.0f} s left   ", end="", file=sys.stderr, flush=True)
            yield futures[future], future.result()
    print(file=sys.stderr)


def pooled(found: dict[tuple[Task, str], dict[str, Counts]], scenarios: Sequence[str], *key: object) -> dict[str, Any]:
    """Figures of the wheels over missions of some scenarios with one coupling, ice share and evidence."""
    parts = [
        counts["wheel"]
        for (task, evidence), counts in sorted(found.items(), key=str)
        if task.scenario in scenarios and (task.coupling, task.ice, evidence) == key
    ]
    return {"missions": len(parts)} | figures(add(parts))


def number(value: float | None, digits: int = 3, scale: float = 1.0) -> str:
    return "–" if value is None else f"{value * scale:.{digits}f}"


_WIDTHS = (26, 4, 6, 6, 6, 6, 1, 6, 6, 6, 6, 1, 6, 6, 6, 6, 6, 7, 7)
_HEAD = (
    "", "n", "F1", "bal", "dec", "share", "|", "F1", "bal", "dec", "share", "|", "ev.F1", "ε", "ε part", "on ms", "p95",
    "fa/h", "≤",
)  # fmt: skip


def line(cells: Sequence[object]) -> str:
    return " ".join(f"{c!s:<{w}}" if i == 0 else f"{c!s:>{w}}" for i, (c, w) in enumerate(zip(cells, _WIDTHS)))  # noqa: B905


def summary(name: str, faulty: dict[str, Any], healthy: dict[str, Any]) -> str:
    cells: list[object] = [name, faulty["missions"]]
    for side in ("sensor", "actuator"):
        s = faulty["sides"][side]
        keys = ("macro_f1", "balanced_accuracy", "balanced_accuracy_decided", "decided_share")
        cells += [*(number(s[k]) for k in keys), "|"]
    alarms = healthy["false_alarms"]
    return line(
        [
            *cells,
            number(faulty["events"]["f1"]),
            number(faulty["epsilon"]["mae"]),
            number(faulty["epsilon"]["mae_partial"]),
            number(faulty["onset_error_s"]["median"], 1, 1e3),
            number(faulty["onset_error_s"]["p95"], 0, 1e3),
            number(alarms["per_hour"], 2),
            number(alarms["per_hour_high"], 2),
        ]
    )


def detail(figures_: dict[str, Any]) -> Iterator[str]:
    """Recall of each row, by time and by event."""
    for side, s in figures_["sides"].items():
        recall = "  ".join(f"{row} {number(v['recall'])}" for row, v in s["rows"].items())
        yield f"    {side:9} recall by time: {recall}"
    for m in figures_["modes"]:
        onset = m["onset_error_s"]
        yield (
            f"    {m['side']:9} {m['mode']:12} {m['right']:4} of {m['faults']:4} events, ε {number(m['epsilon_mae'])}, "
            f"onset {number(onset['median'], 1, 1e3)} ms (p95 {number(onset['p95'], 0, 1e3)})"
        )


def main() -> None:
    """Simulate, diagnose, score, print."""
    parser = argparse.ArgumentParser(description="Scores of the diagnosis on simulated missions.")
    parser.add_argument("--seeds", choices=list(SEEDS), default="tuning", help="tune on one, publish the other")
    parser.add_argument("--quick", action="store_true", help="two seeds and 120 s, for a first impression")
    parser.add_argument("--count", type=int, default=20, help="number of seeds")
    parser.add_argument("--duration", type=float, default=240.0, help="length of a mission [s]")
    parser.add_argument("--rate", type=float, default=1000.0, help="recorded rate [Hz]")
    parser.add_argument("--evidence", choices=EVIDENCE, nargs="+", default=EVIDENCE)
    parser.add_argument("--coupling", choices=COUPLINGS, nargs="+", default=COUPLINGS)
    parser.add_argument("--ice", type=float, nargs="+", default=ICE, help="shares of icy ground")
    parser.add_argument("--scenario", choices=SCENARIOS, nargs="+", default=SCENARIOS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--detail", action="store_true", help="every row of the tables")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    asked = parser.parse_args()
    seeds = SEEDS[asked.seeds][: 2 if asked.quick else asked.count]
    duration = 120.0 if asked.quick else asked.duration
    evidence = tuple(asked.evidence)
    grounds = [(c, i) for c, i in product(asked.coupling, asked.ice) if c == "ground" or i == min(asked.ice)]
    tasks = [
        Task(scenario, coupling, ice, seed, duration, asked.rate, evidence)
        for seed, scenario, (coupling, ice) in product(seeds, asked.scenario, grounds)
    ]
    found: dict[tuple[Task, str], dict[str, Counts]] = {}
    failed = []
    for task, result in run_all(tasks, asked.jobs):
        for level, counts in result.items():
            if isinstance(counts, str):
                failed.append(counts)
            else:
                found[task, level] = counts
    print(f"{asked.seeds} seeds {seeds[0]}–{seeds[-1]}, {duration:g} s at {asked.rate:g} Hz")
    print(f"{'':31}{'sensor':^29}{'actuator':^28}")
    print(line(_HEAD))
    document: dict[str, Any] = {"seeds": asked.seeds, "configurations": []}
    for level, (coupling, ice) in product(evidence, grounds):
        faulty = pooled(found, ("paper", "random"), coupling, ice, level)
        healthy = pooled(found, ("healthy",), coupling, ice, level)
        print(summary(f"{level}, {coupling}, ice {ice:g}", faulty, healthy))
        for text in detail(faulty) if asked.detail else ():
            print(text)
        key = {"evidence": level, "coupling": coupling, "ice": ice}
        document["configurations"].append(key | {"faulty": faulty, "healthy": healthy})
    for text in sorted(failed):
        print(f"not judged: {text}")
    if asked.json:
        asked.json.write_text(json.dumps(document | {"failed": sorted(failed)}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
