"""What auditing costs and survives; run as `python tests/benchmarks/audit.py [--runs N] [--missions N] [--kills N] …`.

- isolation: a mission of 240 s at 1 kHz diagnosed in this process and in a child, both warm; the difference is what the
  child costs.
- scaling: missions of 60 s with ``-j 1`` on one processor and ``-j 2`` on two, on the command line, everything included.
- resume: a finished audit again. Its logs are made-up texts that end as unreadable; what a resume does does not depend
  on how they ended.
- kills: an audit of short missions is ended by SIGKILL at random moments, one in five while it starts and the others after
  its next mission, and started again until it is complete; what it had acknowledged in its events must stand in the store, whole, and the rest is done exactly once more.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import shutil
import signal
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from diagnosis.audit.isolation import child  # noqa: E402
from diagnosis.audit.isolation.child import Work  # noqa: E402
from diagnosis.audit.isolation.limits import Limits  # noqa: E402
from diagnosis.audit.isolation.run import ForkServer, run_isolated  # noqa: E402
from replay.export.mission import write_mission  # noqa: E402
from replay.machine.config import haulotte  # noqa: E402
from replay.simulation.options import SimulationOptions  # noqa: E402
from replay.simulation.run import simulate_mission  # noqa: E402


def simulate(path: Path, seconds: float, rate: float, seed: int) -> Path:
    options = SimulationOptions(scenario="random", seed=seed, duration_s=seconds, rate_hz=rate)
    write_mission(simulate_mission(options), path, "mcap")
    return path


def audit(*words: str, processors: int | None = None) -> tuple[float, int]:
    """Wall time and exit code of a command line, on so many processors."""
    start = time.perf_counter()
    bound = [] if processors is None else ["taskset", "-c", ",".join(map(str, range(processors)))]
    done = subprocess.run([*bound, *command(*words)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    return time.perf_counter() - start, done.returncode


def command(*words: str) -> list[str]:
    call = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from cli.main import main; main()"
    return [sys.executable, "-c", call, "audit", *words]


def isolation(folder: Path, runs: int) -> None:
    log = simulate(folder / "long.mcap", 240.0, 1000.0, 11)
    server = ForkServer()
    times: dict[str, list[tuple[float, float]]] = {"here": [], "child": []}
    for turn in range(runs + 1):
        for kind, found in times.items():
            own, temporary = folder / f"{kind}-{turn}", folder / f"{kind}-{turn}-tmp"
            own.mkdir()
            temporary.mkdir()
            work = Work((str(log),), haulotte(), "", "", "", str(own), str(temporary))
            start, used = time.perf_counter(), _used()
            if kind == "here":
                child.judge(work)
                cpu = _used() - used
            else:
                cpu = run_isolated(work, Limits(), server).cpu_s
            if turn:  # the first warms up
                found.append((time.perf_counter() - start, cpu))
    server.close()
    wall, cpu = ({k: statistics.median(t[i] for t in found) for k, found in times.items()} for i in (0, 1))
    for name, one in (("wall", wall), ("CPU", cpu)):
        share = one["child"] / one["here"] - 1
        print(f"isolation, {name}: {one['here']:.2f} s here, {one['child']:.2f} s in a child ({share:+.1%})")


def _used() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def scaling(folder: Path, missions: int, seconds: float, logs: Path, all_jobs: list[int]) -> None:
    logs.mkdir(parents=True, exist_ok=True)
    missing = [i for i in range(missions) if not (logs / f"m{i:04d}.mcap").exists()]
    with ProcessPoolExecutor() as pool:
        made = [pool.submit(simulate, logs / f"m{i:04d}.mcap", seconds, 1000.0, 100 + i) for i in missing]
        for one in made:
            one.result()
    names = [str(logs / f"m{i:04d}.mcap") for i in range(missions)]
    for jobs in all_jobs:
        out = folder / f"out{jobs}"
        took, code = audit(*names, "-o", str(out), "-j", str(jobs), processors=jobs)
        shutil.rmtree(out)  # 15 MB a mission
        print(
            f"-j {jobs}: {missions} missions of {seconds:.0f} s in {took:.1f} s, {missions / took * 60:.0f}/min, code {code}",
            flush=True,
        )


def resume(folder: Path, missions: int) -> None:
    logs = folder / "texts"
    logs.mkdir()
    for i in range(missions):
        (logs / f"m{i:04d}.mcap").write_text(f"no log {i}\n", encoding="utf-8")
    first, _ = audit(str(logs), "-o", str(folder / "resumed"))
    again = [audit(str(logs), "-o", str(folder / "resumed"))[0] for _ in range(3)]
    print(f"resume: {missions} unreadable logs in {first:.1f} s, again in {statistics.median(again):.2f} s")


def kills(folder: Path, count: int, seed: int) -> None:
    logs = folder / "short"
    logs.mkdir()
    for i in range(10):
        simulate(logs / f"m{i:02d}.mcap", 12.0, 100.0, 500 + i)
    draw = random.Random(seed)
    done = complete = lost = again = orphans = left = 0
    out = folder / "killed"
    while done < count:
        events = folder / "events.jsonl"
        start = time.perf_counter()
        process = subprocess.Popen(
            command(str(logs), "-o", str(out), "-j", "2", "--events", str(events)),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        before = len(_ended(events))
        if draw.random() < 0.2:
            _wait(process, draw.uniform(0.1, 5.0))
        else:
            while process.poll() is None and len(_ended(events)) == before:
                time.sleep(0.02)
            _wait(process, draw.uniform(0.0, 1.5))
        if process.poll() is None:
            children = _below(process.pid)
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            done += 1
            orphans += _still_there(children)
        lost, again = lost + _lost(out, events), again + _again(events)
        if process.returncode >= 0:
            complete += 1
            left += sum(1 for p in (out / ".work").iterdir() if p.name != "claims")
            shutil.rmtree(out)
            events.unlink()
        print(f"\r{done} kills, {complete} completed, {time.perf_counter() - start:.1f} s", end="", file=sys.stderr)
    print(
        f"\nkills: {done}; {complete} audits completed; acknowledged and lost {lost}, done again {again}, processes left "
        f"{orphans}, folders left after completion {left}"
    )


def _wait(process: subprocess.Popen[bytes], seconds: float) -> None:
    with suppress(subprocess.TimeoutExpired):
        process.wait(seconds)


def _lost(out: Path, events: Path) -> int:
    """Missions that were acknowledged but do not stand in the store with a whole report."""
    if not _ended(events):
        return 0
    store = sqlite3.connect(out / "fleet.sqlite")
    try:
        if store.execute("PRAGMA integrity_check").fetchone() != ("ok",):
            return 1_000_000
        query = "SELECT m.name, r.report FROM mission m JOIN result r ON r.id = m.result"
        stored = dict(store.execute(query).fetchall())
    finally:
        store.close()
    lost = 0
    for name in _ended(events):
        report = stored.get(name)
        try:
            json.loads((out / str(report) / "report.json").read_bytes())
            whole = (out / str(report) / "report.html").read_bytes().rstrip().endswith(b"</html>")
        except (OSError, ValueError):
            whole = False
        lost += not whole
    return lost


def _again(events: Path) -> int:
    names = _ended(events)
    return len(names) - len(set(names))


def _ended(events: Path) -> list[str]:
    if not events.is_file():
        return []
    lines = [json.loads(line) for line in events.read_text(encoding="utf-8").splitlines() if line.endswith("}")]
    return [line["name"] for line in lines if line["event"] == "mission"]


def _below(pid: int) -> list[int]:
    out = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            found = [int(word) for word in path.read_text(encoding="ascii").split()]
        except OSError:
            continue
        for one in found:
            out += [one, *_below(one)]
    return out


def _still_there(pids: list[int]) -> int:
    end = time.monotonic() + 5.0
    while time.monotonic() < end and any(_alive(pid) for pid in pids):
        time.sleep(0.05)
    return sum(_alive(pid) for pid in pids)


def _alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="runs of the isolation; 0: none")
    parser.add_argument("--missions", type=int, default=60, help="missions of the scaling; 0: none; 1000 in full")
    parser.add_argument("--seconds", type=float, default=60.0, help="length of each")
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2], help="of the scaling")
    parser.add_argument("--logs", type=Path, help="folder to keep their logs in, for another run")
    parser.add_argument("--resume", type=int, default=1000, help="missions of the resumed audit; 0: none")
    parser.add_argument("--kills", type=int, default=50, help="kills; 0: none; 500 in full")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mfhca-benchmark-") as name:
        folder = Path(name)
        if given.runs:
            isolation(folder, given.runs)
        if given.missions:
            scaling(folder, given.missions, given.seconds, given.logs or folder / "logs", given.jobs)
        if given.resume:
            resume(folder, given.resume)
        if given.kills:
            kills(folder, given.kills, given.seed)


if __name__ == "__main__":
    main()
