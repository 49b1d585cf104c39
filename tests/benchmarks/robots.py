"""Scores of the diagnosis of velocity-controlled robots on real logs; run as `python tests/benchmarks/robots.py`.

Five minutes of a Husky and a Warthog with their wheel speeds and commands, a disabled Warthog, 115 runs of a robot arm, and a
motor rig. What is printed:

1. the two bags as they are: alarms, and the share of driving in which each speed sensor was judged;
2. faults written into one wheel of them for ten seconds: dead, frozen at its value, half, ±1.5 rad/s of noise, spikes of 100 rad/s.
   Places where the wheel hardly moves are left out for the first three. Whether it was found, and by the right wheel and side
   (`--bare`: without the positions of their joints, which tell a sensor by themselves);
3. the disabled Warthog: its title, and whether any wheel is blamed;
4. the arm: motors that were commanded and stood still (by net travel) and whether they were found; other motors blamed;
5. the rig with all channels of its rows repeated for three seconds.

The data are looked for in the folder named by MFHCA_REFERENCE_DATA (default ``../shared``).
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: more threads only wait for each other

import numpy as np
import pandas as pd
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.pipeline import diagnose, diagnose_mission
from diagnosis.results.document import ReportDocument
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.mission import Mission, load_mission

Array = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
KINDS = ("dead", "frozen", "half", "noise", "spikes")
RADIUS = {"husky_bag": 0.1651, "warthog_bag": 0.3}
SPELL_S = 10.0
MOVES = 0.1  # m/s
STILL_RAD, COMMANDED_RAD, LATE_S = 0.05, 0.12, 1.5


def data_folder() -> Path:
    """Folder of the real faults; ends with a message where there is none."""
    base = Path(os.environ.get("MFHCA_REFERENCE_DATA", "../shared"))
    folder = (base if base.is_absolute() else ROOT / base) / "fault_data"
    if not folder.is_dir():
        sys.exit(f"no data at {folder}; set MFHCA_REFERENCE_DATA to the folder that holds fault_data")
    return folder


def injected(y: Array, kind: str, part: slice, radius: float, rng: np.random.Generator) -> Array:
    """A speed with a fault in `part`."""
    y = y.copy()
    size = part.stop - part.start
    if kind == "dead":
        y[part] = 0.0
    elif kind == "frozen":
        y[part] = y[part.start]
    elif kind == "half":
        y[part] *= 0.5
    elif kind == "noise":
        y[part] += rng.uniform(-1.5, 1.5, size) * radius
    else:
        at = part.start + np.flatnonzero(rng.random(size) < 0.03)
        y[at] += 100.0 * radius * rng.choice([-1, 1], at.size)
    return y


def told(report: ReportDocument) -> Iterator[tuple[str, str, float, float]]:
    """Faults worth a word: part, side, start and end [s]."""
    for i in report["intervals"]:
        if i["severity"] != "info":
            yield i["component"], str(i["side"]), i["start_s"], i["stop_s"]


def bag(name: str, count: int, seed: int, *, positions: bool = True) -> tuple[int, int, int, int]:
    """Print a bag's scores; missions with a fault, found, found with wheel and side, alarms beside them."""
    machine = load_machine(data_folder() / f"robots/{name}.toml")
    mission = load_mission([data_folder() / "robots" / name], machine)
    if not positions:
        kept = {k: x for k, x in mission.timeline.signals.items() if not k.endswith("_position")}
        mission = replace(mission, timeline=replace(mission.timeline, signals=kept))
    report = diagnose_mission(mission, machine).report
    shares = [
        f"{c['component']} {100 * c['decided_driving_s'] / c['driving_s']:.1f} %"
        for c in report["coverage"]
        if c["side"] == "sensor"
    ]
    print(
        f"{name} as it is: alarms {len(list(told(report)))}, {report['verdict']['title']}; judged of driving: {', '.join(shares)}"
    )
    rng = np.random.default_rng(seed)
    total = np.zeros(4, dtype=np.int64)
    for kind in KINDS:
        scores = np.zeros(4, dtype=np.int64)
        for _ in range(count):
            scores += _spell(mission, machine, kind, RADIUS[name], rng)
        total += scores
        print(
            f"  {kind:<7} missions {scores[0]}, found {scores[1]}, wheel and side right {scores[2]}, alarms beside {scores[3]}"
        )
    n, found, right, beside = (int(x) for x in total)
    return n, found, right, beside


