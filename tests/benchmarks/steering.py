"""Scores of the steering diagnosis on simulated missions; run as `python tests/benchmarks/steering.py --seeds reporting`.

Limits may be tuned on seeds below 1000 alone; published figures come from ``--seeds reporting``, which no choice has
seen. ``--vary`` draws the steering's gain, rate limit, lag and noise and the log's rate anew for every seed.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.channels.liveness import alive_sources
from diagnosis.decision.intervals import intervals_of, spans_of
from diagnosis.evaluation.counts import COLUMNS, TRUE_STATES, Counts, add
from diagnosis.evaluation.evaluate import evaluate_report
from diagnosis.evaluation.scores import figures
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import to_json
from diagnosis.steering.assess import SteeringResult, assess_steering
from replay.control.loop import replay_loop
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline, align
from replay.simulation.options import PlantOptions, SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

FIRST = {"tuning": 0, "reporting": 2000}
_LACKS: dict[str, tuple[str, ...]] = {
    "direct": (),
    "spool": ("_true",),
    "angle": (".u_applied",),
    "base": ("_true", ".u_applied", "imu.yaw_rate", "gnss.lat", "gnss.lon"),
}


def options_of(seed: int, scenario: str, duration: float, rate: float, vary: bool) -> SimulationOptions:
    """Mission of a seed."""
    options = SimulationOptions(
        scenario=scenario,  # type: ignore[arg-type]
        seed=seed,
        duration_s=duration,
        rate_hz=rate,
        evidence="direct",
        steering_faults=True,
    )
    if not vary:
        return options
    rng = np.random.default_rng([seed, 77])
    plant = PlantOptions(
        steer_gain=float(rng.choice([1.5, 2.5, 4.0, 6.0])),
        steer_rate=float(rng.choice([0.2, 0.25, 0.35, 0.5])),
        steer_lag=float(rng.choice([0.02, 0.05, 0.1, 0.2])),
        phi_std=float(rng.choice([0.0001, 0.0003, 0.0005, 0.001, 0.002])),
        phi_lsb=float(rng.choice([0.0001, 0.0004, 0.001])),
    )
    return replace(options, plant=plant, rate_hz=float(rng.choice([100.0, 200.0, 500.0, 1000.0])))


def timeline_of(mission: SimulatedMission, evidence: str) -> Timeline:
    """Signals as a log with less evidence would give them, on one axis."""
    columns = [(name, mission.stamps, values) for name, values in mission.columns.items()]
    columns += [(name, group.stamps, values) for group in mission.slow for name, values in group.columns.items()]
    items = {
        name: Signal(name, stamps, values, SignalSource(column=name), "simulated", guessed=False)
        for name, stamps, values in columns
        if not name.endswith(_LACKS[evidence])
    }
    return align(Signals(items=items, missing={}))


def judge(mission: SimulatedMission, evidence: str) -> tuple[SteeringResult, Timeline, float]:
    """Steering of a mission, its time axis, and the seconds that judging took."""
    machine = haulotte()
    timeline = timeline_of(mission, evidence)
    replayed = replay_loop(timeline, machine)
    begin = time.perf_counter()
    result = assess_steering(timeline, replayed, machine, alive_sources(timeline), lambda _: None)
    return result, timeline, time.perf_counter() - begin


def counts_of(mission: SimulatedMission, result: SteeringResult, timeline: Timeline) -> Counts:
    """What the steering's assessments got right; a wheel stands in, since a report without wheels is refused."""
    machine = haulotte()
    wheel = {"component": "FR", "state": "healthy", "start_s": 0.0, "stop_s": timeline.size * timeline.dt}
    intervals = intervals_of(result.assessments, machine, HYDRAULIC, timeline.start_ns, timeline.step_ns)
    report = to_json(
        {
            "log": {"start_ns": timeline.start_ns, "duration_s": timeline.size * timeline.dt},
            "intervals": list(intervals),
            "states": list(spans_of(result.assessments, timeline.step_ns)),
        }
    )
    report["states"] += [wheel | {"side": side} for side in ("sensor", "actuator")]
    return evaluate_report(report, mission.truth).groups["steer"]


