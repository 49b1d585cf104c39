"""Scores of the diagnosis of a single drive on a real motor rig; run as `python tests/benchmarks/rosa.py`.

The data are 82 runs of the public RoSA set: a motor with encoder in a speed loop at 62.5 Hz, healthy (43 runs), with extra
damping (D, 13), lateral load (N, 13) and vibration (V, 13). Of each folder every third file in order of name is for
tuning and for the drive's model; figures come from the others (``--part reporting``, the default).

1. Faults of L4 are written into the healthy runs (`replay.injection.inject`): the recorded controller never met them. One fault
   per run and row of the table, from 40 % of the run's longest gap-free stretch on, for 8 s or 35 % of it. Stuck at the
   last value; no signal as 0; noisy with white sat of 200 ± 100 (the commands lie between 100 and 500).
2. The rig's own faults by step of one second, scored by the expected extra load of `diagnosis.drives.load`.

Units are the rig's own. The data are looked for in the folder named by MFHCA_REFERENCE_DATA (default ``../shared``).
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import chi2, rankdata

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.drives.assess import assess_drive
from diagnosis.drives.inputs import DriveData, drive_data, stretches
from diagnosis.drives.load import track_load
from diagnosis.fitting.drives import identify_drive
from diagnosis.results.assessment import CODE, STATES, Assessment
from replay.faults import FaultMode, FaultSpec, Side, State
from replay.injection.inject import inject_signals
from replay.machine.config import Machine
from replay.machine.drive_model import DriveModel
from replay.machine.toml_file import load_machine
from replay.mission import read_signals
from replay.signals.signal import Signals
from replay.signals.timeline import Timeline, align

Array = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
MACHINE = """
[machine]
name = "motor rig"
wheels = ["M"]
[geometry]
max_speed = 400
[control]
law = "none"
u_max = 100
[limits]
min_epsilon = 0.02
min_sat = 2.0
driving_speed = 20.0
[sources]
"*.csv.gz" = { time = "Rel Time", time_unit = "ms" }
[signals]
"wheel.M.v_ref" = { column = "Desired Speed", unit = "m/s" }
"wheel.M.v" = { column = "Actual Speed", unit = "m/s" }
"wheel.M.u" = { column = "Shaft Control Effort", unit = "1" }
"""
FOLDERS = {"healthy": "healthy_mode", "D": "manual_d_mode", "N": "manual_n_mode", "V": "mc-generated_v_mode"}
ROWS = (State.HEALTHY, State.STUCK, State.NO_SIGNAL, State.INEFFICIENT, State.NOISY)
EPSILONS = (0.3, 0.1, 0.05, 0.03)
SAT = (200.0, 100.0, 0.0)
LONGEST_S = 8.0
CAUSAL_S = 0.5


def data_folder() -> Path:
    """Folder of the rig's runs; ends with a message where there is none."""
    base = Path(os.environ.get("MFHCA_REFERENCE_DATA", "../shared"))
    folder = (base if base.is_absolute() else ROOT / base) / "fault_data/rosa"
    if not folder.is_dir():
        sys.exit(f"no data at {folder}; set MFHCA_REFERENCE_DATA to the folder that holds fault_data/rosa")
    return folder


def files_of(kind: str, part: str) -> list[Path]:
    """Files of one kind: every third in order of name is for tuning, the others are for reporting."""
    found = sorted((data_folder() / FOLDERS[kind]).glob("*.csv.gz"))
    return [f for i, f in enumerate(found) if (i % 3 == 0) == (part == "tuning")]


def rig() -> Machine:
    """Machine of the rig."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rig.toml"
        path.write_text(MACHINE, encoding="utf-8")
        return load_machine(path)


def drive_of(signals: Signals, machine: Machine, model: DriveModel | None) -> tuple[DriveData, Timeline]:
    """Channels of the rig's drive on one time axis."""
    timeline = align(signals)
    data = drive_data(timeline, timeline.signals["wheel.M.v_ref"], machine, "M")
    assert data is not None
    return replace(data, model=model), timeline


def fit(machine: Machine) -> DriveModel:
    """Model of the drive from the tuning part of the healthy runs."""
    runs = [drive_of(read_signals([f], machine)[1], machine, None)[0] for f in files_of("healthy", "tuning")]
    return identify_drive(runs, machine.limits.driving_speed)


