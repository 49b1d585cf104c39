"""CPU time of the hot paths, beside a baseline; run as `python tests/benchmarks/hot_paths.py [--record]`.

One unit is the CPU time of a Python loop of ten million additions, taken before and after each path in the same run, so that
machines can be compared. Each figure is the smallest of `--runs`, on one core, with compiled code warm. Exit code 1 where a path takes
over 25 % more units than `hot_paths.json` beside this file has; `--record` writes that file anew.

`--quick` is for CI: one kind of mission, and only a path that seems slower, for want of compiled code too, is taken again, up to five
times. By how much all paths together (their median) differ from the baseline is the machine's, as far as that is less than a half, and
is taken off first.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.output import write_result
from diagnosis.pipeline import diagnose_mission
from replay.export.mission import write_mission
from replay.machine.config import haulotte
from replay.mission import load_mission
from replay.simulation.options import EvidenceLevel, SimulationOptions
from replay.simulation.run import simulate_mission

ROOT = Path(__file__).resolve().parents[2]
BASELINE = Path(__file__).with_suffix(".json")
TIERS: tuple[EvidenceLevel, ...] = ("base", "spool", "direct")
LOSS = 1.25
_MACHINE, _TRIES = 1.5, 5
_LOOP = (
    "import time\nt = time.process_time()\nx = 0\nfor i in range(10_000_000): x += i\nprint(time.process_time() - t)"
)
_MAIN = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from cli.main import main; main()"


def cpu_seconds(work: Callable[[], object]) -> float:
    """CPU time of some work in this process and in those that it starts [s]."""
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    before = [resource.getrusage(k) for k in kinds]
    work()
    after = [resource.getrusage(k) for k in kinds]
    return sum(a.ru_utime + a.ru_stime - b.ru_utime - b.ru_stime for a, b in zip(after, before, strict=True))


def unit() -> float:
    """CPU time of the loop [s], in a process of its own."""
    return float(subprocess.run([sys.executable, "-c", _LOOP], capture_output=True, check=True, text=True).stdout)


def command(*words: str) -> None:
    """Run `mfhca`; a log with faults ends with 1."""
    done = subprocess.run([sys.executable, "-c", _MAIN, *words], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(done.stderr)


def paths(folder: Path, duration: float, tiers: Sequence[EvidenceLevel] = TIERS) -> dict[str, Callable[[], object]]:
    """Every path by its name; simulating and what a path starts from are not in its time."""
    machine = haulotte()
    out: dict[str, Callable[[], object]] = {"mfhca --help": lambda: command("--help")}
    for tier in tiers:
        log = folder / f"{tier}.mcap"
        write_mission(simulate_mission(SimulationOptions(seed=1, duration_s=duration, evidence=tier)), log, "mcap")
        mission = load_mission([log], machine)
        out[f"judging, {tier}"] = lambda mission=mission: diagnose_mission(mission, machine)
        if tier == tiers[-1]:
            result = diagnose_mission(mission, machine)
            out["reading"] = lambda log=log: load_mission([log], machine)
            out["writing"] = lambda result=result: write_result(result, folder / "written")
            whole = ("diagnose", str(log), "-o", str(folder / "whole"), "-q")
            out["mfhca diagnose"] = lambda whole=whole: command(*whole)
    return out


def measured(asked: argparse.Namespace) -> dict[str, float]:
    """Units of every path."""
    found = {}
    with tempfile.TemporaryDirectory() as name:
        for path, work in paths(Path(name), asked.duration).items():
            work()  # compiles, and fills the system's cache of files
            taken = []
            for _ in range(asked.runs):
                loop = unit()
                seconds = cpu_seconds(work)
                taken.append(2.0 * seconds / (loop + unit()))
            found[path] = round(min(taken), 3)
    return found


def slower(units: Mapping[str, float], known: Mapping[str, float], *, machine: bool) -> list[str]:
    """Paths that lost; `machine`: after what all have in common."""
    ratios = {path: taken / known[path] for path, taken in units.items() if path in known}
    common = statistics.median(ratios.values()) if machine and ratios else 1.0
    return [path for path, ratio in ratios.items() if ratio > LOSS * min(max(common, 1.0), _MACHINE)]


def quickly(asked: argparse.Namespace, known: Mapping[str, float]) -> dict[str, float]:
    """Units of the paths of one kind of mission; again where one seems slower."""
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name:
        works = paths(Path(name), asked.duration, TIERS[-1:])
        again = list(works)
        for _ in range(_TRIES):
            for path in again:
                work = works[path]
                loop = unit()
                taken = 2.0 * cpu_seconds(work) / (loop + unit())
                found[path] = round(min(taken, found.get(path, taken)), 3)
            again = slower(found, known, machine=True)
            if not again:
                break
    return found


def main() -> int:
    """Measure, print, compare."""
    parser = argparse.ArgumentParser(description="CPU time of the hot paths, beside a baseline.")
    parser.add_argument("--duration", type=float, default=20.0, help="length of the missions, at 1 kHz [s]")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="as CI does")
    parser.add_argument("--json", type=Path, help="write what was measured")
    parser.add_argument("--record", action="store_true", help="write the baseline anew")
    asked = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    begin = time.monotonic()
    before = json.loads(BASELINE.read_text("utf-8"))["units"] if asked.quick else {}
    units = quickly(asked, before) if asked.quick else measured(asked)
    found = {"duration_s": asked.duration, "units": units}
    text = json.dumps(found, indent=2, ensure_ascii=False) + "\n"
    if asked.json:
        asked.json.write_text(text, "utf-8")
    if asked.record:
        BASELINE.write_text(text, "utf-8")
    known = json.loads(BASELINE.read_text("utf-8"))
    if known["duration_s"] != asked.duration:
        raise SystemExit(f"the baseline is of missions of {known['duration_s']:g} s; measure those, or --record")
    print("path               units   baseline")
    lost = slower(units, known["units"], machine=asked.quick)
    for path, taken in units.items():
        then = known["units"].get(path)
        print(
            f"{path:17s} {taken:6.2f}   {'—' if then is None else f'{then:8.2f}'}{'  slower' if path in lost else ''}"
        )
    print(f"{time.monotonic() - begin:.0f} s")
    if lost:
        print(f"over {100 * (LOSS - 1):.0f} % slower: {', '.join(lost)}")
    return bool(lost)


if __name__ == "__main__":
    sys.exit(main())
