"""False alarms on healthy missions of the reference data's foreign plant: `python tests/benchmarks/foreign_healthy.py --count 50`.

Its own script makes the missions, with seeds, gains, lags, slopes, ice and noise of ours, under the law with forced Ψ̂ or the
printed one. The data lies where ``MFHCA_REFERENCE_DATA`` says.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from diagnosis.pipeline import diagnose_mission
from replay.machine.toml_file import load_machine
from replay.mission import load_mission

PLANT = Path(os.environ.get("MFHCA_REFERENCE_DATA", "../shared")) / "foreign_plants"
ROWS = ("stuck", "no_signal", "inefficient", "noisy", "outside_table")


def healthy_report(make: Any, seed: int, law: str) -> dict[str, Any]:
    """Report of one mission of 240 s with commands, speeds and valve commands alone."""
    rng = np.random.default_rng(seed)
    scenario = make.Scenario(
        f"healthy{seed}",
        seed,
        ice=float(rng.choice([0.0, 0.8])),
        slope=float(rng.choice([0.0, 0.05, 0.1])),
        gain=float(rng.uniform(2.2, 4.0)),
        tau=float(rng.uniform(0.1, 0.22)),
        meas_noise=float(rng.uniform(0.001, 0.004)),
        law=law,
    )
    with tempfile.TemporaryDirectory() as folder:
        log, config = Path(folder) / "mission.mcap", Path(folder) / "machine.toml"
        make.write_mcap(log, make.simulate(scenario), scenario, False, False)
        config.write_text(make.machine(False, False))
        machine = load_machine(config)
        return dict(diagnose_mission(load_mission([log], machine), machine).report)


def main() -> None:
    """Make, diagnose, count, print."""
    parser = argparse.ArgumentParser(description="False alarms on healthy missions of a foreign plant.")
    parser.add_argument("--first", type=int, default=7000, help="first seed")
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--law", choices=("forced", "printed"), default="forced")
    asked = parser.parse_args()
    if not PLANT.is_dir():
        parser.error(f"{PLANT} is not there: set MFHCA_REFERENCE_DATA")
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(PLANT))
    make, alarms, verdicts = importlib.import_module("make"), 0, []
    for seed in range(asked.first, asked.first + asked.count):
        report = healthy_report(make, seed, asked.law)
        verdicts.append(report["verdict"]["status"])
        for i in report["intervals"]:
            if i["severity"] != "info" and i["mode"] in ROWS:
                alarms += 1
                print(
                    f"{seed}: {i['component']} {i['side']} {i['mode']} {i['start_s']:.1f}–{i['stop_s']:.1f} s, p {i['probability']:.2f}"
                )
        print(f"\r{len(verdicts)} of {asked.count} missions", end="", file=sys.stderr, flush=True)
    hours = len(verdicts) * 240.0 / 3600.0
    counted = ", ".join(f"{status} {verdicts.count(status)}" for status in sorted(set(verdicts)))
    print(f"\n{alarms} false alarms in {hours:.2f} h = {alarms / hours:.2f}/h; {counted}")


if __name__ == "__main__":
    main()
