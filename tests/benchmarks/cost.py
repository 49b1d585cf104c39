"""Time, memory and size of `mfhca diagnose`; run as `python tests/benchmarks/cost.py [--runs N] [--duration S] LOG…`.

Without a log a mission of 240 s at 1 kHz is simulated, with `--evidence` base, spool or direct. The cold run has empty caches of compiled
code and compiles; the first one has them empty too, and uses what the installation compiled, if it did; the warm ones find them filled. One
unit is the CPU time of a Python loop of ten million additions, taken beside each warm run (`hot_paths.py`); with `taskset -c 0` before the command all of it is of one core. Stages are the times between the lines that ``--verbose`` prints.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from hot_paths import unit

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Cost:
    """Wall and CPU time [s], largest memory [MB], and seconds after each progress line."""

    wall: float
    cpu: float
    peak_mb: float
    stages: dict[str, float]


def measure(arguments: list[str], caches: Path, **variables: str) -> Cost:
    """Run the command once in a process of its own."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(caches / "numba"), "PYTHONPYCACHEPREFIX": str(caches / "pyc")}
    environment |= variables
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # else no run would be warm
    begin = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "cli.main", *arguments],
        cwd=ROOT,
        env=environment,
        text=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    marks: list[tuple[str, float]] = [("start", begin)]
    assert process.stderr is not None
    with process.stderr as lines:
        marks += [(text.strip(), time.perf_counter()) for text in lines]
    _, status, usage = os.wait4(process.pid, 0)
    end = time.perf_counter()
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(arguments)} ended with {process.returncode}: {marks[-1][0]}")
    stages: dict[str, float] = {}
    for (name, a), b in zip(marks, [t for _, t in marks[1:]] + [end], strict=True):
        stages[name] = stages.get(name, 0.0) + b - a
    return Cost(end - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, stages)


def simulate(folder: Path, duration: float, evidence: str) -> Path:
    """A log of the paper's mission at 1 kHz."""
    log = folder / f"mission-{duration:g}s-{evidence}.mcap"
    words = ["-q", "simulate", "-o", str(log), "--duration", str(duration), "--evidence", evidence]
    subprocess.run([sys.executable, "-m", "cli.main", *words], cwd=ROOT, check=True)
    return log


def report(log: Path, runs: int, folder: Path) -> None:
    """Print the cost of one log."""
    output, caches = folder / "report", folder / "caches"
    arguments = ["-v", "diagnose", str(log.resolve()), "-o", str(output)]
    cold = measure(arguments, caches, MFHCA_KERNELS="0")
    first = measure(arguments, folder / "empty", PYTHONPYCACHEPREFIX=str(caches / "pyc"))
    warm, loops = [], []
    for _ in range(runs):
        loops.append(unit())
        warm.append(measure(arguments, caches))
    print(f"{log.name}: {log.stat().st_size / 1e6:.1f} MB")
    for name, one in (("cold", cold), ("first", first)):
        print(f"  {name:5} {one.wall:6.2f} s wall, {one.cpu:6.2f} s CPU, {one.peak_mb:6.0f} MB")
    wall, cpu, peak = (statistics.median(getattr(c, k) for c in warm) for k in ("wall", "cpu", "peak_mb"))
    print(f"  warm  {wall:6.2f} s wall, {cpu:6.2f} s CPU, {peak:6.0f} MB  (medians of {runs})")
    print(f"  warm  {statistics.median(c.cpu / u for c, u in zip(warm, loops, strict=True)):6.2f} units of CPU")
    for name in warm[-1].stages:
        print(f"    {statistics.median(c.stages.get(name, 0.0) for c in warm):6.2f} s  {name}")
    sizes = ", ".join(f"{p.name} {p.stat().st_size / 1e6:.2f} MB" for p in sorted(output.iterdir()))
    print(f"  {sizes}")


def main() -> None:
    """Measure help, then each log."""
    parser = argparse.ArgumentParser(description="Time, memory and size of `mfhca diagnose`.")
    parser.add_argument("logs", metavar="LOG", type=Path, nargs="*")
    parser.add_argument("--runs", type=int, default=5, help="warm runs")
    parser.add_argument("--evidence", choices=("base", "spool", "direct"), default="direct", help="of that mission")
    parser.add_argument("--duration", type=float, default=240.0, help="of the simulated mission [s]")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        helps = [measure(["--help"], folder / "help-caches").wall for _ in range(asked.runs + 1)]
        print(f"--help: cold {helps[0]:.2f} s, warm {statistics.median(helps[1:]):.2f} s")
        for log in asked.logs or [simulate(folder, asked.duration, asked.evidence)]:
            report(log, asked.runs, folder)


if __name__ == "__main__":
    main()
