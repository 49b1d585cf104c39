"""False alarms per hour of healthy missions; run as `python tests/benchmarks/false_alarms.py --hours 20 --log FILE`.

Missions of 240 s with turns, reversals, slopes and, for most, ice, under varied laws; the paper's machine by default,
machines of `replay.simulation.variation` with ``--machines varied``. Each is diagnosed in memory with the default settings
at every level of evidence. One line of JSON per mission is kept in the file of ``--log``; a run that was stopped goes on
after the missions that stand there.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from accuracy import EVIDENCE, number
from scipy.special import gammaincinv
from variation import recorded_signals

from diagnosis.evaluation.evaluate import evaluate_report
from diagnosis.pipeline import diagnose_signals
from replay.errors import MfhcaError
from replay.machine.config import haulotte
from replay.simulation.options import SimulationOptions
from replay.simulation.plant_options import PlantOptions
from replay.simulation.run import simulate_mission
from replay.simulation.variation import POOLS, Kind, varied_options


@dataclass(frozen=True)
class Task:
    """One healthy mission to simulate and to diagnose at each level of evidence."""

    kind: Kind
    machines: str
    seed: int
    duration: float
    evidence: tuple[str, ...]

    @property
    def key(self) -> str:
        """Name of the mission in the log of results."""
        return f"{self.kind} {self.machines} {self.seed} {self.duration:g}"

    def options(self) -> SimulationOptions:
        """Every law and ground; the paper's plant and a full log at 1 kHz unless the machines vary."""
        options = varied_options(self.seed, kind=self.kind, scenario="healthy", duration_s=self.duration)
        if self.machines == "varied":
            return options
        return replace(
            options, plant=PlantOptions(), machine=haulotte(), rate_hz=1000.0, jitter=0.0, drop_share=0.0, silent="zero"
        )


def run_task(task: Task) -> dict[str, Any]:
    """Alarms, decided share and verdict by evidence."""
    options = task.options()
    mission = simulate_mission(options)
    levels: dict[str, Any] = {}
    for level in task.evidence:
        try:
            report = diagnose_signals(recorded_signals(mission, level), haulotte()).report
            groups = evaluate_report(report, mission.truth, task.key).groups
        except MfhcaError as error:
            levels[level] = {"error": str(error)}
            continue
        alarms = [r for counts in groups.values() for r in counts.reports if r.false_alarm and r.severity != "info"]
        seconds = {side: groups["wheel"].seconds[side] for side in ("sensor", "actuator")}
        levels[level] = {
            "healthy_s": groups["wheel"].healthy_s,
            "alarms": [
                f"{r.component} {r.side} {r.mode} {r.start_s:.2f}–{r.stop_s:.2f} p {r.probability:.3f}" for r in alarms
            ],
            "decided": {side: float(x[:, :-1].sum() / max(x.sum(), 1e-9)) for side, x in seconds.items()},
            "verdict": report["verdict"]["status"],
        }
    ground = {
        "law": options.law,
        "coupling": options.coupling,
        "ice": options.ice_share,
        "steepness": options.steepness,
    }
    return {"key": task.key, "seed": task.seed, **ground, "levels": levels}


def bound(count: int, hours: float) -> float | None:
    """Upper 95 % bound of a Poisson rate [1/h]."""
    return float(gammaincinv(count + 1, 0.95)) / hours if hours else None


def show(lines: Sequence[dict[str, Any]], evidence: Sequence[str]) -> dict[str, Any]:
    """Print the rates over all missions and by law; return them."""
    out: dict[str, Any] = {}
    print(
        f"{'':30}{'missions':>9}{'hours':>8}{'alarms':>8}{'per h':>8}{'≤ (95 %)':>10}{'decided s':>11}{'a':>7}{'failed':>8}"
    )
    for level in evidence:
        groups = {"all": list(lines)}
        for x in lines:
            groups.setdefault(f"law {x['law']}", []).append(x)
            groups.setdefault(f"{x['coupling']}, {'ice' if x['ice'] else 'no ice'}", []).append(x)
        for name, mine in sorted(groups.items()):
            judged = [x["levels"][level] for x in mine if "error" not in x["levels"].get(level, {"error": ""})]
            failed = sum("error" in x["levels"].get(level, {}) for x in mine)
            hours, count = sum(x["healthy_s"] for x in judged) / 3600, sum(len(x["alarms"]) for x in judged)
            sides = [sum(x["decided"][s] for x in judged) / max(len(judged), 1) for s in ("sensor", "actuator")]
            high = bound(count, hours)
            print(
                f"{level + ', ' + name:30}{len(judged):9}{hours:8.2f}{count:8}{number(count / hours if hours else None, 2):>8}"
                f"{number(high, 2):>10}{sides[0]:11.2f}{sides[1]:7.2f}{failed:8}"
            )
            out[f"{level}, {name}"] = {"hours": hours, "alarms": count, "per_hour_high": high, "failed": failed}
    for x in lines:
        for level in evidence:
            found = x["levels"].get(level, {})
            for text in found.get("alarms", ()):
                print(f"alarm: {x['key']}, {x['law']}, {level}: {text}")
            if "error" in found:
                print(f"not judged: {x['key']}, {level}: {found['error']}")
    return out


def main() -> None:
    """Simulate, diagnose, keep, print."""
    parser = argparse.ArgumentParser(description="False alarms per hour of healthy missions.")
    parser.add_argument("--hours", type=float, default=20.0, help="time to simulate per level of evidence [h]")
    parser.add_argument("--log", type=Path, default=Path("false_alarms.jsonl"), metavar="FILE", help="results so far")
    parser.add_argument("--seeds", choices=list(POOLS), default="tuning", help="tune on one, publish the other")
    parser.add_argument("--machines", choices=("default", "varied"), default="default")
    parser.add_argument("--duration", type=float, default=240.0, help="length of a mission [s]")
    parser.add_argument("--evidence", choices=EVIDENCE, nargs="+", default=EVIDENCE)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rates")
    asked = parser.parse_args()
    seeds = POOLS[asked.seeds][: ceil(asked.hours * 3600 / asked.duration)]
    tasks = [Task(asked.seeds, asked.machines, seed, asked.duration, tuple(asked.evidence)) for seed in seeds]
    kept = asked.log.read_text(encoding="utf-8").splitlines() if asked.log.exists() else []
    done = {x["key"]: x for x in map(json.loads, kept) if set(asked.evidence) <= x["levels"].keys()}
    left = [task for task in tasks if task.key not in done]
    with ProcessPoolExecutor(asked.jobs) as pool, asked.log.open("a", encoding="utf-8") as log:
        futures = [pool.submit(run_task, task) for task in left]
        for count, future in enumerate(as_completed(futures), 1):
            found = future.result()
            done[found["key"]] = found
            log.write(json.dumps(found) + "\n")
            log.flush()
            print(f"\r{count} of {len(left)} missions   ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    rates = show([done[task.key] for task in tasks], asked.evidence)
    if asked.json:
        asked.json.write_text(json.dumps({"seeds": asked.seeds, "machines": asked.machines, **rates}, indent=1))


if __name__ == "__main__":
    main()
