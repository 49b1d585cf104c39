"""Cost of estimation and decision alone; run as `python tests/benchmarks/estimation_cost.py [--duration S …]`.

CPU seconds of one thread for four wheels at 1 kHz after the timeline and the replayed loop are there, medians of `--runs`; compiled
code is warm. Wheels and steering are told apart.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

from accuracy import EVIDENCE, signals_of

from diagnosis import assess
from diagnosis.channels.liveness import alive_sources
from diagnosis.decision.intervals import intervals_of
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.steering.assess import assess_steering
from replay.control.loop import replay_loop
from replay.machine.config import haulotte
from replay.signals.timeline import align
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission


def silent(_: str) -> None:
    return


def main() -> None:
    """Simulate, align, then time."""
    parser = argparse.ArgumentParser(description="CPU time of estimation and decision.")
    parser.add_argument("--duration", type=float, nargs="+", default=[120.0, 240.0, 480.0], help="lengths [s]")
    parser.add_argument("--scenario", nargs="+", default=["healthy", "paper"])
    parser.add_argument("--evidence", nargs="+", default=list(EVIDENCE))
    parser.add_argument("--runs", type=int, default=5)
    asked = parser.parse_args()
    machine = haulotte()
    print("scenario  evidence  length [s]   wheels [s]   steering [s]")
    for scenario in asked.scenario:
        for duration in asked.duration:
            options = SimulationOptions(scenario=scenario, seed=2, duration_s=duration, ice=0.25)
            mission = simulate_mission(options)
            for evidence in asked.evidence:
                timeline = align(signals_of(mission, evidence))
                replay = replay_loop(timeline, machine)
                counts = alive_sources(timeline)
                whole, axles = [], []
                for _ in range(asked.runs + 1):
                    begin = time.process_time()
                    found = assess.assess_components(timeline, replay, machine, machine.wheels, silent)
                    intervals_of(found.assessments, machine, HYDRAULIC, timeline.start_ns, timeline.step_ns)
                    whole.append(time.process_time() - begin)
                    begin = time.process_time()
                    assess_steering(timeline, replay, machine, counts, silent)
                    axles.append(time.process_time() - begin)
                steering = statistics.median(axles[1:])
                wheels = statistics.median(whole[1:]) - steering
                print(f"{scenario:9} {evidence:9} {duration:10g} {wheels:12.2f} {steering:14.2f}", flush=True)


if __name__ == "__main__":
    main()
