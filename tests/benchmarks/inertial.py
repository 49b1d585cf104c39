"""What an inertial unit's acceleration adds: the same missions with and without it; `python tests/benchmarks/inertial.py`.

1. Real logs of robots of which one speed and an inertial unit are recorded (a Husky and a Jackal by their odometry, a racing car by its motor): what
   relates the two, alarms as they are, and faults written into the speed: dead, frozen at its value, half. How many were found, and by the sensor.
2. Ordinary robots (`ordinary_robots/`) with one or two drives, healthy and faulty: findings on the right wheel, on the right side of it
   alone, wrong findings, missions cleared. Every mission whose findings differ is listed.

The data are looked for in the folder named by MFHCA_REFERENCE_DATA (default ``../shared``).
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: more threads only wait for each other

import numpy as np
import ordinary
import pandas as pd
from robots import data_folder, told

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.pipeline import diagnose, diagnose_mission
from diagnosis.response import family
from diagnosis.response.inputs import FollowerData
from diagnosis.response.unit_note import unit_note
from diagnosis.response.vibration import Unit
from diagnosis.results.result import MissionResult
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.mission import Mission, load_mission
from replay.setup.draft import draft_machine
from replay.setup.machine_text import machine_text
from replay.setup.read import read_everything

KINDS = ("dead", "frozen", "half")
NAME = "imu.acceleration"
FAULTS = ("", "encoder_dead", "encoder_scaled", "encoder_dropped", "motor_dead", "jammed", "estop", "gyro_dead")


def logs(folder: Path) -> Iterator[tuple[str, Mission, Machine]]:
    """Each real log with the machine file that `config init` writes, the racing car's with that of its data."""
    base = data_folder().parent
    for name in ("test1", "test2"):
        path = base / "reference_logs/robot_localization" / f"{name}.bag"
        (folder / "m.toml").write_text(
            machine_text(draft_machine(read_everything([path], every=False)), path.name), encoding="utf-8"
        )
        machine = load_machine(folder / "m.toml")
        yield name, load_mission([path], machine), machine
    files = []
    for part in ("commandData", "coreData", "imuData"):
        frame = pd.read_csv(base / f"fault_data/robots/f1tenth/{part}.csv")
        frame["t_ns"] = frame.s.astype("int64") * 10**9 + frame.ns.astype("int64")
        files.append(folder / f"{part}_t.csv")
        frame.to_csv(files[-1], index=False)
    text = (base / "fault_data/robots/f1tenth/machine.toml").read_text(encoding="utf-8")
    line = '"imu.acceleration" = { column = "ay", unit = "g", gain = -1.0 }\n'  # its x looks to the right
    (folder / "m.toml").write_text(text.rstrip() + "\n" + line, encoding="utf-8")
    machine = load_machine(folder / "m.toml")
    yield "racing car", load_mission(files, machine), machine


def real(count: int, seed: int) -> None:
    """Print what real logs show."""
    with tempfile.TemporaryDirectory() as folder:
        for name, mission, machine in logs(Path(folder)):
            t = mission.timeline
            v, a = t.signals["wheel.D.v"], t.signals[NAME]
            bare = replace(t, signals={n: x for n, x in t.signals.items() if n != NAME})
            silent = np.full(v.size, np.nan)
            data = FollowerData(v, t.fresh["wheel.D.v"], silent[:, None], silent, "wheel.D.v")
            alarms = len(list(told(diagnose_mission(mission, machine).report)))
            print(f"{name}: alarms {alarms}. {unit_note(data, Unit(a, t.fresh[NAME]), (), t.dt)}")
            for kind in KINDS:
                scores = [_injected(replace(mission, timeline=x), machine, kind, count, seed) for x in (t, bare)]
                shown = (f"found {s['found']}, by its sensor {s['sensor']}, beside {s['beside']}" for s in scores)
                print(f"  {kind:<7} missions {count}: {', without: '.join(shown)}", flush=True)


