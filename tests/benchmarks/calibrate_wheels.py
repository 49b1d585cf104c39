"""Fits the weights of `diagnosis.wheels.calibration`; run as `python tests/benchmarks/calibrate_wheels.py RUNS [--fit]`.

``--collect`` simulates machines (the default one, varied ones, those of structures of kind ``tuning`` and of structures drawn
at random; seeds below 1000), diagnoses them by wheel openings and speeds with and without a machine file, and appends the
features of every run with what was true of it to the file RUNS. ``--fit`` fits the weights to RUNS and writes them.
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from accuracy import signals_of
from numpy.typing import NDArray
from scipy.optimize import minimize
from structures import Task, machine_for, options_of, recorded_signals

import diagnosis.wheels.findings as wheel_findings
from diagnosis.pipeline import diagnose_mission
from diagnosis.wheels.calibration import CLASSES, features
from diagnosis.wheels.isolation import Run, RunVerdict
from replay.errors import MfhcaError
from replay.machine.config import Machine
from replay.mission import Mission
from replay.signals.timeline import align
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

Array = NDArray[np.float64]

WEIGHTS = Path(__file__).resolve().parents[2] / "diagnosis" / "wheels" / "calibration.json"
SECONDS = 13  # place of log(seconds) among the features
_RIDGE = 10.0
_SHORT_S = 0.5
_HELD_OUT = 5  # every fifth machine


@dataclass(frozen=True)
class Mission1:
    """One mission to learn from."""

    group: str
    seed: int
    mission: SimulatedMission
    machine: Machine


KINDS = ("own", "random", "valves", "pump", "torque")


def missions(kinds: Sequence[str], first: int, count: int, duration: float, *, fit: bool) -> Iterator[Mission1]:
    """Missions of many machines."""
    for seed in range(first, first + count):
        for scenario, k in (("random", 0), ("healthy", 1)):
            for name in kinds:
                task = Task(name, seed, duration, ("base",), fit)
                if name == "own" and fit:
                    continue
                try:
                    simulated = simulate_mission(
                        _own(seed, scenario, duration) if name == "own" else options_of(task, scenario, k)
                    )
                    yield Mission1(name, seed, simulated, _machine_of(task))
                except MfhcaError as error:
                    print(f"\n{name} {seed}: {error}")


def _own(seed: int, scenario: str, duration: float) -> SimulationOptions:
    """A mission of the default machine, on the ground or in the air, with and without ice."""
    return SimulationOptions(
        scenario="random" if scenario == "random" else "healthy",
        seed=seed,
        duration_s=duration,
        coupling="ground" if seed % 3 else "free",
        ice=0.25 if seed % 4 == 1 else 0.0,
    )


@lru_cache(maxsize=8)
def _machine_of(task: Task) -> Machine:
    """Machine file of a task; the law that the controller follows is of no use here, and takes time."""
    machine = machine_for(task, "base")
    return replace(machine, control=replace(machine.control, law="none"))


def runs_of(one: Mission1) -> list[tuple[list[float], int, int]]:
    """Features, class, and path model of all runs of one mission."""
    judged: list[tuple[str, float, float, Run]] = []
    judge = wheel_findings.judge

    def recorded(run: Run, y: Array, model, limits, names, dt, *, gains) -> RunVerdict:  # type: ignore[no-untyped-def]
        judged.append((names[0].split(".")[1], run.start * dt, run.stop * dt, run))
        return judge(run, y, model, limits, names, dt, gains=gains)

    wheel_findings.judge = recorded
    try:
        signals = recorded_signals(one.mission, "base") if one.group != "own" else signals_of(one.mission, "base")
        diagnose_mission(Mission(files=(), signals=signals, timeline=align(signals)), one.machine)
    finally:
        wheel_findings.judge = judge
    out = []
    for wheel, start, stop, run in judged:
        truth = true_class(one.mission, wheel, start, stop, run.model)
        if truth is not None:
            out.append((features(run.model, run.evidence, run.context).tolist(), truth, run.model))
    return out


def true_class(mission: SimulatedMission, wheel: str, start: float, stop: float, model: int) -> int | None:
    """Class that holds in most of a run; where both sides are faulty, that of the path's side; None where neither half is."""
    from diagnosis.wheels.models import A_GAIN

    side = "actuator" if model >= A_GAIN else "sensor"
    shares: dict[int, float] = {}
    for t in mission.truth.intervals:
        if t.component == wheel:
            shared = max(0.0, min(stop, t.stop_s) - max(start, t.start_s))
            row = next(k for k, r in enumerate(CLASSES) if r is not None and r == (t.side, t.mode))
            shares[row] = shares.get(row, 0.0) + shared
    length = max(stop - start, 1e-6)
    holding = [k for k, s in shares.items() if s >= 0.5 * length]
    if not holding:
        return 0
    own = [k for k in holding if CLASSES[k] is not None and CLASSES[k][0].value == side]  # type: ignore[index]
    if length < _SHORT_S and not own:  # a flicker of one side while the other is faulty
        return 0
    return max(own or holding, key=lambda k: shares[k])


