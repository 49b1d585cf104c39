"""Trains the trees of `diagnosis.wheels.forest`; run as `python tests/benchmarks/train_wheels.py FOLDER [--collect N] [--fit LOOK]`.

``--collect`` simulates machines (the default one, varied ones, those of structures of kind ``tuning`` and of structures drawn
at random; seeds below 1000), runs the Kalman models over their wheels' openings and speeds, and writes the features of every
half second with what was true of it to FOLDER, a file per mission. ``--fit first`` trains on four of five seeds below 500, says
how often the trees are right on the fifth, and writes them; ``--fit second`` does the same for the second look, by the seeds
from 500 on, whose missions are collected when the first is there: it learns what the first says of machines that it does not
know. Training needs lightgbm (``pip install lightgbm``).
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from accuracy import signals_of
from numpy.typing import NDArray
from structures import Task, options_of
from variation import recorded_signals, varied_options

import diagnosis.wheels.assess as wheel_assess
from diagnosis.pipeline import diagnose_mission
from diagnosis.wheels.blocks import blocks_of
from diagnosis.wheels.filter_identification import joint_model
from diagnosis.wheels.following import follow
from diagnosis.wheels.forest import Look
from diagnosis.wheels.frames.features import mission_features
from diagnosis.wheels.frames.said import said_features
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.looks import first_look
from diagnosis.wheels.readings import with_readings
from diagnosis.wheels.tracks import MODES
from replay.errors import MfhcaError
from replay.faults import FaultSpec, Side, drawn_modes
from replay.machine.config import Limits, haulotte
from replay.mission import Mission
from replay.signals.timeline import align
from replay.simulation.options import SIMULATED_LAWS, SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.schedule import draw_fault
from replay.truth import MissionTruth

Array = NDArray[np.float64]
TREES = Path(__file__).resolve().parents[2] / "diagnosis" / "wheels" / "forests.npz"
KINDS = ("random", "own", "vary", "valves", "pump", "torque")
HELD_OUT = 5  # every fifth seed
SECOND_FROM = 500  # seeds of the second look
_EVERY = 2  # of the frames: neighbours hardly differ
_EDGE_S = 0.15  # around an edge of a fault nothing is learned
_OWN_SCHEDULE, _VALVES, _BOTH, _RAMPS = 0.65, 0.75, 1 / 7, 0.2
_WITHOUT_REFERENCE, _WITHOUT_GEOMETRY = 0.12, 0.12
_OTHER_LAW = 0.5
_WEIGHTS = np.array([0.5, 1.0, 1.0, 1.0, 1.0])  # of frames, by class: healthy ones are many
_MEASURED = 539  # column that tells whether the valve's opening is measured
_SETTINGS: dict[str, Any] = {
    "objective": "multiclass",
    "num_class": len(MODES) + 1,
    "learning_rate": 0.07,
    "num_leaves": 31,
    "min_data_in_leaf": 200,
    "feature_fraction": 0.2,
    "bagging_fraction": 0.5,
    "bagging_freq": 1,
    "lambda_l2": 10.0,
    "max_bin": 63,
    "verbosity": -1,
    "num_threads": 1,  # two that wait for each other on a busy machine take ten times as long
}


def faults_for(seed: int, duration: float) -> tuple[FaultSpec, ...]:
    """More faults of valves than scenarios have, some growing, some on both sides of a wheel."""
    rng = np.random.default_rng([seed, 77])
    pauses, out = float(rng.choice([0.5, 1.0, 2.0])), []
    for wheel in haulotte().wheels:
        t = 5.0 + float(rng.uniform(0.0, 12.0))
        while t < duration - 4.0:
            stop = min(t + float(rng.uniform(3.0, 14.0)), duration - 0.3)
            sides = (Side.ACTUATOR,) if rng.random() < _VALVES else (Side.SENSOR,)
            if rng.random() < _BOTH:
                sides = (Side.SENSOR, Side.ACTUATOR)
            for side in sides:
                late = float(rng.uniform(0.5, 2.0)) if len(sides) > 1 and side is Side.ACTUATOR else 0.0
                modes = drawn_modes(side)
                mode = modes[int(rng.integers(len(modes)))]
                fault = draw_fault(wheel, side, mode, t + late, stop, rng, steer=False)
                ramp = round(float(rng.uniform(0.3, 0.6)) * (stop - t - late), 3) if rng.random() < _RAMPS else 0.0
                if stop > t + late + 1.0:
                    out.append(replace(fault, ramp_s=ramp))
            t = stop + float(rng.uniform(3.0, 15.0)) * pauses
    return tuple(sorted(out, key=lambda f: f.start_s))


def mission_options(kind: str, seed: int, *, healthy: bool) -> SimulationOptions:
    """The mission of one machine."""
    rng = np.random.default_rng([seed, 7])
    duration = float(rng.choice([40.0, 60.0, 80.0, 120.0]))
    scenario = "healthy" if healthy else "random"
    if kind == "own":
        options = SimulationOptions(
            scenario=scenario,  # type: ignore[arg-type]
            seed=seed,
            duration_s=duration,
            coupling="ground" if seed % 3 else "free",
            ice=0.25 if seed % 4 == 1 else 0.0,
        )
    elif kind == "vary":
        options = varied_options(seed, kind="tuning", scenario="healthy" if healthy else None, duration_s=duration)
    else:
        options = options_of(Task(kind, seed, duration, ("base",), False), scenario, int(healthy))
    if seed >= SECOND_FROM and kind != "vary" and rng.random() < _OTHER_LAW:
        options = replace(options, law=str(rng.choice(SIMULATED_LAWS)))  # type: ignore[arg-type]
    if healthy or rng.random() >= _OWN_SCHEDULE:
        return options
    return replace(options, scenario="random", faults=faults_for(seed, duration))


class _Captured(Exception):
    """Carries the wheels' data out of the diagnosis."""

    def __init__(self, data: WheelsData, limits: Limits, gains: bool) -> None:
        self.data, self.limits, self.gains = data, limits, gains


