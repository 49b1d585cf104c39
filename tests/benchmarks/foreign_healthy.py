"""False alarms on healthy missions of the reference data's foreign plant: `python tests/benchmarks/foreign_healthy.py --count 50`.

Its own script makes the missions, with seeds, gains, lags, slopes, ice and noise of ours, under the law with forced Ψ̂ or the
printed one. The data lies where ``MFHCA_REFERENCE_DATA`` says.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from foreign_machine import maker, missions, scenario

from diagnosis.pipeline import diagnose_mission

ROWS = ("stuck", "no_signal", "inefficient", "noisy", "outside_table")


def main() -> None:
    """Make, diagnose, count, print."""
    parser = argparse.ArgumentParser(description="False alarms on healthy missions of a foreign plant.")
    parser.add_argument("--first", type=int, default=7000, help="first seed")
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--law", choices=("forced", "printed"), default="forced")
    asked = parser.parse_args()
    make, alarms, verdicts = maker(), 0, []
    for seed in range(asked.first, asked.first + asked.count):
        ((_, mission, machine),) = missions(make, scenario(make, seed, asked.law), ("base",))
        report = diagnose_mission(mission, machine).report
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