def collect(file: Path, kinds: Sequence[str], first: int, count: int, duration: float, *, fit: bool) -> None:
    """Append runs to a file, one mission per line."""
    with file.open("a") as out:
        for number, one in enumerate(missions(kinds, first, count, duration, fit=fit)):
            try:
                runs = runs_of(one)
            except MfhcaError as error:
                print(f"\n{one.group} {one.seed}: {error}")
                continue
            row = {"group": one.group, "seed": one.seed, "fit": fit, "runs": runs}
            out.write(json.dumps(row) + "\n")
            out.flush()
            print(f"\r{number} missions ", end="", file=sys.stderr, flush=True)


def loaded(file: Path) -> tuple[Array, NDArray[np.int64], NDArray[np.int64], Array]:
    """Features, classes, number of the machine, and weight of each run: its seconds; twenty runs of one kind in a mission count."""
    x, y, machine, weight = [], [], [], []
    numbers: dict[tuple[str, int], int] = {}
    for line in file.read_text().splitlines():
        row = json.loads(line)
        number = numbers.setdefault((row["group"], row["seed"]), len(numbers))
        kinds: dict[tuple[int, int], int] = {}
        for _, truth, model in row["runs"]:
            kinds[truth, model] = kinds.get((truth, model), 0) + 1
        for values, truth, model in row["runs"]:
            x.append(values)
            y.append(truth)
            machine.append(number)
            seconds = float(np.exp(values[SECONDS]))
            weight.append(min(1.0, 20 / kinds[truth, model]) * min(max(seconds, 0.25), 6.0))
    return np.array(x), np.array(y), np.array(machine), np.array(weight)


def fitted(x: Array, y: NDArray[np.int64], weight: Array) -> tuple[Array, Array, Array]:
    """Centre, scale and weights of the logistic model by penalised likelihood."""
    centre, scale = x.mean(axis=0), np.maximum(x.std(axis=0), 1e-3)
    z = np.c_[np.clip((x - centre) / scale, -6, 6), np.ones(len(x))]
    classes = len(CLASSES)
    hot = np.eye(classes)[y]

    def loss(flat: Array) -> tuple[float, Array]:
        w = flat.reshape(classes, -1)
        score = z @ w.T
        score -= score.max(axis=1, keepdims=True)
        p = np.exp(score)
        p /= p.sum(axis=1, keepdims=True)
        value = -float((weight * np.log(np.maximum(p[np.arange(len(y)), y], 1e-12))).sum())
        grad = ((p - hot) * weight[:, None]).T @ z
        kept = w.copy()
        kept[:, -1] = 0.0
        return value + 0.5 * _RIDGE * float((kept**2).sum()), (grad + _RIDGE * kept).ravel()

    found = minimize(loss, np.zeros(classes * z.shape[1]), jac=True, method="L-BFGS-B", options={"maxiter": 800})
    return centre, scale, found.x.reshape(classes, -1)


def probabilities(x: Array, centre: Array, scale: Array, weights: Array) -> Array:
    """As `Calibration.probabilities`, for many runs."""
    score = np.c_[np.clip((x - centre) / scale, -6, 6), np.ones(len(x))] @ weights.T
    p = np.exp(score - score.max(axis=1, keepdims=True))
    return np.asarray(p / p.sum(axis=1, keepdims=True))


def report(p: Array, y: NDArray[np.int64], weight: Array) -> None:
    """How often what is said with a probability is right, on machines that were held out."""
    best = p.argmax(axis=1)
    for low, high in ((0.4, 0.6), (0.6, 0.7), (0.7, 0.8), (0.8, 0.9), (0.9, 0.97), (0.97, 1.01)):
        at = (best != 0) & (p.max(axis=1) >= low) & (p.max(axis=1) < high)
        total = weight[at].sum()
        right = (weight * (best == y))[at].sum() / max(total, 1e-9)
        healthy = (weight * (y == 0))[at].sum() / max(total, 1e-9)
        print(f"p {low:.2f}–{high:.2f}: {total:7.0f} runs, right {right:.3f}, truly healthy {healthy:.3f}")
    for k, row in enumerate(CLASSES):
        at, mine = y == k, best == k
        both = (weight * (at & mine)).sum()
        name = "healthy" if row is None else f"{row[0].value} {row[1].value}"
        print(
            f"{name:<22} recall {both / max((weight * at).sum(), 1e-9):.3f} precision {both / max((weight * mine).sum(), 1e-9):.3f} of {(weight * at).sum():.0f}"
        )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("runs", type=Path, help="file of collected runs, one mission per line")
    parser.add_argument("--collect", type=int, default=0, metavar="N", help="machines of each kind to simulate")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--first", type=int, default=100, help="first seed")
    parser.add_argument("--duration", type=float, default=120.0, help="length of a mission [s]")
    parser.add_argument(
        "--machine-file", action="store_true", help="collect with machine files fitted from healthy missions"
    )
    parser.add_argument("--fit", action="store_true", help="fit the weights and write them")
    choice = parser.parse_args(arguments)
    warnings.filterwarnings("ignore")
    if choice.collect:
        collect(choice.runs, choice.kinds, choice.first, choice.collect, choice.duration, fit=choice.machine_file)
    if choice.fit:
        x, y, machine, weight = loaded(choice.runs)
        held = machine % _HELD_OUT == 0
        report(probabilities(x[held], *fitted(x[~held], y[~held], weight[~held])), y[held], weight[held])
        centre, scale, weights = fitted(x, y, weight)
        data = {"centre": centre, "scale": scale, "weights": weights}
        text = {key: np.round(value, 5).tolist() for key, value in data.items()}
        WEIGHTS.write_text(json.dumps(text) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
