"""How much of the time of an extra load on a real motor rig is called healthy; run as `python tests/benchmarks/rosa_loads.py`.

Every run of the RoSA set with a damper (D), diagnosed whole with the model that `rosa.py` fits from the tuning part of the healthy
runs. Of the time labelled D in which the drive moves: how much its drive is called healthy, which load would have shown at the
least as the report states it, and whether the machine was cleared without a word of the load. Also how often its speed sensor is blamed. Then loads of just
the stated size, and of `limits.clear_at`, written into the effort of the healthy runs from beginning to end: how much of that
time the drive is called healthy.

Data are looked for as in `rosa.py`.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import rosa  # beside this script

from diagnosis.pipeline import diagnose
from diagnosis.results.document import ReportDocument
from replay.machine.config import Machine
from replay.mission import load_mission


def lasting(report: ReportDocument) -> float | None:
    """Smallest load over the whole mission that would have shown, as a share of the effort [1]."""
    rows = report["detectability"]["rows"]
    return next((r["size"] for r in rows if str(r["side"]) == "actuator" and r["for_s"] is None), None)


def called_healthy(report: ReportDocument) -> float:
    """Seconds in which the drive is called healthy."""
    drive = [s for s in report["states"] if s["component"] == "M" and s["side"] == "actuator"]
    return sum(s["stop_s"] - s["start_s"] for s in drive if s["state"] == "healthy")


def loaded(path: Path, machine: Machine, share: float) -> ReportDocument:
    """Diagnosis of a run with a load all through it, a share of the whole effort [1]."""
    frame = pd.read_csv(path, skipinitialspace=True)
    frame["Shaft Control Effort"] /= 1.0 - share
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.csv.gz"
        frame.to_csv(log, index=False)
        return diagnose([log], machine).report


def main() -> None:
    """Print a line for each run, and the sums."""
    machine = rosa.rig()
    machine = replace(machine, drives={"M": rosa.fit(machine)})
    total = healthy = sensor = cleared = 0.0
    runs = sorted((rosa.data_folder() / rosa.FOLDERS["D"]).glob("*.csv.gz"))
    for path in runs:
        timeline = load_mission([path], machine).timeline
        damped = rosa.labels_of(path, timeline)[0] == "D"
        report = diagnose([path], machine).report
        there = called = 0.0
        for s in report["states"]:
            if s["component"] == "M" and s["side"] == "actuator" and s["state"] not in ("not_excited", "no_data"):
                inside = (timeline.t >= s["start_s"]) & (timeline.t < s["stop_s"])
                seconds = float(np.count_nonzero(inside & damped)) * timeline.dt
                there += seconds
                called += seconds * (s["state"] == "healthy")
        blamed = any(str(i["side"]) == "sensor" and i["severity"] != "info" for i in report["intervals"])
        total, healthy, sensor = total + there, healthy + called, sensor + blamed
        named = any(str(i["side"]) != "sensor" and i["severity"] != "info" for i in report["intervals"])
        unsaid = report["verdict"]["cleared"] and not named
        cleared += unsaid
        shows = lasting(report)
        print(
            f"{path.name}: {there:.0f} s of load, called healthy {100 * called / max(there, 1e-9):.0f} %, {report['verdict']['title']}, "
            f"cleared {report['verdict']['cleared']}{', load not named' if unsaid else ''}, sensor blamed {blamed}; a load over the whole mission shows from "
            f"{'no size on' if shows is None else f'{100 * shows:.0f} % of the effort on'}",
            flush=True,
        )
    healthy_runs = rosa.files_of("healthy", "reporting")
    judged, stated, missed = 0, [], {"stated": 0, "counts": 0}
    for path in healthy_runs:
        report = diagnose([path], machine).report
        judged += called_healthy(report) > 0.0
        least = lasting(report)
        if least is not None and least <= machine.limits.clear_at:
            stated.append(least)
            missed["stated"] += called_healthy(loaded(path, machine, least)) > 0.0
        missed["counts"] += called_healthy(loaded(path, machine, machine.limits.clear_at)) > 0.0
    print(f"healthy runs (reporting part): the drive is called healthy in {judged} of {len(healthy_runs)}")
    print(
        f"a load from beginning to end: of the stated size ({min(stated):.2f} to {max(stated):.2f}) called healthy at any time in "
        f"{missed['stated']} of {len(stated)}; of limits.clear_at in {missed['counts']} of {len(healthy_runs)}"
    )
    print(
        f"{len(runs)} runs, {total:.0f} s of load: called healthy {100 * healthy / total:.1f} %; cleared without naming it {cleared:.0f}; "
        f"sensor blamed {sensor:.0f}"
    )


if __name__ == "__main__":
    main()
