"""How often findings on axles by their model are right, by length and company: `python tests/benchmarks/calibrate_steering.py`.

Machines of the structures for tuning alone, with angle and command alone. The last line is `_WEIGHTS` of
`diagnosis.steering.reliability`: a logistic regression of what is right.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from pathlib import Path
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from numpy.typing import NDArray
from structures import Task, options_of
from variation import recorded_signals

from diagnosis.evaluation.counts import ReportOutcome
from diagnosis.evaluation.evaluate import evaluate_report
from diagnosis.evidence import Contribution
from diagnosis.pipeline import diagnose_mission
from diagnosis.steering.reliability import features_of
from replay.errors import MfhcaError
from replay.faults import FaultMode
from replay.machine.config import haulotte
from replay.mission import Mission
from replay.signals.timeline import align
from replay.simulation.run import simulate_mission

KINDS = ("valves", "pump", "torque", "random")
BANDS = (0.0, 0.3, 0.6, 0.8, 0.9, 0.95, 1.01)
_RIDGE = 0.1
Array = NDArray[np.float64]


def reports_of(kind: str, seed: int, scenario: str, duration: float) -> list[ReportOutcome]:
    """Every report on the axles of one mission, with the filters' own probability."""
    mission = simulate_mission(
        options_of(Task(kind, seed, duration, ("base",), False), scenario, int(scenario == "healthy"))
    )
    signals = recorded_signals(mission, "base")
    with (
        patch("diagnosis.steering.assess.weighed", lambda found, *_: found),
        patch("diagnosis.wheels.family.WheelEvidence.assess", lambda *_: Contribution({})),
    ):
        report = diagnose_mission(Mission(files=(), signals=signals, timeline=align(signals)), haulotte()).report
    return list(evaluate_report(report, mission.truth, kind).groups["steer"].reports)


def rows(reports: Sequence[ReportOutcome]) -> Iterator[tuple[Array, bool]]:
    """Features of each report by its model, and whether it is right."""
    for r in reports:
        if r.tier != "model" or r.outcome == "ignored" or r.severity == "info":
            continue
        mine = [o for o in reports if o.component == r.component and o is not r]
        same, other = ([(o.start_s, o.stop_s) for o in mine if (o.side == r.side) is flag] for flag in (True, False))
        yield features_of((r.start_s, r.stop_s), FaultMode(r.mode), same, other), r.outcome == "right"


def regression(x: Array, right: Array) -> Array:
    """Weights of a logistic regression with a small ridge, the constant first, by Newton's method."""
    basis, w = np.column_stack([np.ones(len(x)), x]), np.zeros(x.shape[1] + 1)
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-basis @ w))
        curvature = (basis * (p * (1.0 - p))[:, None]).T @ basis + _RIDGE * np.eye(w.size)
        w = w + np.linalg.solve(curvature, basis.T @ (right - p) - _RIDGE * w)
    return np.asarray(w)


def main() -> None:
    """Simulate, diagnose, count, fit, print."""
    parser = argparse.ArgumentParser(description="Reliability of findings on axles, machines for tuning.")
    parser.add_argument("--first", type=int, default=30, help="first seed, below 1000")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--duration", type=float, default=120.0, help="length of a mission [s]")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.count)
    if seeds.stop > 1000:
        parser.error("seeds from 1000 on are kept for figures that are published")
    found: list[tuple[Array, bool]] = []
    for seed, kind in product(seeds, KINDS):
        for scenario in ("random", "healthy") if seed % 3 == 0 else ("random",):
            try:
                found += rows(reports_of(kind, seed, scenario, asked.duration))
            except MfhcaError as error:
                print(f"{kind} {seed}: {error}")
        print(f"\r{len(found)} findings", end="", file=sys.stderr, flush=True)
    x, right = np.array([f for f, _ in found]), np.array([float(r) for _, r in found])
    w = regression(x, right)
    p = 1.0 / (1.0 + np.exp(-w[0] - x @ w[1:]))
    for low, high in pairwise(BANDS):
        mine = (p >= low) & (p < high)
        if mine.any():
            print(f"stated {low:.2f}–{min(high, 1.0):.2f}: {mine.sum():4d} findings, right {right[mine].mean():.3f}")
    print("weights:", ", ".join(f"{value:.2f}" for value in w))


if __name__ == "__main__":
    main()
