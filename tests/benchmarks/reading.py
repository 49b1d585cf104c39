"""CPU time and memory of reading a log whole; run as `python tests/benchmarks/reading.py [--folder FOLDER]`.

The log is the benchmark's: JointState of six and TwistStamped at 1 kHz, Odometry at 100 Hz. Every reader brings every
number into NumPy, in a process of its own; all figures of one run are comparable, those of two runs are not. The floor
maps the file and expands its chunks into one buffer, with and without checking their checksums.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from reading_logs import LOGS, log_at
from reading_peers import MAKERS, measured, our_measure

ROOT = Path(__file__).resolve().parents[2]
# (log, reader or floor, peer, the largest ratio of the first to the second)
GOALS = [("mcap-zstd", "ours", "floor+crc", 2.0), ("mcap-lz4", "ours", "floor+crc", 5.0)]
GOALS += [("mcap-none", "ours", "floor+crc", 5.0), ("mcap-zstd", "ours", "rerun", 1 / 3)]
GOALS += [(name, "ours", "rosbags", 1 / 30) for name in LOGS if name not in ("db3", "bag-bz2")]
GOALS += [("db3", "ours", "rosbags", 1 / 8)]
READERS = tuple(MAKERS)
SLOW = ("rosbags", "mcap-ros2")


def anonymous() -> int:
    """Bytes of memory of this process that no file backs."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("RssAnon"):
            return int(line.split()[1]) << 10
    return 0


class Watch(threading.Thread):
    """Samples this process's memory every few milliseconds."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.peak, self.ended = 0, threading.Event()

    def run(self) -> None:
        while not self.ended.wait(0.003):
            self.peak = max(self.peak, anonymous())


def child(reader: str, path: Path, repeats: int, memory: bool) -> None:
    """Measure one reader on one log and print the figures as JSON."""
    sys.path.insert(0, str(ROOT))
    try:
        run = MAKERS[reader](path)
    except ImportError as error:
        print(json.dumps({"absent": str(error)}))
        return
    if memory:  # one run alone in the process; the imports' share is taken off
        if reader == "ours":
            run()  # loads compiled code
        before, watch = anonymous(), Watch()
        watch.start()
        out = run()
        watch.ended.set()
        watch.join()
        rows, _, size = our_measure(out) if reader == "ours" else measured(*out) if out else (0, 0.0, 0)
        whole = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        print(json.dumps({"rows": rows, "bytes": size, "anon": watch.peak - before, "rss": whole << 10}))
        return
    out = run()
    rows, total, _ = our_measure(out) if reader == "ours" else measured(*out) if out else (0, 0.0, 0)
    del out
    cpu, wall = [], []
    for _ in range(repeats):
        begin, start = time.process_time(), time.perf_counter()
        out = run()
        cpu.append(time.process_time() - begin)
        wall.append(time.perf_counter() - start)
        del out
    print(json.dumps({"cpu": statistics.median(cpu), "wall": statistics.median(wall), "rows": rows, "sum": total}))


def measure(reader: str, path: Path, repeats: int, memory: bool = False) -> dict[str, Any]:
    command = [sys.executable, __file__, "--child", reader, "--log", str(path), "--repeats", str(repeats)]
    done = subprocess.run([*command, *(["--memory"] if memory else [])], capture_output=True, text=True, check=False)
    if done.returncode:
        return {"absent": done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "it was killed"}
    figures: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return figures


def table(arguments: argparse.Namespace) -> None:
    """Measure and print everything asked for."""
    arguments.folder.mkdir(parents=True, exist_ok=True)
    found: dict[tuple[str, str], dict[str, Any]] = {}
    print(f"{arguments.duration:g} s; CPU s (wall s), medians of {arguments.repeats}, slow peers {arguments.slow}")
    for name in arguments.logs:
        path = log_at(arguments.folder, name, arguments.duration)
        for reader in arguments.readers:
            if not name.startswith("mcap") and reader not in ("ours", "rosbags"):
                continue
            figures = measure(reader, path, arguments.slow if reader in SLOW else arguments.repeats)
            found[name, reader] = figures
            if "absent" in figures:
                print(f"{name:10} {reader:10} left out: {figures['absent']}", flush=True)
                continue
            text = f"{name:10} {reader:10} {figures['cpu']:8.4f} ({figures['wall']:.4f})"
            if not reader.startswith("floor"):
                text += f"  {figures['rows']} rows, sum {figures['sum']:.6g}"
                if not arguments.no_memory:
                    used = measure(reader, path, 1, True)
                    ratio = used["anon"] / max(used["bytes"], 1)
                    text += f"; output {used['bytes'] / 1e6:.0f} MB, peak {used['anon'] / 1e6:.0f} MB over imports"
                    text += f" = {ratio:.2f}×, process {used['rss'] / 1e6:.0f} MB"
            print(text, flush=True)
    for name, mine, peer, goal in GOALS:
        pair = [found.get((name, who), {}).get("cpu") for who in (mine, peer)]
        if None not in pair:
            ratio = pair[0] / pair[1]
            met = "met" if ratio <= goal else "MISSED"
            if goal < 1:
                print(f"goal {name}: {1 / ratio:.1f}× faster than {peer}, goal {1 / goal:.0f}×: {met}")
            else:
                print(f"goal {name}: {ratio:.2f}× {peer}, goal ≤ {goal:g}×: {met}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, help="where the logs are made and kept; default: made anew")
    parser.add_argument("--duration", type=float, default=120.0, help="length of the log [s]")
    parser.add_argument("--repeats", type=int, default=7, help="runs per figure")
    parser.add_argument("--slow", type=int, default=3, help="runs per figure of rosbags and mcap-ros2")
    parser.add_argument("--logs", nargs="+", choices=LOGS, default=list(LOGS))
    parser.add_argument("--readers", nargs="+", choices=READERS, default=list(READERS))
    parser.add_argument("--no-memory", action="store_true", help="do not measure memory")
    parser.add_argument("--child", choices=READERS, help=argparse.SUPPRESS)
    parser.add_argument("--log", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--memory", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        child(arguments.child, arguments.log, arguments.repeats, arguments.memory)
    elif arguments.folder is None:
        with tempfile.TemporaryDirectory() as folder:
            arguments.folder = Path(folder)
            table(arguments)
    else:
        table(arguments)


if __name__ == "__main__":
    main()
