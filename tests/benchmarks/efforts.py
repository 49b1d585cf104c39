"""Drives of ordinary robots judged by their efforts, after `mfhca fit`; `python tests/benchmarks/efforts.py --first 1505 --count 3`.

Each robot of `ordinary_robots/` drives healthy missions, of which four are fitted, and missions with a fault of a drive that its loop may make up for:
torque that is lost behind its current, a brake that drags, a weak or dead motor. Efforts are torques (`--torques`) or duties. Printed for each kind
of fault, without the fitted [effort] and with it: missions, those that are ready, those in which the right wheel is named, and in which another one is.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: more threads only wait for each other

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from ordinary_robots.faults import FAULTS, HIDDEN, HIDDEN_ALL, Fault, fault_of
from ordinary_robots.habits import Habits
from ordinary_robots.log import write_log
from ordinary_robots.machines import H, Robot, course_of, robot_of
from ordinary_robots.physics import drive

from diagnosis.fitting.missions import fit_missions
from diagnosis.pipeline import diagnose_mission
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.mission import load_mission
from replay.setup.draft import draft_machine
from replay.setup.machine_text import machine_text
from replay.setup.read import read_everything

_FITTED, _HEALTHY, _FAULTY = 4, 2, 20
KINDS = ("skid", "rocker", "differential", "ackermann")
WRONG = (*HIDDEN, *HIDDEN_ALL, "motor_weak", "motor_gone", "motor_dead")


def robot(kind: str, seed: int, *, duties: bool) -> Robot:
    """A random robot of a kind that logs its efforts."""
    made = robot_of(kind, np.random.default_rng([seed, 77]))
    return replace(made, efforts=True, duties=duties, rate=max(made.rate, 20.0))


def mission(made: Robot, seed: int, number: int, kind: str, folder: Path) -> tuple[Path, Fault | None]:
    """Log of a mission, with a fault of that kind, if any."""
    rng = np.random.default_rng([seed, number, (FAULTS.index(kind) + 1) if kind else 0])
    course, fault = course_of(made, float(rng.uniform(90.0, 150.0)), rng), None
    if kind:
        moving = (np.abs(course.v) > 0.2 * made.top) & ~course.silent & ~course.stop
        fault = fault_of(kind, len(made.wheels), moving, H, rng)
    driven = drive(made, course, fault, rng)
    path = folder / f"{number}{kind}.mcap"
    write_log(path, made, course, driven, fault, rng, Habits("usual", seed))
    return path, fault


def machine_of(path: Path, folder: Path, *, duties: bool) -> Machine:
    """First machine file of a log, with the unit of its efforts put right."""
    text = machine_text(draft_machine(read_everything([path], every=False)), path.name)
    file = folder / "machine.toml"
    file.write_text(text.replace('"N·m"', '"1"') if duties else text, encoding="utf-8")
    return load_machine(file)


def score(made: Robot, seed: int, folder: Path, *, duties: bool) -> Counter[tuple[str, str]]:
    """What is said of all missions of a robot."""
    paths = [mission(made, seed, k, "", folder)[0] for k in range(_FITTED + _HEALTHY)]
    plain = machine_of(paths[0], folder, duties=duties)
    fit = fit_missions([load_mission([p], plain) for p in paths[:_FITTED]], plain).machine
    out: Counter[tuple[str, str]] = Counter()
    cases = [(p, None, "healthy") for p in paths[_FITTED:]]
    for path, fault, kind in [*cases, *((*mission(made, seed, _FAULTY, k, folder), k) for k in WRONG)]:
        joint = None if fault is None else made.wheels[fault.wheel].joint
        wheel = next((w for w in plain.wheels if joint and joint in plain.signals[f"wheel.{w}.v"].label), "")
        out[kind, "missions"] += 1
        for name, machine in (("without", plain), ("with", fit)):
            report = diagnose_mission(load_mission([path], machine), machine).report
            named = {i["component"] for i in report["intervals"] if i["severity"] != "info"}
            out[kind, f"{name}: ready"] += report["verdict"]["status"] == "ready"
            out[kind, f"{name}: right"] += wheel in named
            out[kind, f"{name}: other"] += bool(named - {wheel})
    return out


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=1505)
    parser.add_argument("--count", type=int, default=3, help="robots of each kind")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--torques", action="store_true", help="efforts are torques instead of duties")
    args = parser.parse_args()
    total: Counter[tuple[str, str]] = Counter()
    for kind in args.kinds:
        for seed in range(args.first, args.first + args.count):
            with tempfile.TemporaryDirectory() as folder:
                made = robot(kind, seed, duties=not args.torques)
                total += score(made, seed, Path(folder), duties=not args.torques)
    for name in ("healthy", *WRONG):
        said = ", ".join(
            f"{k} {total[name, k]}"
            for k in (
                "missions",
                "without: ready",
                "without: right",
                "without: other",
                "with: ready",
                "with: right",
                "with: other",
            )
        )
        print(f"{name:<12} {said}")


if __name__ == "__main__":
    main()
