"""Scores on machines of other structures; run as `python tests/benchmarks/structures.py [--seeds reporting] [--fit]`.

Each structure of `replay.simulation.structures` gives machines (one per seed) that drive missions with faults of wheels and
axles, and healthy ones; all are diagnosed with default settings, or with ``--fit`` by a machine file fitted from three more
healthy missions of the same machine. Tune on structures of kind ``tuning`` with seeds below 1000 alone; published figures
come from kind ``reporting`` with seeds from 2000 on. ``--structure random`` draws the effects of each machine too. Driving time; undecided time counts as wrong but in ``decided``.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from accuracy import EVIDENCE, number
from variation import recorded_signals

from diagnosis.evaluation.counts import Counts, add
from diagnosis.evaluation.evaluate import evaluate_report
from diagnosis.evaluation.scores import figures
from diagnosis.fitting.missions import fit_missions
from diagnosis.pipeline import diagnose_mission
from replay.errors import MfhcaError
from replay.machine.config import Machine, haulotte
from replay.mission import Mission
from replay.signals.timeline import align
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import STRUCTURE_NAMES, STRUCTURES, StructureOptions

FIRST = {"tuning": 0, "reporting": 2000}


@dataclass(frozen=True)
class Task:
    """One machine: its structure, seed, length of its missions, how it is diagnosed, and whether it has healthy missions alone."""

    structure: str
    seed: int
    duration: float
    evidence: tuple[str, ...]
    fit: bool
    healthy: bool = False


@dataclass(frozen=True)
class Outcome:
    """Counts of one mission at one level of evidence, by group of components, and whether it was stopped."""

    task: Task
    evidence: str
    faulty: bool
    groups: dict[str, Counts]
    status: str


def options_of(task: Task, scenario: str, number_of: int) -> SimulationOptions:
    """A mission of the task's machine."""
    structure = StructureOptions(task.structure, machine_seed=task.seed)
    rates = structure.structure(task.seed).rate_hz
    rate = float(np.random.default_rng([task.seed, 29]).choice(rates))
    return SimulationOptions(
        scenario="healthy" if scenario == "healthy" else "random",
        seed=10 * task.seed + number_of,
        duration_s=task.duration,
        rate_hz=rate,
        steering_faults=True,
        structure=structure,
    )


def machine_for(task: Task, evidence: str) -> Machine:
    """Default machine, or one fitted from three healthy missions."""
    if not task.fit:
        return haulotte()
    missions = []
    for k in range(3):
        signals = recorded_signals(simulate_mission(options_of(task, "healthy", 5 + k)), evidence)
        missions.append(Mission(files=(), signals=signals, timeline=align(signals)))
    return fit_missions(missions, haulotte()).machine


def judge(task: Task) -> list[Outcome | str]:
    """Outcomes of the machine's missions."""
    out: list[Outcome | str] = []
    scenarios = [(k, s) for k, s in enumerate(("random", "healthy")) if s == "healthy" or not task.healthy]
    missions = [(s, simulate_mission(options_of(task, s, k))) for k, s in scenarios]
    for evidence in task.evidence:
        try:
            machine = machine_for(task, evidence)
        except MfhcaError as error:
            out.append(f"{task.structure} {task.seed} {evidence}: fit: {error}")
            machine = haulotte()
        for scenario, mission in missions:
            name = f"{task.structure} {task.seed} {scenario} {evidence}"
            try:
                signals = recorded_signals(mission, evidence)
                report = diagnose_mission(Mission(files=(), signals=signals, timeline=align(signals)), machine).report
                scores = evaluate_report(report, mission.truth, name)
            except MfhcaError as error:
                out.append(f"{name}: {error}")
                continue
            groups = dict(scores.groups)
            out.append(Outcome(task, evidence, scenario == "random", groups, report["verdict"]["status"]))
    return out


