"""What commands, speeds and valve commands allow at most; run as `python tests/benchmarks/bound.py [--knows force]`.

An oracle judges the stretches between the true fault boundaries of each wheel on the same logged v and u as the tool with
base evidence. It knows what no log holds: the boundaries, the speed at each of them, K, tau, droop, pump and noise of the
simulated plant, the openings of the other valves, and the ground: the body's true speed with the friction under each tyre
(``--knows body``: a hypothesis that turns the wheel differently then meets another tyre force), or the tyre force itself
(``--knows force``: looser still, for the force gives the wheel's true speed away; free wheels have none).

For each pair of rows (sensor, actuator) the likelihood of v is maximised over ε and sat within the simulator's own ranges.
Each parameter costs half the logarithm of the independent samples that tell it, each pair the logarithm of its prior. Behind
a sensor without information (stuck, silent) no valve can be judged; the truth masks it there. The share of driving time in
the right row is what no diagnosis of this evidence should be expected to pass.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from oracle import ROWS, SIGNALS, A, Oracle, World, trajectory

from replay.faults import Side
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import mission_parts, simulate_mission

SEEDS = {"tuning": range(1000), "reporting": range(2000, 3000)}


def worlds(mission: SimulatedMission, knows: str) -> list[World]:
    """The oracle's knowledge of each wheel."""
    options, wheels = mission.options, mission.options.machine.wheels
    plant, (duty, _, model) = options.plant, mission_parts(options)
    if options.substeps != 1 or plant.dead_zone or plant.valve_lag or plant.leakage or mission.kept:
        raise SystemExit("the oracle knows plants without dead zone, valve lag and leakage, logged in full at 1 kHz")
    body = {name: mission.actual[f"body.{name}"] for name in ("v", "x", "y", "yaw")}
    weight = model.mass * 9.81 / len(wheels)
    slope = weight * duty.slope.at(np.asarray(np.arange(options.samples) * model.dt, np.float64))
    asked = [model.K[i] * np.abs(mission.actual[f"wheel.{w}.u_applied"]) for i, w in enumerate(wheels)]
    nothing, out = np.zeros(options.samples), []
    for i, wheel in enumerate(wheels):
        x = body["x"] + np.cos(body["yaw"]) * model.x[i] - np.sin(body["yaw"]) * model.y[i]
        y = body["y"] + np.sin(body["yaw"]) * model.x[i] + np.cos(body["yaw"]) * model.y[i]
        waves = model.ice_waves
        height = np.cos(np.outer(x, waves[:, 0]) + np.outer(y, waves[:, 1]) + waves[:, 2]).sum(axis=1)
        most = weight * np.where(height > model.ice_level, model.mu_ice, model.mu)
        stiffness = model.slip_stiffness / (np.abs(body["v"]) + 0.05)
        slip = mission.actual[f"wheel.{wheel}.slip"]
        force = most * np.tanh(stiffness * slip / most) if model.ground else slope
        follows = model.ground and knows == "body"
        out.append(
            World(
                dt=model.dt,
                K=float(model.K[i]),
                tau=float(model.tau[i]),
                droop=model.droop,
                pump=model.speed_limit,
                u=mission.columns[f"wheel.{wheel}.u"],
                others=np.sum(asked, axis=0) - asked[i],
                most=most if follows else nothing,
                stiffness=stiffness,
                ground=mission.actual[f"wheel.{wheel}.v"] - slip,
                force=nothing if follows else force,
            )
        )
    return out


def part(world: World, rows: slice) -> World:
    """The same over a stretch."""
    cut: dict[str, Any] = {name: np.ascontiguousarray(getattr(world, name)[rows]) for name in SIGNALS}
    return world._replace(**cut)


@dataclass(frozen=True)
class Task:
    """One mission to judge."""

    scenario: str
    coupling: str
    ice: float
    seed: int
    duration: float
    knows: str


