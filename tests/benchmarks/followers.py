"""Scores of command response on simulated machines of every structure; `python tests/benchmarks/followers.py --seeds reporting`.

Missions of 150 s with nothing but commands and wheel speeds, as velocity-controlled robots log them: healthy ones, for false alarms, and
ones with random faults of sensors and valves. A finding above info is right where it names wheel and side of a fault that is there (or
both sides); a sensor's fault of more than two seconds is found where anything is said of its wheel at that time.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from variation import recorded_signals

from diagnosis.pipeline import diagnose_signals
from diagnosis.results.document import IntervalRow
from replay.machine.config import haulotte
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import STRUCTURES, StructureOptions
from replay.truth import TruthInterval

FIRST = {"tuning": 10, "reporting": 2000}
DURATION_S, SENSOR_S, SLACK_S = 150.0, 2.0, 0.5


def judged(scenario: str, structure: str, seed: int, rate: float) -> tuple[SimulatedMission, list[IntervalRow], float]:
    """A mission, what is said of its wheels, and the least share of driving in which a speed sensor was judged."""
    made = None if structure == "default" else StructureOptions(structure, seed)
    mission = simulate_mission(
        SimulationOptions(scenario=scenario, seed=seed, duration_s=DURATION_S, rate_hz=rate, structure=made)
    )
    signals = recorded_signals(mission, "base")
    kept = {
        k: s for k, s in signals.items.items() if k.startswith("cmd.") or (k.startswith("wheel.") and k.endswith(".v"))
    }
    machine = haulotte()
    report = diagnose_signals(replace(signals, items=kept), machine).report
    told = [i for i in report["intervals"] if i["severity"] != "info" and i["component"] in machine.wheels]
    shares = [
        c["decided_driving_s"] / max(c["driving_s"], 1e-9)
        for c in report["coverage"]
        if c["side"] == "sensor" and c["component"] in machine.wheels
    ]
    return mission, told, min(shares)


def _meet(f: TruthInterval, i: IntervalRow) -> bool:
    return f.component == i["component"] and f.start_s - SLACK_S < i["stop_s"] and f.stop_s + SLACK_S > i["start_s"]


def scores(mission: SimulatedMission, told: list[IntervalRow]) -> Counter[str]:
    """Findings that are right and wrong, and faults of sensors that are found."""
    out: Counter[str] = Counter()
    for i in told:
        met = [f for f in mission.truth.intervals if _meet(f, i)]
        right = any(i["side"] in (f.side, "sensor_or_actuator") for f in met)
        out["right" if right else "wrong"] += 1
        if i["probability"] > 0.9:
            out["sure right" if right else "sure wrong"] += 1
        if i["severity"] == "high":
            out["high right" if right else "high wrong"] += 1
    for f in mission.truth.intervals:
        if f.side == "sensor" and f.kind == "wheel" and f.stop_s - f.start_s > SENSOR_S:
            out[f"{f.mode} of"] += 1
            out[f"{f.mode} found"] += any(_meet(f, i) for i in told)
    return out


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", choices=FIRST, default="tuning")
    parser.add_argument("--count", type=int, default=2, help="missions of each structure and rate")
    parser.add_argument("--rates", type=float, nargs="+", default=[50.0, 200.0], help="[Hz]")
    args = parser.parse_args()
    total: Counter[str] = Counter()
    alarms, hours, least = 0, 0.0, 1.0
    for structure in ("default", *STRUCTURES):
        for seed in range(FIRST[args.seeds], FIRST[args.seeds] + args.count):
            for rate in args.rates:
                _, told, share = judged("healthy", structure, seed, rate)
                alarms, hours, least = alarms + len(told), hours + DURATION_S / 3600.0, min(least, share)
                mission, told, _ = judged("random", structure, seed, rate)
                total += scores(mission, told)
        print(
            f"{structure}: {hours:.2f} h healthy, {alarms} alarms, judged of driving at least {100 * least:.0f} %; {dict(total)}"
        )


if __name__ == "__main__":
    main()