def number(value: float | None, digits: int = 3, scale: float = 1.0) -> str:
    return "–" if value is None else f"{value * scale:.{digits}f}"


def show(name: str, found: dict[str, Any], total: Counts, detail: bool) -> Iterator[str]:
    yield name
    for side, s in found["sides"].items():
        recall = "  ".join(f"{row} {number(v['recall'], 2)}" for row, v in s["rows"].items())
        yield (
            f"  {side:9} balanced {number(s['balanced_accuracy'])} (decided {number(s['balanced_accuracy_decided'])}, "
            f"share {number(s['decided_share'], 2)})  macro-F1 {number(s['macro_f1'])}   recall {recall}"
        )
        if detail:
            for row, seconds in zip(TRUE_STATES, total.seconds[side], strict=True):
                cells = "  ".join(f"{c} {x:.1f}" for c, x in zip(COLUMNS, seconds, strict=True) if x > 0)
                yield f"      {row:12} {cells}"
    onset, alarms = found["onset_error_s"], found["false_alarms"]
    yield (
        f"  onset median {number(onset['median'], 1, 1e3)} ms, p95 {number(onset['p95'], 0, 1e3)} ms; events F1 "
        f"{number(found['events']['f1'])}; ε {number(found['epsilon']['mae'])}; false alarms {alarms['count']} in "
        f"{number(alarms['healthy_h'], 2)} healthy h"
    )
    for m in found["modes"] if detail else ():
        error = m["onset_error_s"]
        yield (
            f"    {m['side']:9} {m['mode']:12} {m['right']:4} of {m['faults']:4} events, ε {number(m['epsilon_mae'])}, "
            f"onset {number(error['median'], 1, 1e3)} ms (p95 {number(error['p95'], 0, 1e3)})"
        )


def main() -> None:
    """Simulate, judge, score, print."""
    parser = argparse.ArgumentParser(description="Scores of the steering diagnosis on simulated missions.")
    parser.add_argument("--seeds", choices=list(FIRST), default="tuning", help="tune on one, publish the other")
    parser.add_argument("--first", type=int, help="first seed, within the choice")
    parser.add_argument("--count", type=int, default=10, help="number of seeds")
    parser.add_argument("--duration", type=float, default=240.0, help="length of a mission [s]")
    parser.add_argument("--rate", type=float, default=1000.0, help="recorded rate [Hz]")
    parser.add_argument("--evidence", choices=list(_LACKS), nargs="+", default=["base"])
    parser.add_argument("--scenario", choices=("random", "healthy", "paper"), default="random")
    parser.add_argument("--vary", action="store_true", help="another plant, noise and rate for every seed")
    parser.add_argument("--detail", action="store_true", help="confusions and every mode")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    asked = parser.parse_args()
    first = FIRST[asked.seeds] + (asked.first or 0)
    parts: dict[str, list[Counts]] = {e: [] for e in asked.evidence}
    spent: dict[str, list[float]] = {e: [] for e in asked.evidence}
    for seed in range(first, first + asked.count):
        mission = simulate_mission(options_of(seed, asked.scenario, asked.duration, asked.rate, asked.vary))
        for evidence in asked.evidence:
            result, timeline, seconds = judge(mission, evidence)
            parts[evidence].append(counts_of(mission, result, timeline))
            spent[evidence].append(seconds)
    document = {}
    for evidence in asked.evidence:
        total = add(parts[evidence])
        found = figures(total)
        document[evidence] = found
        name = f"{evidence}, {asked.scenario}, seeds {first}–{first + asked.count - 1}, {asked.duration:g} s"
        print("\n".join(show(name, found, total, asked.detail)))
        print(f"  judging takes {np.median(spent[evidence]):.2f} s in the median mission", flush=True)
    if asked.json:
        asked.json.write_text(json.dumps(document, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
