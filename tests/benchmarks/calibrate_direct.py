"""How often findings of direct evidence are right, by stated probability and length: `python tests/benchmarks/calibrate_direct.py`.

Tuning missions alone. `_LAPSE` and `_COARSE_S` of `diagnosis.direct.stated_row` follow from the last two columns: the share of
findings at the raw rate that are not what they seem, and the length at which half of the valve findings in a log too slow
for its commands are.
"""

from __future__ import annotations

import argparse
import sys
from itertools import pairwise, product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from accuracy import Task, run_task

from diagnosis.evaluation.counts import ReportOutcome

LENGTHS = (0.0, 0.3, 1.0, 2.0, 4.0, float("inf"))
BANDS = (0.0, 0.45, 0.55, 0.9, 0.98, 1.01)


def reports_of(rate: float, seeds: range, duration: float) -> list[ReportOutcome]:
    """Every report on wheels of the missions of one rate that counts."""
    out = []
    for seed, scenario in product(seeds, ("paper", "random")):
        counts = run_task(Task(scenario, "ground", 0.25, seed, duration, rate, ("direct",)))["direct"]
        if isinstance(counts, str):
            raise SystemExit(counts)
        out += [r for r in counts["wheel"].reports if r.outcome != "ignored"]
    return out


def line(name: str, chosen: list[ReportOutcome]) -> None:
    """One row, where there is something to say."""
    if chosen:
        right = sum(r.outcome == "right" for r in chosen) / len(chosen)
        stated = sum(r.probability for r in chosen) / len(chosen)
        print(f"{name:32}{len(chosen):6} reports, right {right:.3f}, stated {stated:.3f}")


def main() -> None:
    """Simulate, diagnose, count, print."""
    parser = argparse.ArgumentParser(description="Reliability of direct evidence on tuning missions.")
    parser.add_argument("--rate", type=float, nargs="+", default=[1000.0, 500.0, 200.0, 100.0])
    parser.add_argument("--first", type=int, default=20, help="first seed, below 1000")
    parser.add_argument("--count", type=int, default=6)
    parser.add_argument("--duration", type=float, default=120.0, help="length of a mission [s]")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.count)
    if seeds.stop > 1000:
        parser.error("seeds from 1000 on are kept for figures that are published")
    for rate in asked.rate:
        reports = reports_of(rate, seeds, asked.duration)
        for side in ("sensor", "actuator"):
            mine = [r for r in reports if r.side == side]
            line(f"{rate:g} Hz, {side}", mine)
            for low, high in pairwise(LENGTHS):
                line(f"    {low:g} to {high:g} s", [r for r in mine if low <= r.stop_s - r.start_s < high])
            for low, high in pairwise(BANDS):
                line(f"    stated {low:g} to {high:g}", [r for r in mine if low <= r.probability < high])


if __name__ == "__main__":
    main()