def _spell(mission: Mission, machine: Machine, kind: str, radius: float, rng: np.random.Generator) -> Array:
    """One injected mission: [1, found, right, alarms beside]; zeros where the wheel hardly moves."""
    timeline = mission.timeline
    wheel = machine.wheels[rng.integers(len(machine.wheels))]
    start = rng.uniform(15.0, timeline.size * timeline.dt - 20.0)
    part = slice(int(start / timeline.dt), int((start + SPELL_S) / timeline.dt))
    speed = timeline.signals[f"wheel.{wheel}.v"]
    if kind in KINDS[:3] and np.nanmedian(np.abs(speed[part])) < MOVES:
        return np.zeros(4, dtype=np.int64)
    signals = {**timeline.signals, f"wheel.{wheel}.v": injected(speed, kind, part, radius, rng)}
    report = diagnose_mission(replace(mission, timeline=replace(timeline, signals=signals)), machine).report
    faults = list(told(report))
    hits = [f for f in faults if f[2] < start + SPELL_S and f[3] > start]
    right = [f for f in hits if f[:2] == (wheel, "sensor")]
    return np.array([1, bool(hits), bool(right), len(faults) - len(right)])


def disabled() -> None:
    """Print the verdict on the disabled Warthog."""
    folder = data_folder() / "robots"
    report = diagnose([folder / "warthog_disabled.csv"], load_machine(folder / "warthog_disabled.toml")).report
    print(
        f"disabled Warthog: {report['verdict']['status']}, {report['verdict']['title']}; blamed: {list(told(report)) or 'nothing'}"
    )


def arm() -> None:
    """Print the scores of the raw arm runs."""
    folder = data_folder() / "robot_arm_raw"
    machine = load_machine(folder / "machine.toml")
    stuck = found = wrong = runs = 0
    for path in sorted(folder.glob("*.csv")):
        runs += 1
        blamed = {f[0] for f in told(diagnose([path], machine).report)}
        frame = pd.read_csv(path)
        late = frame.t_s > LATE_S
        for i in range(1, 6):
            seen = frame[f"resp_m{i}_rad"].rolling(5, center=True, min_periods=1).median()[late]
            still = np.ptp(seen) < STILL_RAD and np.ptp(frame[f"cmd_m{i}_rad"][late]) > COMMANDED_RAD
            stuck += still
            found += still and f"m{i}" in blamed
            wrong += not still and f"m{i}" in blamed
    print(
        f"raw arm: {runs} runs, motors that stood still though commanded {stuck}, found {found}; others blamed {wrong}"
    )


def repeated_rows() -> None:
    """Print the verdicts on the rig with rows repeated for three seconds."""
    import rosa  # beside this script

    machine = rosa.rig()
    for number in (106, 118, 130):
        frame = pd.read_csv(data_folder() / "rosa/healthy_mode" / f"merged_data{number}.csv.gz", skipinitialspace=True)
        t = (frame["Rel Time"] - frame["Rel Time"].iloc[1]).to_numpy() / 1e3
        inside = frame.index[(t >= 8.0) & (t < 11.0)]
        names = ["Desired Speed", "Actual Speed", "Shaft Control Effort"]
        frame.loc[inside, names] = frame.loc[inside[0], names].to_numpy()
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "run.csv.gz"
            frame.to_csv(log, index=False)
            report = diagnose([log], machine).report
        gone = sum(
            s["stop_s"] - s["start_s"] for s in report["states"] if (s["side"], s["state"]) == ("sensor", "no_data")
        )
        print(f"rig {number}, rows repeated for 3 s: faults {list(told(report)) or 'none'}, no data for {gone:.1f} s")


def main() -> None:
    """Print all scores."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=12, help="missions of each kind and bag")
    parser.add_argument("--seed", type=int, default=101, help="of places and wheels")
    parser.add_argument(
        "--bare", action="store_true", help="without the positions of the joints: commands and speeds alone"
    )
    args = parser.parse_args()
    both = np.array([bag(name, args.count, args.seed, positions=not args.bare) for name in RADIUS]).sum(axis=0)
    print(
        f"together: {both[0]} missions, found {100 * both[1] / both[0]:.1f} %, wheel and side right {100 * both[2] / both[0]:.1f} %, "
        f"alarms beside {both[3]}"
    )
    disabled()
    arm()
    repeated_rows()


if __name__ == "__main__":
    main()
