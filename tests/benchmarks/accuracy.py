"""Scores of the diagnosis on simulated missions; run as `python tests/benchmarks/accuracy.py [--quick] [--detail]`.

Limits and models may be tuned on the missions of `TUNING` alone; figures that are published come from `REPORTING`
(``--seeds reporting``), which no choice has seen. One line per evidence, coupling and ice (free wheels have no ground
to slip on): paper and random missions together, and the false alarms of healthy missions. With ``--steering`` the random
missions fault the steering axles too, and a second line scores those.
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

from diagnosis.evaluation.counts import Counts, add
from diagnosis.evaluation.evaluate import evaluate_report
from diagnosis.evaluation.excitation import speeds_of
from diagnosis.evaluation.scores import figures
from diagnosis.pipeline import diagnose_signals
from replay.errors import MfhcaError
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

TUNING = range(20)
REPORTING = range(2000, 2040)
SEEDS = {"tuning": TUNING, "reporting": REPORTING}

EVIDENCE = ("direct", "spool", "base+body", "base")
COUPLINGS = ("free", "ground")
ICE = (0.0, 0.25)
SCENARIOS = ("paper", "random", "healthy")
# Signals that a mission logged with less evidence lacks; all else is the same.
_LACKS: dict[str, tuple[str, ...]] = {
    "direct": (),
    "spool": ("_true",),
    "base+body": ("_true", ".u_applied"),
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
    steering: bool = False


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
            steering_faults=task.steering and task.scenario == "random",
        )
    )
    out: dict[str, dict[str, Counts] | str] = {}
    for evidence in task.evidence:
        try:
            result = diagnose_signals(signals_of(mission, evidence), haulotte())
            speeds = speeds_of(result.columns, mission.truth.wheels)
            out[evidence] = dict(evaluate_report(result.report, mission.truth, str(task), speeds=speeds).groups)
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


def pooled(
    found: dict[tuple[Task, str], dict[str, Counts]], group: str, scenarios: Sequence[str], *key: object
) -> dict[str, Any]:
    """Figures of the wheels or the steering over missions of some scenarios with one coupling, ice share and evidence."""
    parts = [
        counts[group]
        for (task, evidence), counts in sorted(found.items(), key=str)
        if task.scenario in scenarios and (task.coupling, task.ice, evidence) == key and group in counts
    ]
    return {"missions": len(parts)} | figures(add(parts))


def number(value: float | None, digits: int = 3, scale: float = 1.0) -> str:
    return "–" if value is None else f"{value * scale:.{digits}f}"


_WIDTHS = (26, 4, 6, 6, 6, 6, 1, 6, 6, 6, 6, 1, 6, 6, 6, 6, 6, 6, 6, 6, 7, 7)
_HEAD = (
    "", "n", "F1", "bal", "dec", "share", "|", "F1", "bal", "dec", "share", "|", "ev.F1", "isol", "ε", "ε part", "on ms",
    "p95", "det ms", "p95", "fa/h", "≤",
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
            number(faulty["events"]["isolation_rate"]),
            number(faulty["epsilon"]["mae"]),
            number(faulty["epsilon"]["mae_partial"]),
            number(faulty["onset_error_s"]["median"], 1, 1e3),
            number(faulty["onset_error_s"]["p95"], 0, 1e3),
            number(faulty["detection_delay_s"]["median"], 1, 1e3),
            number(faulty["detection_delay_s"]["p95"], 0, 1e3),
            number(alarms["per_hour"], 2),
            number(alarms["per_hour_high"], 2),
        ]
    )


def detail(figures_: dict[str, Any]) -> Iterator[str]:
    """Recall of each row by time and by event, figures by severity and excitation, reliability."""
    for side, s in figures_["sides"].items():
        recall = "  ".join(f"{row} {number(v['recall'])}" for row, v in s["rows"].items())
        rates = "  ".join(f"{k} {number(v)}" for k, v in s["damadics"].items())
        yield f"    {side:9} recall by time: {recall}; {rates}"
    for m in figures_["modes"]:
        onset, delay = m["onset_error_s"], m["detection_delay_s"]
        yield (
            f"    {m['side']:9} {m['mode']:12} {m['right']:4} of {m['faults']:4} events, ε {number(m['epsilon_mae'])}, "
            f"onset {number(onset['median'], 1, 1e3)} ms (p95 {number(onset['p95'], 0, 1e3)}), "
            f"delay {number(delay['median'], 1, 1e3)} ms (p95 {number(delay['p95'], 0, 1e3)}, {delay['without']} unknown)"
        )
    for key in ("by_epsilon", "by_speed", "by_contact"):
        for b in figures_[key]:
            name = b.get("contact") or f"{key[3:]} {b['low']:g}–{'' if b['high'] is None else format(b['high'], 'g')}"
            events = b["events"]
            f1 = ", ".join(f"{side} F1 {number(s['macro_f1'])}" for side, s in b["sides"].items())
            yield (
                f"    {name:18} {events['right']:4} of {events['faults']:4} events, precision {number(events['precision'])}, "
                f"isolated {number(events['isolation_rate'])}, wrong part {number(events['wrong_wheel_rate'])}, {f1}"
            )
    for r in figures_["reliability"]:
        yield (
            f"    {r['tier']:9} {r['side']:18} {r['right']:4} of {r['reported']:4} reports right, Brier {number(r['brier'])}, "
            f"ECE {number(r['ece'])}, bounds of ε hold {number(r['bounds_hold'])} of {r['bounds']}"
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
    parser.add_argument(
        "--steering", action="store_true", help="fault the steering of random missions too, and score it"
    )
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--detail", action="store_true", help="every row of the tables")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    asked = parser.parse_args()
    seeds = SEEDS[asked.seeds][: 2 if asked.quick else asked.count]
    duration = 120.0 if asked.quick else asked.duration
    evidence = tuple(asked.evidence)
    grounds = [(c, i) for c, i in product(asked.coupling, asked.ice) if c == "ground" or i == min(asked.ice)]
    tasks = [
        Task(scenario, coupling, ice, seed, duration, asked.rate, evidence, asked.steering)
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
    for level, (coupling, ice), group in product(
        evidence, grounds, ("wheel", "steer") if asked.steering else ("wheel",)
    ):
        scenarios = ("paper", "random") if group == "wheel" else ("random",)
        faulty = pooled(found, group, scenarios, coupling, ice, level)
        healthy = pooled(found, group, ("healthy",), coupling, ice, level)
        name = f"{level}, {coupling}, ice {ice:g}"
        print(summary(name if group == "wheel" else "  its steering", faulty, healthy))
        for text in detail(faulty) if asked.detail else ():
            print(text)
        key = {"evidence": level, "coupling": coupling, "ice": ice, "group": group}
        document["configurations"].append(key | {"faulty": faulty, "healthy": healthy})
    for text in sorted(failed):
        print(f"not judged: {text}")
    if asked.json:
        asked.json.write_text(json.dumps(document | {"failed": sorted(failed)}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