def _capture(data: WheelsData, limits: Limits, *, gains: bool) -> dict[int, Any]:
    raise _Captured(data, limits, gains)


def features_of(kind: str, seed: int, options: SimulationOptions, evidence: str) -> tuple[Array, Array, Array, Array]:
    """Features of all wheels' frames for both looks, rows of both sides, and where the wheel is quiet; shape (frames, …) each."""
    mission = simulate_mission(options)
    signals = (signals_of if kind == "own" else recorded_signals)(mission, evidence)
    machine = haulotte()
    machine = replace(machine, control=replace(machine.control, law="none"))  # which is of no use here, and takes time
    judge, wheel_assess.assess_wheels = wheel_assess.assess_wheels, _capture
    try:
        diagnose_mission(Mission(files=(), signals=signals, timeline=align(signals)), machine)
        raise MfhcaError("no wheel has a model")
    except _Captured as captured:
        found = captured
    finally:
        wheel_assess.assess_wheels = judge
    data, rng = found.data, np.random.default_rng([seed, 5])
    if kind != "own" and rng.random() < _WITHOUT_REFERENCE:
        data = replace(data, reference=np.full_like(data.reference, np.nan))
    if rng.random() < _WITHOUT_GEOMETRY:
        data = replace(data, ratio=np.full_like(data.ratio, np.nan), turn=np.full_like(data.turn, np.nan))
    blocks = blocks_of(data.y, data.u, data.status, data.quiet, data.ratio, data.turn, data.plants, data.dt, data.store)
    blocks = with_readings(blocks, data.y, data.habits, data.speed_noises, found.limits.driving_speed)
    model, blocks = joint_model(data, blocks)
    _, following = follow(data, blocks, model)
    features = mission_features(data, blocks, model, {i: f.described for i, f in following.items()}, gains=found.gains)
    said = said_features(first_look(features, [bool(m) for m in data.measured]), features.hop * blocks.dt)
    x, more, y, quiet = [], [], [], []
    for i, own in features.of.items():
        at = (np.arange(len(own)) + 0.5) * features.hop
        x.append(own[::_EVERY])
        more.append(said[i][::_EVERY].astype(np.float32))
        y.append(true_rows(mission.truth, machine.wheels[i], at * blocks.dt)[::_EVERY])
        quiet.append(blocks.quiet[np.minimum(at.astype(int), len(blocks.quiet) - 1), i][::_EVERY])
    return np.concatenate(x), np.concatenate(more), np.concatenate(y), np.concatenate(quiet)