def run_all(tasks: Sequence[Task], jobs: int) -> Iterator[list[Outcome | str]]:
    with ProcessPoolExecutor(jobs) as pool:
        futures = [pool.submit(judge, task) for task in tasks]
        for done, future in enumerate(as_completed(futures), 1):
            print(f"\r{done} of {len(tasks)} machines   ", end="", file=sys.stderr, flush=True)
            yield future.result()
    print(file=sys.stderr)


def sure(counts: Sequence[Counts], least: float) -> tuple[int, int]:
    """Reports with a probability above `least`: those that are right, and all."""
    judged = [r for c in counts for r in c.reports if r.probability > least and r.outcome != "ignored"]
    return sum(r.outcome == "right" for r in judged), len(judged)


def urgent(counts: Sequence[Counts]) -> tuple[int, int]:
    """Reports of severity high: those on the right component and side, and all."""
    judged = [r for c in counts for r in c.reports if r.severity == "high" and r.outcome != "ignored"]
    return sum(r.outcome in ("right", "wrong_mode") for r in judged), len(judged)


def line(name: str, outcomes: Sequence[Outcome]) -> str:
    """One line of figures."""
    cells = [f"{name:<24}"]
    faulty, healthy = ([o for o in outcomes if o.faulty is flag] for flag in (True, False))
    for group in ("wheel", "steer"):
        found = figures(add([o.groups[group] for o in faulty if group in o.groups]))
        for side in ("sensor", "actuator"):
            s = found["sides"][side]
            cells.append(
                "/".join(number(s[k]) for k in ("balanced_accuracy", "balanced_accuracy_decided", "decided_share"))
            )
    alarms = [
        r for o in healthy for c in o.groups.values() for r in c.reports if r.false_alarm and r.severity != "info"
    ]
    hours = len(healthy) * (healthy[0].task.duration if healthy else 0.0) / 3600
    stopped = sum(o.status == "stop" for o in healthy)
    counts = [c for o in outcomes for c in o.groups.values()]
    cells.append(
        f"fa {len(alarms)} in {hours:.2f} h = {len(alarms) / hours if hours else 0:.1f}/h, stopped {stopped} of {len(healthy)}"
    )
    cells.append("p>.9 right {} of {}".format(*sure(counts, 0.9)))
    cells.append("high right part {} of {}".format(*urgent(counts)))
    ready = sum(o.status == "ready" for o in faulty)
    cells.append(f"faulty ready {ready} of {len(faulty)}")
    return "  ".join(cells)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", choices=FIRST, default="tuning")
    parser.add_argument("--count", type=int, default=3, help="machines per structure")
    parser.add_argument("--first", type=int, default=0, help="added to the first seed")
    parser.add_argument("--duration", type=float, default=120.0, help="length of a mission [s]")
    parser.add_argument("--evidence", nargs="+", choices=EVIDENCE, default=list(EVIDENCE))
    parser.add_argument("--structure", nargs="+", choices=STRUCTURE_NAMES, default=None)
    parser.add_argument("--fit", action="store_true", help="fit a machine file from three healthy missions")
    parser.add_argument("--healthy", action="store_true", help="healthy missions alone, for false alarms")
    parser.add_argument("--jobs", type=int, default=1)
    choice = parser.parse_args()
    names = choice.structure or [n for n, s in STRUCTURES.items() if s.kind == choice.seeds]
    first = FIRST[choice.seeds] + choice.first
    tasks = [
        Task(name, seed, choice.duration, tuple(choice.evidence), choice.fit, choice.healthy)
        for name in names
        for seed in range(first, first + choice.count)
    ]
    start = time.monotonic()
    outcomes: list[Outcome] = []
    for found in run_all(tasks, choice.jobs):
        for one in found:
            if isinstance(one, str):
                print(one)
            else:
                outcomes.append(one)
    print(
        "columns: wheel sensor, wheel valve, axle sensor, axle valve: balanced accuracy/of decided time/share decided"
    )
    for evidence in choice.evidence:
        for name in names:
            print(
                line(f"{name} {evidence}", [o for o in outcomes if o.task.structure == name and o.evidence == evidence])
            )
    print(f"{time.monotonic() - start:.0f} s")


if __name__ == "__main__":
    main()
