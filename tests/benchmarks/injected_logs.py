"""Faults written into real logs of robots, ten into each; run as `python tests/benchmarks/injected_logs.py LOG [LOG ...] --seed 2001`.

The machine file is drafted from each log as `mfhca config init` does. A wheel drawn at random is dead, frozen at its value, reads 0.5, 0.8 or 1.3,
is noisy (15 % of the usual top speed) or has spikes (3 % of the readings and four at least, five times it) for ten seconds of driving; and is dead or reads 0.8 or 1.3
from start to end. Its position reads the same of scales and deaths with `--both`. Printed are each log's own verdict with its alarms, every fault that no finding on its wheel
names, and by kind: found, on the right wheel, told (or by the verdict, as a wheel that contradicts what others make of the motion, or that reads nothing), another
wheel named beside it, cleared, and those that are not told and called healthy for over three seconds of it.

The logs are those of other people and no part of the project.
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
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.pipeline import diagnose_mission
from diagnosis.results.document import IntervalRow, ReportDocument
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.mission import Mission, load_mission
from replay.setup.draft import draft_machine
from replay.setup.machine_text import machine_text
from replay.setup.read import read_everything

Array = NDArray[np.float64]

COUNTED = ("n", "found", "right", "told", "beside", "cleared", "healthy")
KINDS = ("dead", "frozen", "x0.5", "x0.8", "x1.3", "noise", "spikes", "all x0.8", "all x1.3", "all dead")
SPELL_S, MARGIN_S = 10.0, 4.0
NOISE, SPIKES, SPIKE = 0.15, 0.03, 5.0  # of the usual top speed; of the readings; times that speed
#: Of titles that say so without a fault of one part.
CONTRADICTS = "contradicts", "contradict", "another share", "reads nothing"
MOVES, PLACES = 0.25, 60  # of the usual top speed, in the median of a spell; tries
HEALTHY_S, LEAST_SPIKES = 3.0, 4


def injected(y: Array, kind: str, part: slice, fresh: NDArray[np.bool_], rng: np.random.Generator) -> Array:
    """A speed, shape (n,) in m/s, with a fault in `part`, or from start to end."""
    y, top = y.copy(), float(np.nanquantile(np.abs(y), 0.95))
    whole = kind.startswith("all ")
    part = slice(None) if whole else part
    name = kind.removeprefix("all ")
    if name == "dead":
        y[part] = 0.0
    elif name == "frozen":
        y[part] = y[part.start]
    elif name.startswith("x"):
        y[part] *= float(name[1:])
    else:
        steps = np.arange(y.size)[part]
        new = steps[fresh[part]]
        if name == "noise":
            added = rng.normal(0.0, NOISE * top, new.size)
        else:
            wild = rng.choice(new.size, min(new.size, max(LEAST_SPIKES, round(SPIKES * new.size))), replace=False)
            added = np.zeros(new.size)
            added[wild] = SPIKE * top * rng.choice([-1.0, 1.0], wild.size)
        at = np.searchsorted(new, steps, side="right") - 1  # what is held repeats its reading
        y[part] += np.where(at >= 0, added[np.maximum(at, 0)] if added.size else 0.0, 0.0)
    return y


def place(y: Array, dt: float, rng: np.random.Generator) -> slice | None:
    """Ten seconds of driving at random; None where no try hits some."""
    top, size = float(np.nanquantile(np.abs(y), 0.95)), y.size
    for _ in range(PLACES):
        start = rng.uniform(MARGIN_S, max(MARGIN_S + 0.1, size * dt - SPELL_S - 3.0))
        part = slice(int(start / dt), int((start + SPELL_S) / dt))
        if np.nanmedian(np.abs(y[part])) > MOVES * top:
            return part
    return None


def faults_of(report: ReportDocument) -> list[IntervalRow]:
    """Faults worth a word."""
    return [i for i in report["intervals"] if i["severity"] != "info"]


def healthy_s(report: ReportDocument, wheel: str, start: float, stop: float) -> float:
    """How long a wheel's sensor is called healthy in a span [s]."""
    return sum(
        max(0.0, min(x["stop_s"], stop) - max(x["start_s"], start))
        for x in report["states"]
        if (x["component"], x["side"], x["state"]) == (wheel, "sensor", "healthy")
    )


def case(mission: Mission, machine: Machine, kind: str, both: bool, rng: np.random.Generator) -> Counter[str]:
    """Write one fault, diagnose, and count; prints what no finding on the wheel names."""
    t = mission.timeline
    wheel = machine.wheels[rng.integers(len(machine.wheels))]
    name = f"wheel.{wheel}.v"
    part = place(t.signals[name], t.dt, rng)
    if part is None:
        return Counter()
    names = [name]
    if both and f"{name}_position" in t.signals and kind not in ("frozen", "noise", "spikes"):
        names.append(f"{name}_position")
    changed = {n: injected(t.signals[n], kind, part, t.fresh[n], rng) for n in names}
    report = diagnose_mission(replace(mission, timeline=replace(t, signals={**t.signals, **changed})), machine).report
    start, stop = (0.0, np.inf) if kind.startswith("all ") else (part.start * t.dt, part.stop * t.dt)
    faults = faults_of(report)
    hits = [i for i in faults if i["start_s"] < stop and i["stop_s"] > start]
    right = [i for i in hits if i["component"] == wheel and i["side"] in ("sensor", "sensor_or_actuator")]
    told = any(words in report["verdict"]["title"] for words in CONTRADICTS)
    well = healthy_s(report, wheel, start, stop)
    if not right:
        said = "; ".join(f"{i['component']} {i['side']} {i['mode']} p {i['probability']:.2f}" for i in faults[:3])
        print(
            f"  {kind} {wheel} {start:.1f}: {report['verdict']['title']} | {said or 'no fault'} | healthy {well:.1f} s",
            flush=True,
        )
    return Counter(
        n=1,
        found=bool(hits),
        right=bool(right),
        beside=any(i["component"] != wheel for i in faults),
        cleared=report["verdict"]["cleared"],
        told=bool(right) or told,
        healthy=not right and well > HEALTHY_S,
    )


def main() -> None:
    """Print the scores of every log, and of all by kind."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="+", type=Path)
    parser.add_argument("--seed", type=int, default=2001)
    parser.add_argument("--both", action="store_true", help="the position of the joint reads the same")
    parser.add_argument("--kinds", nargs="*", default=KINDS, choices=KINDS)
    asked = parser.parse_args()
    totals: dict[str, Counter[str]] = {kind: Counter() for kind in asked.kinds}
    for path in asked.logs:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "machine.toml"
            file.write_text(machine_text(draft_machine(read_everything([path], every=False)), path.name))
            machine = load_machine(file)
        mission = load_mission([path], machine)
        report = diagnose_mission(mission, machine).report
        alarms = [f"{i['component']} {i['side']} {i['mode']}" for i in faults_of(report)]
        print(f"{path.name}: {report['verdict']['title']}; alarms: {', '.join(alarms) or 'none'}", flush=True)
        for kind in asked.kinds:
            rng = np.random.default_rng([asked.seed, KINDS.index(kind), sum(path.name.encode())])
            totals[kind] += case(mission, machine, kind, asked.both, rng)
    every: Counter[str] = Counter()
    for kind, one in totals.items():
        every += one
        print(f"{kind:<9}", ", ".join(f"{k} {one[k]}" for k in COUNTED))
    print("together ", ", ".join(f"{k} {every[k]}" for k in COUNTED))


if __name__ == "__main__":
    main()
