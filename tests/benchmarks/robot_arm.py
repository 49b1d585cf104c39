"""Scores of command tracking on a real robot arm; run as `python tests/benchmarks/robot_arm.py`.

The data are 36 runs of ten seconds of the public DTR arm set: healthy (4), one motor of four stuck (16), one motor with a
steady-state error (16). Position command and response of five servos at 100 Hz, nothing else. The whole diagnosis is run
with a machine file that names the ten columns. Expected: the stuck motor, and no other; no motor of a healthy run. A
steady-state error is no standstill and must raise nothing.

What the runs are called is all that is known of them. In three of four, healthy ones too, some motor reads ±120°, the end of its servo's
range, for tenths of a second while it is told to go far less: these readings are wild, and of a motor that is flagged they are counted.

The data are looked for in the folder named by MFHCA_REFERENCE_DATA (default ``../shared``).
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from diagnosis.pipeline import diagnose
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine

_END, _NEAR = 2.0 * np.pi / 3.0, 1e-4  # rad; of the servo's range

ROOT = Path(__file__).resolve().parents[2]
MACHINE = """
[machine]
name = "robot arm"
wheels = ["m1", "m2", "m3", "m4", "m5"]
[geometry]
max_speed = 1.5
[control]
law = "none"
[limits]
driving_speed = 0.02
[sources]
"*.csv" = { time = "t_s" }
[signals]
""" + "\n".join(
    f'"wheel.m{i}.v_ref" = {{ column = "cmd_m{i}_rad", unit = "m", derivative = true }}\n'
    f'"wheel.m{i}.v" = {{ column = "resp_m{i}_rad", unit = "m", derivative = true }}'
    for i in range(1, 6)
)


def data_folder() -> Path:
    """Folder of the arm's runs; ends with a message where there is none."""
    base = Path(os.environ.get("MFHCA_REFERENCE_DATA", "../shared"))
    folder = (base if base.is_absolute() else ROOT / base) / "fault_data/dtr_robot_arm"
    if not folder.is_dir():
        sys.exit(f"no data at {folder}; set MFHCA_REFERENCE_DATA to the folder that holds fault_data/dtr_robot_arm")
    return folder


def arm() -> Machine:
    """Machine of the arm."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.toml"
        path.write_text(MACHINE, encoding="utf-8")
        return load_machine(path)


def at_the_end(path: Path, motor: str) -> tuple[int, float]:
    """Samples of a motor at the end of its servo's range, and the most that it is told in that run [°]."""
    table = np.genfromtxt(path, delimiter=",", names=True, usecols=(f"cmd_{motor}_rad", f"resp_{motor}_rad"))
    told, read = (np.abs(table[f"{kind}_{motor}_rad"]) for kind in ("cmd", "resp"))
    return int(np.count_nonzero(np.abs(read - _END) < _NEAR)), float(np.degrees(np.nanmax(told)))


def main() -> None:
    """Print what was found in each kind of run."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    machine = arm()
    runs = {"Healthy": 0, "Stuck": 0, "Steady_state_error": 0}
    found, missed, wrong, ends = 0, [], [], 0
    lags: list[float] = []
    for path in sorted(data_folder().glob("*.csv")):
        kind = next(k for k in runs if k in path.stem)
        runs[kind] += 1
        report = diagnose([path], machine).report
        told = {
            f["component"]
            for f in report["intervals"]
            if f["mode"] in ("stuck", "no_signal") and f["severity"] != "info"
        }
        others = {f["component"] for f in report["intervals"] if f["severity"] != "info"}
        expected = {f"m{path.stem.split('_')[1]}"} if kind == "Stuck" else set()
        if expected and expected <= told:
            found += 1
        elif expected:
            missed.append(path.stem)
        for motor in sorted(others - expected):
            count, told = at_the_end(path, motor)
            wild = f" (reads ±120° in {count} samples, and is told {told:.0f}° at most)" if count else ""
            wrong.append(f"{path.stem}: {motor}{wild}")
            ends += bool(count)
        lags += (
            []
            if kind != "Healthy"
            else [
                float(q["result"].split("lag ")[1].split(" ")[0])
                for q in report["quality"]
                if "lag " in str(q.get("result"))
            ]
        )
    print(
        f"stuck motors found in {found} of {runs['Stuck']} runs" + (f"; missed: {', '.join(missed)}" if missed else "")
    )
    print(
        f"runs with a motor flagged that is not stuck: {len(wrong)} of {sum(runs.values())}, by readings at the end of its range {ends}"
    )
    for line in wrong:
        print(f"  {line}")
    if lags:
        print(f"lags behind the command in healthy runs: {min(lags):.2f} to {max(lags):.2f} s")


if __name__ == "__main__":
    main()