def confusions(task: Task) -> tuple[A, float]:
    """Driving time [s] by side, true row and chosen row, shape (2, 5, 5); largest error of a healthy wheel's replay."""
    options = SimulationOptions(
        scenario=task.scenario,  # type: ignore[arg-type]
        seed=task.seed,
        duration_s=task.duration,
        coupling=task.coupling,  # type: ignore[arg-type]
        ice=task.ice,
        evidence="base",
    )
    mission = simulate_mission(options)
    model, n = mission_parts(options)[2], options.samples
    counts, off = np.zeros((2, 5, 5)), 0.0
    for wheel, world in zip(options.machine.wheels, worlds(mission, task.knows), strict=True):
        truth = np.zeros((2, n), np.int64)
        masked = np.zeros(n, np.bool_)
        for i in mission.truth.intervals:
            if i.component == wheel:
                rows = slice(*(int(np.ceil(x / model.dt - 1e-6)) for x in (i.start_s, i.stop_s)))
                truth[int(i.side is Side.ACTUATOR), rows] = ROWS.index(i.mode)
                masked[rows] |= i.side is Side.SENSOR and i.mode in ("stuck", "no_signal")
        driving = np.abs(mission.actual[f"wheel.{wheel}.v_ref"]) > mission.truth.driving_speed
        edges = np.r_[0, np.flatnonzero(np.any(np.diff(truth, axis=1), axis=0)) + 1, n]
        speed, measured = mission.actual[f"wheel.{wheel}.v"], mission.columns[f"wheel.{wheel}.v"]
        for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            rows = slice(a, b)
            oracle = Oracle(measured[rows], float(speed[a]), model.v_std, model.v_lsb, part(world, rows))
            chosen = max(oracle.pairs(), key=lambda found: found[2])[:2]
            if truth[1, a] == 0:
                replay = trajectory(oracle.v0, 0.0, 0.0, oracle.world)
                off = max(off, float(np.abs(replay - speed[rows]).max()))
            for side in (0, 1):
                use = driving[rows] & ~(masked[rows] if side else np.False_)
                counts[side, truth[side, a], ROWS.index(chosen[side])] += model.dt * use.sum()
    return counts, off


def shares(counts: A) -> dict[str, Any]:
    """Balanced accuracy and recalls of both sides; a row without driving time counts nowhere."""
    out: dict[str, Any] = {}
    for side, table in zip(("sensor", "actuator"), counts, strict=True):
        total = table.sum(axis=1)
        recall = {row: table[i, i] / total[i] for i, row in enumerate(ROWS) if total[i] > 0}
        out[side] = {
            "balanced_accuracy": float(np.mean(list(recall.values()))),
            "recall": recall,
            "seconds": total.tolist(),
            "confusion_s": np.round(table, 3).tolist(),
        }
    return out


def main() -> None:
    """Simulate, judge, print."""
    parser = argparse.ArgumentParser(description="What base evidence allows at most: an oracle's balanced accuracy.")
    parser.add_argument("--seeds", choices=list(SEEDS), default="tuning")
    parser.add_argument("--count", type=int, default=2, help="number of seeds; each gives a paper and a random mission")
    parser.add_argument("--duration", type=float, default=240.0, help="length of a mission [s]")
    parser.add_argument("--coupling", choices=("free", "ground"), nargs="+", default=("free", "ground"))
    parser.add_argument("--ice", type=float, nargs="+", default=(0.0, 0.25))
    parser.add_argument("--scenario", choices=("paper", "random"), nargs="+", default=("paper", "random"))
    parser.add_argument(
        "--knows", choices=("body", "force"), default="body", help="what the oracle knows of the ground"
    )
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    asked = parser.parse_args()
    document = []
    with ProcessPoolExecutor(asked.jobs) as pool:
        for coupling, ice in product(asked.coupling, asked.ice):
            if coupling == "free" and ice != min(asked.ice):
                continue  # free wheels have no ground to slip on
            tasks = [
                Task(scenario, coupling, ice, seed, asked.duration, asked.knows)
                for seed, scenario in product(SEEDS[asked.seeds][: asked.count], asked.scenario)
            ]
            found = list(pool.map(confusions, tasks))
            figures = shares(np.sum([counts for counts, _ in found], axis=0))
            off = max(x for _, x in found)
            print(f"{coupling}, ice {ice:g}, {len(tasks)} missions; healthy replay off by at most {off * 1e3:.3f} mm/s")
            for side, f in figures.items():
                recall = "  ".join(f"{row} {x:.3f}" for row, x in f["recall"].items())
                print(f"  {side:9} balanced accuracy {f['balanced_accuracy']:.3f}   {recall}", flush=True)
            key = {"seeds": asked.seeds, "knows": asked.knows, "coupling": coupling, "ice": ice, "missions": len(tasks)}
            document.append(key | figures)
    if asked.json:
        asked.json.write_text(json.dumps(document, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
