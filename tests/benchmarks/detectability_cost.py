"""Share of a diagnosis that goes into what the mission would have shown: `python tests/benchmarks/detectability_cost.py [--duration S]`.

A mission is simulated with each level of evidence and diagnosed warm under the profiler, without the page. The whole command
takes longer, so that its share is smaller.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import mfhca

ROOT = Path(__file__).resolve().parents[2]
STAGES = {"detectable": "what it would have shown", "checks_of": "checks of the all-clear"}


def main() -> None:
    """Simulate, diagnose twice, print."""
    parser = argparse.ArgumentParser(description="Share of detectability in a diagnosis.")
    parser.add_argument("--duration", type=float, default=240.0, help="length of the missions [s]")
    duration = parser.parse_args().duration
    with tempfile.TemporaryDirectory() as folder:
        for evidence in ("base", "spool", "direct"):
            log = Path(folder) / f"{evidence}.mcap"
            mfhca.simulate(log, scenario="paper", evidence=evidence, duration_s=duration, rate_hz=1000.0, seed=3)
            machine = ROOT / "sample_logs" / "haulotte.toml"
            mfhca.diagnose(log, machine=machine)
            profile = cProfile.Profile()
            profile.runcall(mfhca.diagnose, log, machine=machine)
            stats = pstats.Stats(profile).get_stats_profile()
            shares = ", ".join(
                f"{words} {100.0 * stats.func_profiles[name].cumtime / stats.total_tt:.1f} %"
                for name, words in STAGES.items()
            )
            print(f"{evidence:7} {stats.total_tt:6.2f} s: {shares}", flush=True)


if __name__ == "__main__":
    main()
