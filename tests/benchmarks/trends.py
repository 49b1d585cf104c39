"""How often the forecast of ε is right on simulated fleets: `python tests/benchmarks/trends.py [--first 2000] [--count 20]`.

A seed is a fleet of 60 series per kind. The truth is a line per stretch; each mission adds scatter of its own and an
estimate with 95 % bounds. Counted over forecasts that were made: the 90 % interval holds the true time of crossing (aim
85–95 %; "not within N" holds where the truth is later). Tune on seeds below 1000, report from 2000 on.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.audit.trends.trend import Series, Trend, trend_of

LIMIT = 0.1
KINDS = ("line", "outliers", "repair", "repair and outliers", "bend", "flat", "heavy tails")
SERIES = 60


@dataclass(frozen=True)
class Case:
    """A simulated series, what is true, and the mission of its last change."""

    series: Series
    crossing: float  # from now, driving hours; inf where never
    last: int


def case(kind: str, rng: np.random.Generator) -> Case:
    """One machine's part over 6 to 60 missions."""
    n = int(rng.integers(8, 61)) if "repair" in kind or kind == "bend" else int(rng.integers(6, 61))
    hours = rng.lognormal(np.log(0.5), 0.6, n)
    x = np.cumsum(hours) - hours / 2
    now = float(hours.sum())
    last = int(rng.integers(n // 3, n - 4)) if "repair" in kind or kind == "bend" else 0
    begin = float(x[last - 1] + x[last]) / 2 if last else 0.0
    level = rng.uniform(0.0, 0.04)
    crossing = now * rng.uniform(0.05, 1.5)
    slope = 0.0 if kind == "flat" else (LIMIT - level) / (now + crossing - begin)
    truth = level + slope * (x - begin)
    if "repair" in kind:
        truth[:last] = rng.uniform(0.05, 0.12) + rng.uniform(0.05, 0.3) * (x[:last] / begin)
    if kind == "bend":
        truth[:last] = level
    tau, sigma = rng.choice([0.0, 0.005, 0.01, 0.02]), rng.uniform(0.003, 0.02) * rng.lognormal(0.0, 0.4, n)
    scatter = rng.standard_t(4, n) / np.sqrt(2) if kind == "heavy tails" else rng.standard_normal(n)
    value = truth + tau * scatter + sigma * rng.standard_normal(n)
    if "outliers" in kind:
        where = rng.choice(n, int(rng.integers(1, 3)), replace=False)
        value[where] += rng.choice([-1, 1], where.size) * rng.uniform(0.1, 0.4, where.size)
    series = Series(x, value, value - 1.96 * sigma, value + 1.96 * sigma, now)
    return Case(series, np.inf if kind == "flat" else crossing, last)


def holds(trend: Trend, crossing: float) -> bool:
    """Whether a forecast is right."""
    f = trend.forecast
    if f.state == "above":
        return crossing <= 0
    if f.state == "not_within":
        return crossing > f.horizon
    return f.soonest is not None and f.soonest <= crossing and (f.latest is None or crossing <= f.latest)


def main() -> None:
    """Simulate, forecast, count, print."""
    parser = argparse.ArgumentParser(description="Coverage of the forecast's 90 % interval.")
    parser.add_argument("--first", type=int, default=2000, help="first seed; below 1000 for tuning")
    parser.add_argument("--count", type=int, default=20)
    asked = parser.parse_args()
    print(f"seeds {asked.first}–{asked.first + asked.count - 1}, {SERIES} series of each kind per seed")
    head = ("forecasts", "right", "closed", "too early", "too late", "unknown", "above", "cut", "set aside")
    print(f"{'':22}" + "".join(f"{h:>11}" for h in head))
    total: Counter[str] = Counter()
    for kind in KINDS:
        counts: Counter[str] = Counter()
        for seed in range(asked.first, asked.first + asked.count):
            rng = np.random.default_rng([seed, KINDS.index(kind)])
            for _ in range(SERIES):
                c = case(kind, rng)
                count(trend_of(c.series, LIMIT), c, counts)
        report(kind, counts)
        total += counts
    report("all", total)


def count(trend: Trend, c: Case, counts: Counter[str]) -> None:
    """What became of one series."""
    f = trend.forecast
    counts["series"] += 1
    counts["cut"] += bool(trend.changes)
    counts["set aside"] += bool(trend.outliers)
    if f.state == "not_known":
        counts["unknown"] += 1
        return
    counts["made"] += 1
    counts["right"] += holds(trend, c.crossing)
    counts["above"] += f.state == "above"
    counts["closed"] += f.latest is not None
    # "too early": the interval ends before the truth; "too late": it begins after it
    counts["early"] += f.state == "above" or (f.latest is not None and c.crossing > f.latest)
    counts["late"] += (f.state == "not_within" and c.crossing <= f.horizon) or (
        f.soonest is not None and c.crossing < f.soonest
    )


def report(kind: str, c: Counter[str]) -> None:
    """Print one row."""
    made, series = max(c["made"], 1), c["series"]
    shares = [c["right"] / made, c["closed"] / made, c["early"] / made, c["late"] / made]
    shares += [c["unknown"] / series, c["above"] / made, c["cut"] / series, c["set aside"] / series]
    print(f"{kind:22}{c['made']:>11}" + "".join(f"{s:>11.3f}" for s in shares), flush=True)


if __name__ == "__main__":
    main()