def longest(data: DriveData) -> slice:
    """Longest stretch of the run without a gap."""
    return max(stretches(np.isfinite(data.y), 2), key=lambda s: s.stop - s.start)


def faults_of(epsilon: float, start: float, stop: float, sat: tuple[float, float, float]) -> Iterator[FaultSpec]:
    """One fault per row of the table; stuck and no signal have ε = 1."""
    yield FaultSpec("M", Side.SENSOR, FaultMode.STUCK, start, stop, 1.0, float("nan"))
    yield FaultSpec("M", Side.SENSOR, FaultMode.NO_SIGNAL, start, stop, 1.0, 0.0)
    yield FaultSpec("M", Side.SENSOR, FaultMode.INEFFICIENT, start, stop, epsilon, 0.0)
    yield FaultSpec("M", Side.SENSOR, FaultMode.NOISY, start, stop, epsilon, *sat)


def confusion(assessment: Assessment, data: DriveData, fault: FaultSpec | None, dt: float) -> Array:
    """Seconds by true row and reported row (the last column: undecided) where the drive is driven, shape (5, 6)."""
    t = np.arange(data.y.size) * dt
    truth = np.zeros(data.y.size, dtype=np.int64)
    if fault is not None:
        truth[(t >= fault.start_s) & (t < fault.stop_s)] = ROWS.index(State(fault.mode.value))
    told = np.full(len(STATES), len(ROWS))
    for i, row in enumerate(ROWS):
        told[CODE[row]] = i
    use = np.isfinite(data.y) & (np.abs(np.nan_to_num(data.command)) > 20.0)
    out = np.zeros((len(ROWS), len(ROWS) + 1))
    np.add.at(out, (truth[use], told[assessment.states[use]]), dt)
    return out


def macro_f1(seconds: Array) -> float:
    """Mean F1 over the rows; undecided time counts as wrong."""
    hit = np.diag(seconds[:, : len(ROWS)])
    f1 = 2 * hit / np.maximum(seconds.sum(axis=1) + seconds[:, : len(ROWS)].sum(axis=0), 1e-12)
    return float(np.mean(f1))


def poisson_bound(count: int, hours: float) -> float:
    """Upper 95 % bound of a rate [1/h] after `count` events in `hours`."""
    return float(chi2.ppf(0.95, 2 * count + 2) / 2 / hours)