def _injected(mission: Mission, machine: Machine, kind: str, count: int, seed: int) -> Counter[str]:
    """Scores of faults at random places where the machine drives."""
    rng, t, out = np.random.default_rng(seed), mission.timeline, Counter[str]()
    v = t.signals["wheel.D.v"]
    while out["missions"] < count:
        start, length = rng.uniform(5.0, t.size * t.dt - 12.0), rng.uniform(3.0, 8.0)
        part = slice(int(start / t.dt), int((start + length) / t.dt))
        if np.nanmedian(np.abs(v[part])) < 0.15 * np.nanmax(np.abs(v)):
            continue
        y = v.copy()
        y[part] = {"dead": 0.0, "frozen": y[part.start], "half": 0.5 * y[part]}[kind]
        faulty = replace(mission, timeline=replace(t, signals={**t.signals, "wheel.D.v": y}))
        faults = list(told(diagnose_mission(faulty, machine).report))
        hits = [f for f in faults if f[2] < start + length and f[3] > start]
        out.update(missions=1, found=bool(hits), sensor=any(f[1] == "sensor" for f in hits))
        out.update(beside=len(faults) - len(hits))
    return out


def simulated(kinds: Sequence[str], faults: Sequence[str], seeds: range) -> None:
    """Print what ordinary robots show."""
    total: dict[bool, Counter[str]] = {True: Counter(), False: Counter()}
    for kind in kinds:
        for fault in faults:
            for seed in seeds:
                both = _both(kind, fault, seed)
                for used, c in both.items():
                    total[used].update(
                        missions=1,
                        wheel=any(c.right(i, side=False) for i in c.told),
                        side=any(c.right(i) and str(i["side"]) != "sensor_or_actuator" for i in c.told),
                        wrong=sum(not c.right(i) for i in c.told),
                        cleared=c.report["verdict"]["cleared"],
                    )
                if _said(both[True]) != _said(both[False]):
                    print(
                        f"  {kind} {fault or 'healthy'} {seed}: {_said(both[True])}, without: {_said(both[False])}",
                        flush=True,
                    )
    for used, s in total.items():
        print(
            f"{'with' if used else 'without'}: missions {s['missions']}, right wheel {s['wheel']:d}, right side alone {s['side']:d}, "
            f"wrong findings {s['wrong']}, cleared {s['cleared']:d}"
        )


def _both(kind: str, fault: str, seed: int) -> dict[bool, ordinary.Case]:
    """One mission, diagnosed with the unit and without."""
    kept: list[MissionResult] = []

    def twice(paths: Any, machine: Machine) -> MissionResult:
        with patch.object(family, "_unit", return_value=None):
            kept.append(diagnose(paths, machine))
        return diagnose(paths, machine)

    with tempfile.TemporaryDirectory() as folder, patch.object(ordinary, "diagnose", twice):
        c = ordinary.case(kind, fault, seed, Path(folder))
    return {True: c, False: replace(c, result=kept[0])}


def _said(c: ordinary.Case) -> str:
    return (
        "; ".join(f"{i['component']} {i['side']} {i['mode']} {i['start_s']:.1f}–{i['stop_s']:.1f}" for i in c.told)
        or "nothing"
    )


def main() -> None:
    """Print both parts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=12, help="missions of each kind and real log")
    parser.add_argument("--seed", type=int, default=5, help="of places")
    parser.add_argument("--kinds", nargs="*", default=("differential", "tricycle"))
    parser.add_argument("--faults", nargs="*", default=FAULTS)
    parser.add_argument("--first", type=int, default=500, help="first seed of ordinary robots")
    parser.add_argument("--number", type=int, default=7, help="missions of each kind of robot and fault")
    args = parser.parse_args()
    if args.count:
        real(args.count, args.seed)
    simulated(args.kinds, args.faults, range(args.first, args.first + args.number))


if __name__ == "__main__":
    main()
