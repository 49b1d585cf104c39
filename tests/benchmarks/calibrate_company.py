"""How often rows are right by what else their mission shows: `python tests/benchmarks/calibrate_company.py`.

Missions of `all_clear.py` with every row as probable as its own evidence states it. The last line is `_WEIGHTS` of `diagnosis.decision.company`: a
logistic regression of what is right among rows stated with less than .9, in which the machines that the method was made on, ``default`` and
``foreign``, weigh as much as all others together.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from all_clear import run, tasks_of
from campaign import Outcome, Task
from numpy.typing import NDArray
from scipy.optimize import minimize

from diagnosis.decision.company import Told, features_of

KNOWN = ("default", "foreign")
_SURELY, _RIDGE = 0.9, 0.5
_FINDING = re.compile(r"(\S+) (\S+ \S+) p \S+ \w+ ([\d.]+)-([\d.]+) s")
Array = NDArray[np.float64]


def run_alone(task: Task) -> list[Outcome]:
    """Outcomes of one mission without the step that is fitted."""
    with patch("diagnosis.decision.intervals.in_company", tuple):
        return run(task)


def rows(outcome: Outcome) -> Iterator[tuple[float, Array, bool]]:
    """Stated probability, features, and whether it is right, of each row of one report that counts."""
    found = [m for m in map(_FINDING.fullmatch, outcome.findings) if m]
    told = [Told(m[1], m[2], float(m[3]), float(m[4])) for m in found]
    for (p, right), own in zip(outcome.claims, told, strict=False):
        if p < _SURELY:
            yield p, features_of(own, told), right


def fitted(x: Array, right: Array, weight: Array) -> Array:
    """Weights of the logistic regression, the constant first; a ridge draws the logit's to 1 and the others to 0."""
    drawn = np.eye(x.shape[1])[1]

    def loss(w: Array) -> float:
        away = float(np.sum((w - drawn) ** 2))
        return float(np.sum(weight * np.logaddexp(0.0, (1.0 - 2.0 * right) * (x @ w)))) + _RIDGE * away

    return np.asarray(minimize(loss, drawn).x)


def fit(outcomes: Sequence[Outcome]) -> None:
    """Count, fit, print."""
    found = [(o.machine in KNOWN, *row) for o in outcomes for row in rows(o)]
    known, right = (np.array([float(f[k]) for f in found]) for k in (0, 3))
    stated = np.clip([f[1] for f in found], 0.02, 0.98)
    seen = np.array([f[2] for f in found])
    x = np.column_stack([np.ones(len(found)), np.log(stated / (1.0 - stated)), seen])
    each = [max(known.sum(), 1.0), max((1.0 - known).sum(), 1.0)]
    weight = 0.5 * len(found) * np.where(known > 0.0, 1.0 / each[0], 1.0 / each[1])
    w = fitted(x, right, weight)
    for name, which in (("default, foreign", known > 0.0), ("others", known == 0.0)):
        if which.any():
            p = 1.0 / (1.0 + np.exp(-x[which] @ w))
            print(
                f"{name}: {which.sum()} rows, right {right[which].mean():.3f}, stated {stated[which].mean():.3f}, fitted {p.mean():.3f}"
            )
    print("weights:", ", ".join(f"{value:.2f}" for value in w))


def main() -> None:
    """Simulate, judge, fit."""
    parser = argparse.ArgumentParser(description="Probabilities of rows by what else a mission shows.")
    parser.add_argument("--machine", nargs="+", default=list(KNOWN))
    parser.add_argument("--first", type=int, default=0, help="added to the first seed of those for tuning")
    parser.add_argument("--every", type=int, default=12, help="one of so many kinds of trouble")
    parser.add_argument("--offset", type=int, default=0)
    parser.add_argument("--duration", type=float, default=75.0, help="length of a mission [s]")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every outcome")
    parser.add_argument("--read", type=Path, nargs="+", metavar="FILE", help="run nothing: fit to what --json wrote")
    asked = parser.parse_args()
    if asked.read:
        lines = [line for file in asked.read for line in file.read_text().splitlines()]
        return fit([Outcome(**json.loads(line)) for line in lines])
    tasks = tasks_of("tuning", asked.machine, asked.duration, asked.every, 0, asked.first, None, asked.offset)
    outcomes = []
    with ProcessPoolExecutor(asked.jobs) as pool:
        for done, batch in enumerate(pool.map(run_alone, tasks), 1):
            outcomes += batch
            print(f"\r{done} of {len(tasks)} missions   ", end="", file=sys.stderr, flush=True)
    if asked.json:
        asked.json.write_text("".join(json.dumps(asdict(o)) + "\n" for o in outcomes))
    return fit(outcomes)


if __name__ == "__main__":
    main()
