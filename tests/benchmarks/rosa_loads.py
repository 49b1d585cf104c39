"""How much of the time of an extra load on a real motor rig is called healthy; run as `python tests/benchmarks/rosa_loads.py`.

Every run of the RoSA set with a damper (D), diagnosed whole with the model that `rosa.py` fits from the tuning part of the healthy
runs. Of the time labelled D in which the drive moves: how much its drive is called healthy, which load would have shown at the
least as the report states it, and whether the machine was cleared. Also how often its speed sensor is blamed.

Data are looked for as in `rosa.py`.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import rosa  # beside this script

from diagnosis.pipeline import diagnose
from replay.mission import load_mission


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
        cleared += report["verdict"]["cleared"]
        shows = [
            r["size"]
            for r in report["detectability"]["rows"]
            if str(r["side"]) == "actuator" and r["for_s"] is None and r["size"] is not None
        ]
        print(
            f"{path.name}: {there:.0f} s of load, called healthy {100 * called / max(there, 1e-9):.0f} %, {report['verdict']['title']}, "
            f"cleared {report['verdict']['cleared']}, sensor blamed {blamed}; a load over the whole mission shows from "
            f"{'%.0f %% of the effort on' % (100 * shows[0]) if shows else 'no size on'}",
            flush=True,
        )
    judged = 0
    healthy_runs = rosa.files_of("healthy", "reporting")
    for path in healthy_runs:
        report = diagnose([path], machine).report
        judged += any(
            s["component"] == "M" and s["side"] == "actuator" and s["state"] == "healthy" for s in report["states"]
        )
    print(f"healthy runs (reporting part): the drive is called healthy in {judged} of {len(healthy_runs)}")
    print(
        f"{len(runs)} runs, {total:.0f} s of load: called healthy {100 * healthy / total:.1f} %; cleared {cleared:.0f}; "
        f"sensor blamed {sensor:.0f}"
    )


if __name__ == "__main__":
    main()