def true_rows(truth: MissionTruth, wheel: str, t: Array) -> NDArray[np.int8]:
    """Class of sensor and actuator at times t, shape (n, 2); −1 near an edge."""
    out = np.zeros((t.size, 2), np.int8)
    for interval in truth.intervals:
        if interval.component != wheel:
            continue
        side = 0 if interval.side is Side.SENSOR else 1
        out[(t >= interval.start_s) & (t < interval.stop_s), side] = 1 + MODES.index(interval.mode)
        for edge in (interval.start_s, interval.stop_s):
            out[np.abs(t - edge) < _EDGE_S, side] = -1
    return out


def collect(folder: Path, kinds: Sequence[str], first: int, count: int) -> None:
    """Write one file per mission; those that are there already are left alone."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed in range(first, first + count):
        for kind in kinds:
            for healthy in (False, True) if seed % 3 == 0 else (False,):
                for evidence in ("base", "spool") if seed % 6 == 0 else ("base",):
                    name = folder / f"{kind}_{seed}_{'healthy' if healthy else 'random'}_{evidence}.npz"
                    if name.exists():
                        continue
                    try:
                        x, said, y, quiet = features_of(
                            kind, seed, mission_options(kind, seed, healthy=healthy), evidence
                        )
                    except MfhcaError as error:
                        print(f"{name.stem}: {error}", flush=True)
                        continue
                    new = name.with_suffix(".new")
                    with new.open("wb") as out:
                        np.savez(out, X=x, S=said, Y=y, Q=quiet)
                    new.replace(name)
                    print(f"{name.stem}: {len(x)} frames", flush=True)


@dataclass(frozen=True)
class Frames:
    """Frames of many missions; see `features_of`."""

    x: NDArray[np.float32]
    y: NDArray[np.int8]
    quiet: NDArray[np.bool_]

    def learned(self, side: int) -> NDArray[np.bool_]:
        """Frames from which a side is learned: not those in which a sensor shows nothing of its valve."""
        out = (self.y[:, side] >= 0) & ~self.quiet
        if side == 1:
            out &= ~np.isin(self.y[:, 0], (1, 2)) & (self.x[:, _MEASURED] == 0)
        return out


def loaded(files: Iterator[Path], look: str) -> Frames:
    """Frames of some files, with the features of a look."""
    parts = [np.load(f) for f in files]
    x, y, quiet = (np.concatenate([p[key] for p in parts]) for key in ("X", "Y", "Q"))
    if look == "second":
        x = np.concatenate([x, np.concatenate([p["S"] for p in parts])], axis=1)
    return Frames(x, y, quiet)


def trained(frames: Frames, side: int, rounds: int) -> tuple[Any, Array]:
    """Trees of one side, and the share of each class."""
    import lightgbm

    at = frames.learned(side)
    y = frames.y[at, side]
    weight = _WEIGHTS[y]
    prior = np.bincount(y, weights=weight, minlength=len(_WEIGHTS))
    data = lightgbm.Dataset(frames.x[at], y, weight=weight)
    return lightgbm.train(_SETTINGS, data, num_boost_round=rounds), prior / prior.sum()


def flat(model: Any, prior: Array, x: NDArray[np.float32], *, stated: bool) -> dict[str, NDArray[Any]]:
    """Trees as arrays, see `diagnosis.wheels.forest.Forest`; x holds the frames that they were trained on.

    What is `stated` is the probability among frames as they are, without the weights of training.
    """
    nodes: list[list[float]] = []
    leaves: list[float] = []

    def walk(node: dict[str, Any], more: float) -> int:
        if "split_feature" not in node:
            leaves.append(node["leaf_value"] + more)
            return -len(leaves)
        k = len(nodes)
        nodes.append([node["split_feature"], node["threshold"], 0, 0])
        nodes[k][2], nodes[k][3] = walk(node["left_child"], more), walk(node["right_child"], more)
        return k

    trees = model.dump_model()["tree_info"]
    first = -np.log(_WEIGHTS) if stated else np.zeros(len(_WEIGHTS))  # of the first tree of each class
    root = [walk(tree["tree_structure"], first[k] if k < first.size else 0.0) for k, tree in enumerate(trees)]
    feature, threshold, left, right = np.array(nodes).T
    low, high = x.min(axis=0), x.max(axis=0)
    margin = 0.02 * (high - low) + 1e-6
    return {
        "feature": feature.astype(np.int16),
        "threshold": threshold.astype(np.float32),
        "left": left.astype(np.int32),
        "right": right.astype(np.int32),
        "value": np.array(leaves, np.float32),
        "root": np.array(root, np.int32),
        "prior": prior,
        "low": (low - margin).astype(np.float32),
        "high": (high + margin).astype(np.float32),
    }


def reliability(model: Any, frames: Frames, side: int) -> None:
    """How often what is said of a frame is right, on machines that were held out."""
    at = frames.learned(side)
    p, y = model.predict(frames.x[at]), frames.y[at, side]
    best = p.argmax(axis=1)
    print(f"log-loss {-np.log(np.maximum(p[np.arange(y.size), y], 1e-9)).mean():.4f}")
    for low, high in ((0.3, 0.5), (0.5, 0.7), (0.7, 0.85), (0.85, 0.95), (0.95, 1.01)):
        for name, mine in (("fault", best > 0), ("healthy", best == 0)):
            some = mine & (p.max(axis=1) >= low) & (p.max(axis=1) < high)
            if some.any():
                right, faulty = (best == y)[some].mean(), (y[some] > 0).mean()
                print(
                    f"  {name:<8} p {low:.2f}–{high:.2f}: {some.sum():6d} frames, right {right:.3f}, faulty {faulty:.3f}"
                )
    recall = [(best[y == k] == k).mean() if (y == k).any() else float("nan") for k in range(len(_WEIGHTS))]
    print("  recall", " ".join(f"{r:.3f}" for r in recall))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="where collected missions are")
    parser.add_argument("--collect", type=int, default=0, metavar="N", help="machines of each kind to simulate")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--first", type=int, default=100, help="first seed")
    parser.add_argument(
        "--rounds", type=int, nargs=2, default=(220, 260), help="rounds of boosting, sensors and valves"
    )
    parser.add_argument(
        "--fit", choices=("first", "second"), help="train, report on machines that were held out, write the trees"
    )
    choice = parser.parse_args()
    warnings.filterwarnings("ignore")
    if choice.collect:
        collect(choice.folder, choice.kinds, choice.first, choice.collect)
    if choice.fit:
        fit(choice.folder, choice.fit, choice.rounds)


def fit(folder: Path, look: str, rounds: Sequence[int]) -> None:
    """Train both sides of a look, and write them beside the other look."""
    seeds = {f: int(f.stem.split("_")[1]) for f in sorted(folder.glob("*.npz"))}
    files = [f for f, seed in seeds.items() if (seed >= SECOND_FROM) == (look == "second")]
    held = {f for f in files if seeds[f] % HELD_OUT == 0}
    with np.load(TREES) as kept:
        data = {key: kept[key] for key in kept.files if not key.startswith(look)}
    for side, name in enumerate(Look._fields):
        mine = [f for f in files if side == 0 or f.stem.endswith("base")]  # else the valve's opening is measured
        frames = loaded((f for f in mine if f not in held), look)
        model, prior = trained(frames, side, rounds[side])
        arrays = flat(model, prior, frames.x[frames.learned(side)], stated=look == "second")
        data |= {f"{look}_{name}_{key}": value for key, value in arrays.items()}
        print(name, end=": ", flush=True)
        reliability(model, loaded((f for f in mine if f in held), look), side)
    np.savez_compressed(TREES, **data)
    print(f"{TREES.name}: {TREES.stat().st_size / 1e6:.2f} MB from {len(files) - len(held)} missions")


if __name__ == "__main__":
    main()