def injected(part: str, machine: Machine, model: DriveModel | None, sat: tuple[float, float, float]) -> None:
    """Print the scores of faults written into healthy runs."""
    total = {e: np.zeros((len(ROWS), len(ROWS) + 1)) for e in EPSILONS}
    delays: dict[tuple[float, str], list[float]] = {}
    early: dict[tuple[float, str], list[bool]] = {}
    errors: dict[tuple[float, str], list[float]] = {}
    alarms, load_alarms, hours, surplus, spare = 0, 0, 0.0, 0, 0.0
    clean = np.zeros((len(ROWS), len(ROWS) + 1))
    for number, path in enumerate(files_of("healthy", part)):
        signals = read_signals([path], machine)[1]
        data, _ = drive_of(signals, machine, model)
        sensor, actuator = assess_drive(data, machine.limits)
        clean += confusion(sensor, data, None, data.dt)
        hours += float(np.count_nonzero(np.isfinite(data.y))) * data.dt / 3600
        told = [*(f for f in sensor.findings if f.side is Side.SENSOR), *actuator.findings]
        alarms += sum(f.side is Side.SENSOR for f in told)
        load_alarms += sum(f.side is not Side.SENSOR for f in told)
        for f in told:
            print(
                f"  {path.name}: {f.side} {f.mode} {f.start * data.dt:.2f}–{f.stop * data.dt:.2f} s, p {f.probability:.2f}"
            )
        stretch = longest(data)
        length = (stretch.stop - stretch.start) * data.dt
        start = round(stretch.start + 0.4 * (stretch.stop - stretch.start)) * data.dt
        stop = start + min(LONGEST_S, 0.35 * length)
        for epsilon in EPSILONS:
            for fault in faults_of(epsilon, start, stop, sat):
                hard = fault.epsilon == 1.0
                faulty = inject_signals(signals, [fault], machine, number)[0]
                now, _ = drive_of(faulty, machine, model)
                found, _ = assess_drive(now, machine.limits)
                total[epsilon] += confusion(found, now, fault, now.dt)
                if hard and epsilon != EPSILONS[0]:
                    continue
                key = (1.0 if hard else epsilon, fault.mode.value)
                own = [f for f in found.findings if f.side is Side.SENSOR]
                mine = [f for f in own if f.start * now.dt < stop and f.stop * now.dt > start]
                surplus += len(own) - len(mine)
                spare += (length - (stop - start)) / 3600
                raised = [f.detected * now.dt - start for f in mine if f.detected is not None]
                delays.setdefault(key, []).append(max(0.0, min(raised)) if raised else np.inf)
                early.setdefault(key, []).append(_by_prefix(now, machine, start))
                errors.setdefault(key, []).extend(
                    abs(f.epsilon.value - fault.epsilon) for f in mine if f.mode is fault.mode and f.epsilon
                )
    print(f"{'ε':>5} {'macro-F1':>9}  F1 by row: {', '.join(r.value for r in ROWS)}")
    for epsilon, seconds in total.items():
        hit = np.diag(seconds[:, :5])
        by_row = 2 * hit / (seconds.sum(axis=1) + seconds[:, :5].sum(axis=0))
        print(f"{epsilon:5.2f} {macro_f1(seconds):9.4f}  {' '.join(f'{x:.3f}' for x in by_row)}")
    print(
        "fault, ε: detection delay median / 95 % / worst [s]; found when the log ends 0.5 s after onset; mean error of ε̂"
    )
    for (epsilon, mode), values in sorted(delays.items(), reverse=True):
        q = np.quantile(values, [0.5, 0.95, 1.0], method="higher")
        print(
            f"  {mode:<12} {epsilon:4.2f}: {q[0]:.2f} / {q[1]:.2f} / {q[2]:.2f}; "
            f"{sum(early[epsilon, mode])} of {len(early[epsilon, mode])}; "
            f"{np.mean(errors[epsilon, mode]) if errors[epsilon, mode] else np.nan:.3f}"
        )
    share = clean[0, 0] / clean.sum()
    print(
        f"healthy runs: {60 * hours:.1f} min, {100 * share:.1f} % of them told healthy, false alarms of the sensor {alarms}, at most "
        f"{poisson_bound(alarms, hours):.1f}/h with 95 %; extra load told {load_alarms} times; beside injected faults {surplus} in {spare:.2f} h"
    )


def _by_prefix(data: DriveData, machine: Machine, start: float) -> bool:
    """Whether a fault is found in a log that ends half a second after its onset."""
    n = round((start + CAUSAL_S) / data.dt)
    short = replace(
        data,
        y=data.y[:n],
        y_fresh=data.y_fresh[:n],
        alive=data.alive[:n],
        command=data.command[:n],
        u=data.u[:n],
    )
    sensor, _ = assess_drive(short, machine.limits)
    return any(f.stop * data.dt > start for f in sensor.findings)


def labels_of(path: Path, timeline: Timeline) -> tuple[NDArray[np.str_], Array]:
    """Label of every step, H, D, N or V, and the setting of its damper: 15 is normal, less is more load."""
    frame = pd.read_csv(path, skipinitialspace=True)
    stamps = np.round(frame["Rel Time"].to_numpy(dtype=float) * 1e6).astype(np.int64)
    at = np.round(timeline.t * 1e9).astype(np.int64) + timeline.step_ns // 2 + stamps[0]
    latest = np.clip(np.searchsorted(stamps, at, side="right") - 1, 0, None)
    label = frame["Multi-class Sublevel Mode"].str.strip().to_numpy(dtype=str)
    return np.asarray(label[latest]), frame["D-mode attribute"].to_numpy(dtype=float)[latest]


def auroc(faulty: Array, healthy: Array) -> float:
    """Probability that a faulty step scores above a healthy one."""
    ranks = rankdata(np.r_[faulty, healthy])[: faulty.size]
    return float((ranks.sum() - faulty.size * (faulty.size + 1) / 2) / faulty.size / healthy.size)


