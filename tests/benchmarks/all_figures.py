"""All benchmarks in short form and their table: `python tests/benchmarks/all_figures.py [NAME …] [--minutes M]`.

Runs each script below with few missions, repeats or seconds, and writes what it printed into `docs/benchmarks.md`, beside what it took in units: the
CPU time of a Python loop of ten million additions, taken before and after it. With names, those alone; what is not run keeps its
figures. `--minutes` ends the run after the script that is at work by then; the oldest figures come first. Exit code 1 where a script ended otherwise than stated.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hot_paths import unit

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PAGE = ROOT / "docs" / "benchmarks.md"
KEPT = Path(__file__).with_suffix(".json")
_HEAD = """# All benchmarks, short

Written by `python tests/benchmarks/all_figures.py`: each script with few missions, repeats or seconds, so that a change shows. The
figures to go by are in [How good it is](how-good.md), with the commands that make them in full. A dash: this form was not run.

A **unit** is the CPU time of a Python loop of ten million additions, taken before and after each script on the same machine, so that
machines can be compared; the time of all its processes is counted. Wall times in the output were taken on a machine that did other
work too: compare their ratios alone.

"""
_LINES = 24
_WIDEST = 170


@dataclass(frozen=True)
class Figure:
    """A benchmark in short form: what it says, its words, and exit codes that are no failure; `data`: it wants reference data."""

    subject: str
    script: str
    words: str = ""
    codes: tuple[int, ...] = (0,)
    data: bool = False

    @property
    def command(self) -> str:
        """As one would type it."""
        return f"{self.script} {self.words}".strip()


FIGURES = (
    Figure("the paper's machine", "accuracy.py", "--quick --count 1 --duration 60 --jobs 1"),
    Figure("the oracle", "bound.py", "--count 1 --duration 60 --jobs 1"),
    Figure("steering", "steering.py", "--count 1 --duration 60"),
    Figure("false alarms", "false_alarms.py", "--hours 0.1 --duration 60 --jobs 1"),
    Figure("all-clears", "all_clear.py", "--every 40 --healthy 2 --tiers base --jobs 1"),
    Figure("what missions say they would show", "detectability.py", "--missions 1 --faults 4 --jobs 1"),
    Figure("contradictions", "contradictions.py", "--count 1"),
    Figure("other structures", "structures.py", "--count 1 --duration 60 --evidence base --jobs 1"),
    Figure("varied machines", "variation.py", "--quick --count 1 --duration 60 --jobs 1"),
    Figure("simulated followers", "followers.py", "--count 1"),
    Figure("other laws", "counterfactual.py", "--count 1 --duration 60"),
    Figure("fitting", "fit_accuracy.py", "--machines 1 --seconds 60"),
    Figure("real robots", "robots.py", "--count 2", data=True),
    Figure("the motor rig", "rosa.py", data=True),
    Figure("the robot arm", "robot_arm.py", data=True),
    Figure("the foreign simulator, healthy", "foreign_healthy.py", "--count 2", data=True),
    Figure("clocks", "clocks.py", "--count 2"),
    Figure("damaged MCAP files", "damage.py", "--cuts 40 --flips 200"),
    Figure("damaged inputs of every format", "fuzz.py", "--minutes 1 --seed 1 --jobs 1"),
    Figure("hot paths", "hot_paths.py", "--runs 2", codes=(0, 1)),
    Figure("estimation and decision", "estimation_cost.py", "--duration 60"),
    Figure("reading beside peers", "reading.py", "--duration 20 --repeats 2 --no-memory"),
    Figure("opening and windows", "opening.py", "--gigabytes 0.1 --duration 60 --repeats 3"),
    Figure("tables", "tables.py", "--megabytes 4 --repeats 2"),
    Figure("protobuf and JSON messages", "forms.py", "--messages 5000 --runs 2"),
    Figure("`mfhca diagnose` whole", "cost.py", "--runs 2 --duration 60"),
    Figure("ten minutes under a memory limit", "long_mission.py", "--hours 0.17"),
    Figure("what auditing costs", "audit.py", "--runs 2 --missions 6 --seconds 20 --resume 100 --dask"),
    Figure("audits and children killed", "kills.py", "--parents 6 --children 10 --missions 6"),
    Figure("full disks", "full_disk.py", "--sizes 4"),
    Figure("the store", "store.py", "--missions 500"),
    Figure("a fleet page of 5000 missions", "fleet_page.py"),
    Figure("a fleet of 100 000 missions", "fleet_scale.py", codes=(0, 1)),
    Figure("forecasts of wear", "trends.py", "--count 1"),
    Figure("a valve that wears", "wear.py", "--count 1 --seconds 60"),
)


def run(figure: Figure, seconds: float) -> dict[str, Any]:
    """Run one and keep what it printed and took."""
    before, start = unit(), _used()
    try:
        done = subprocess.run(
            [sys.executable, str(HERE / figure.script), *figure.words.split()],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "160"},
            capture_output=True,
            text=True,
            timeout=seconds,
            check=False,
        )
        code, text = done.returncode, done.stdout or done.stderr
    except subprocess.TimeoutExpired:
        code, text = -1, f"took longer than {seconds:.0f} s"
    took, one = _used() - start, (before + unit()) / 2
    lines = [line.rpartition("\r")[2].rstrip() for line in text.splitlines()]
    return {
        "command": figure.command,
        "date": datetime.now(UTC).date().isoformat(),
        "code": code,
        "units": round(took / one, 1),
        "unit_s": round(one, 3),
        "lines": [line[:_WIDEST].replace(str(ROOT), ".") for line in lines if line.strip()][-_LINES:],
    }


def _used() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def page(kept: dict[str, dict[str, Any]]) -> str:
    """The page of what is known; scripts that were not run have a dash."""
    known = [(f, kept[f.script]) for f in FIGURES if f.script in kept]
    rows = ["| figures of | command | units | one unit | on |", "|---|---|---|---|---|"]
    for f in FIGURES:
        one = kept.get(f.script)
        rows.append(
            f"| [{f.subject}](#{_anchor(f)}) | `{one['command']}` | {one['units']:.0f} | {one['unit_s']:.3f} s | {one['date']} |"
            if one
            else f"| {f.subject} | `{f.command}` | – | – | – |"
        )
    parts = [f"## {_anchor(f)}\n\n```text\n" + "\n".join(one["lines"]) + "\n```\n" for f, one in known]
    return _HEAD + "\n".join(rows) + "\n\n" + "\n".join(parts)


def _anchor(figure: Figure) -> str:
    return figure.script.removesuffix(".py")


def main() -> int:
    """Run, keep, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="scripts, such as `store`; default: all")
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--each", type=float, default=1800.0, help="longest time of one script [s]")
    given = parser.parse_args()
    kept = json.loads(KEPT.read_text("utf-8")) if KEPT.is_file() else {}
    wanted = [f for f in FIGURES if not given.names or _anchor(f) in given.names]
    if unknown := set(given.names) - {_anchor(f) for f in FIGURES}:
        parser.error(f"no such benchmark: {', '.join(sorted(unknown))}")
    wanted.sort(key=lambda f: kept.get(f.script, {}).get("date", ""))
    begin, failed = datetime.now(UTC), []
    for figure in wanted:
        if (datetime.now(UTC) - begin).total_seconds() > 60.0 * given.minutes:
            break
        if figure.data and "MFHCA_REFERENCE_DATA" not in os.environ:
            print(f"{figure.script}: left out, MFHCA_REFERENCE_DATA is not set")
            continue
        one = run(figure, given.each)
        print(f"{one['command']}: code {one['code']}, {one['units']:.0f} units", flush=True)
        if one["code"] not in figure.codes:
            failed.append(figure.script)
            print(*one["lines"][-5:], sep="\n  ")
            continue
        kept[figure.script] = one
        KEPT.write_text(json.dumps(dict(sorted(kept.items())), indent=1, ensure_ascii=False) + "\n", "utf-8")
        PAGE.write_text(page(kept), "utf-8")
    if failed:
        print(f"failed: {', '.join(failed)}")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