def own_faults(part: str, machine: Machine, model: DriveModel) -> None:
    """Print how well the extra load tells the rig's own faults from healthy steps."""
    if model.effort is None:
        sys.exit("the healthy runs give no effort map")
    steps: list[tuple[str, str, str, float, float, float]] = []
    runs, flagged = 0, []
    for kind in FOLDERS:
        for path in files_of(kind, part):
            data, timeline = drive_of(read_signals([path], machine)[1], machine, model)
            load = track_load(data.record, model.effort, machine.limits.driving_speed)
            labels, damper = labels_of(path, timeline)
            if kind != "healthy":
                runs += 1
                sensor, _ = assess_drive(data, machine.limits)
                flagged += [path.name for f in sensor.findings if f.side is Side.SENSOR]
            for k in np.flatnonzero(np.isfinite(load.level)):
                inside = slice(k * load.length, (k + 1) * load.length)
                if len(set(labels[inside])) == 1:
                    excess = float(np.nanmean(data.u[inside])) - model.effort.offset
                    excess -= model.effort.slope * float(np.nanmean(data.y[inside]))
                    steps.append(
                        (
                            kind,
                            str(labels[inside][0]),
                            path.name,
                            float(load.level[k]),
                            excess,
                            float(damper[inside].mean()),
                        )
                    )
    table = pd.DataFrame(steps, columns=["kind", "label", "run", "load", "excess", "damper"])
    healthy = table[table.kind == "healthy"]
    every = table[table.label == "H"]
    # told: the excess over the mean of the run's own healthy steps, where the run has any
    own = every.groupby("run").excess.mean()
    table["told"] = table.excess - table.run.map(own).fillna(0.0)
    print(
        "fault: steps; AUROC of the expected extra load against healthy runs, and also against healthy parts of faulty runs"
    )
    for kind in ("D", "N", "V"):
        rows = table[table.label == kind]
        print(
            f"  {kind}: {len(rows)} steps of {rows.run.nunique()} runs; {auroc(rows.load.to_numpy(), healthy.load.to_numpy()):.3f}, "
            f"{auroc(rows.load.to_numpy(), every.load.to_numpy()):.3f}"
        )
    damped = table[table.label == "D"]
    bare = damped[~damped.run.isin(own.index)]
    print(
        f"  D in runs with a healthy part: {auroc(damped[damped.run.isin(own.index)].load.to_numpy(), healthy.load.to_numpy()):.3f}; "
        f"in {bare.run.nunique()} runs damped throughout ({len(bare)} steps): {auroc(bare.load.to_numpy(), healthy.load.to_numpy()):.3f}; "
        f"a reader told each run's healthy effort, where it has any: {auroc(damped.told.to_numpy(), table.told[healthy.index].to_numpy()):.3f}"
    )
    for low, high in ((0, 6), (6, 9), (9, 15)):
        rows = damped[(damped.damper > low) & (damped.damper <= high)]
        if len(rows):
            print(
                f"  D, damper at {low + 1} to {high}: {len(rows)} steps; {auroc(rows.load.to_numpy(), healthy.load.to_numpy()):.3f}, "
                f"told {auroc(rows.told.to_numpy(), table.told[healthy.index].to_numpy()):.3f}"
            )
    print(f"  the sensor is blamed in {len(set(flagged))} of these {runs} runs {sorted(set(flagged)) or ''}")
    for run, rows in damped.groupby("run"):
        print(
            f"    {run}: {len(rows)} steps, mean extra load {rows.load.mean():.2f}, mean excess over the map {rows.excess.mean():+.2f}"
        )
    print(
        f"  healthy runs differ from the map by {healthy.groupby('run').excess.mean().std():.2f} (standard deviation)"
    )


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=("tuning", "reporting"), default="reporting")
    parser.add_argument(
        "--without-model", action="store_true", help="identify the controller in each run instead of by fit"
    )
    parser.add_argument(
        "--sat",
        type=float,
        nargs=3,
        default=SAT,
        metavar=("MEAN", "STD", "TAU_S"),
        help="saturation term of noisy sensors",
    )
    args = parser.parse_args()
    machine = rig()
    model = fit(machine)
    print(f"model: {model}")
    injected(args.part, machine, None if args.without_model else model, tuple(args.sat))
    own_faults(args.part, machine, model)


if __name__ == "__main__":
    main()
