"""What auditing costs; run as `python tests/benchmarks/audit.py [--runs N] [--missions N] [--dask] …`.

- isolation: a mission of 240 s at 1 kHz diagnosed in this process and in a child, both warm; the difference is what the
  child costs.
- scaling: missions of 60 s with ``-j 1`` on one processor and ``-j 2`` on two, on the command line, everything included.
- dask: the same missions on two workers of a cluster on this machine's loopback, against ``-j 2``.
- resume: a finished audit again. Its logs are made-up texts that end as unreadable; what a resume does does not depend
  on how they ended.

Wall time says something on a quiet machine alone; so the processor's time of all processes stands beside it. Where two at once
take as much of it as one after the other, nothing but the serial part of an audit keeps two processors from being twice one:
"at best" is what is left of 2 by both.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from audit_runs import below, command, simulate

from diagnosis.audit.isolation import child
from diagnosis.audit.isolation.child import Work
from diagnosis.audit.isolation.forks import ForkServer
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.isolation.run import run_isolated
from replay.machine.config import haulotte

_CLUSTER = (
    "import sys\nfrom distributed import LocalCluster\n"
    "if __name__ == '__main__':\n"
    "    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host='127.0.0.1') as c:\n"
    "        print(c.scheduler_address, flush=True)\n"
    "        sys.stdin.read()\n"
)


@dataclass(frozen=True)
class Taken:
    """Wall time and time of processors [s], and exit code."""

    wall: float
    cpu: float
    code: int


def audit(*words: str, processors: int | None = None, more: Callable[[], float] = lambda: 0.0) -> Taken:
    """Run a command line on so many processors; `more` gives time of processors taken elsewhere so far [s]."""
    start, before, elsewhere = time.perf_counter(), _used(resource.RUSAGE_CHILDREN), more()
    bound = [] if processors is None else ["taskset", "-c", ",".join(map(str, range(processors)))]
    done = subprocess.run([*bound, *command(*words)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    cpu = _used(resource.RUSAGE_CHILDREN) - before + more() - elsewhere
    return Taken(time.perf_counter() - start, cpu, done.returncode)


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


def _used(whose: int = resource.RUSAGE_SELF) -> float:
    used = resource.getrusage(whose)
    return used.ru_utime + used.ru_stime


def logs_of(folder: Path, missions: int, seconds: float) -> list[str]:
    """Missions in a folder; those that are not there yet are simulated."""
    folder.mkdir(parents=True, exist_ok=True)
    names = [folder / f"m{i:04d}.mcap" for i in range(missions)]
    with ProcessPoolExecutor() as pool:
        made = [
            pool.submit(simulate, name, seconds, 1000.0, 100 + i) for i, name in enumerate(names) if not name.exists()
        ]
        for one in made:
            one.result()
    return [str(name) for name in names]


def scaling(folder: Path, names: list[str], all_jobs: list[int]) -> dict[int, Taken]:
    """Audit with so many jobs on as many processors."""
    found = {}
    for jobs in all_jobs:
        out = folder / f"out{jobs}"
        alone = audit(names[0], "-o", str(out), "-j", str(jobs), processors=jobs)  # starting, warming up, the page
        shutil.rmtree(out)
        found[jobs] = one = audit(*names, "-o", str(out), "-j", str(jobs), processors=jobs)
        shutil.rmtree(out)  # 15 MB a mission
        print(
            f"-j {jobs}: {len(names)} missions in {one.wall:.1f} s ({len(names) / one.wall * 60:.0f}/min), {one.cpu:.1f} s of "
            f"processors, code {one.code}; one mission alone takes {alone.cpu:.1f} s of processors",
            flush=True,
        )
        if jobs == 2 and 1 in found:
            each = (one.cpu - alone.cpu) / max(len(names) - 1, 1)
            serial = max(alone.cpu - each, 0.0)
            best = found[1].cpu / (serial + (one.cpu - serial) / 2)
            print(
                f"scaling: wall {found[1].wall / one.wall:.2f}, at best {best:.2f}, processors' time {one.cpu / found[1].cpu:.3f}"
            )
    return found


def dask(folder: Path, names: list[str], local: Taken) -> None:
    """The same missions on two workers of this machine."""
    script = folder / "cluster.py"
    script.write_text(_CLUSTER, encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, str(script)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as cluster:
        assert cluster.stdout is not None
        address = cluster.stdout.readline().strip()
        out = folder / "dask"
        one = audit(
            *names, "-o", str(out), "--dask", address, more=lambda: sum(map(_of, (cluster.pid, *below(cluster.pid))))
        )
        cluster.communicate()
    shutil.rmtree(out)
    print(
        f"dask: {len(names)} missions in {one.wall:.1f} s, {one.cpu:.1f} s of processors, code {one.code}; against -j 2: wall "
        f"{local.wall / one.wall:.2f}, processors' time {local.cpu / one.cpu:.2f}"
    )


def _of(pid: int) -> float:
    """Time of a process and of those below it that have ended [s]."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(map(int, words[11:15])) / os.sysconf("SC_CLK_TCK")


def resume(folder: Path, missions: int) -> None:
    logs = folder / "texts"
    logs.mkdir()
    for i in range(missions):
        (logs / f"m{i:04d}.mcap").write_text(f"no log {i}\n", encoding="utf-8")
    first = audit(str(logs), "-o", str(folder / "resumed"))
    again = statistics.median(audit(str(logs), "-o", str(folder / "resumed")).wall for _ in range(3))
    print(f"resume: {missions} unreadable logs in {first.wall:.1f} s, again in {again:.2f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="runs of the isolation; 0: none")
    parser.add_argument("--missions", type=int, default=60, help="missions of the scaling; 0: none; 1000 in full")
    parser.add_argument("--seconds", type=float, default=60.0, help="length of each")
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2], help="of the scaling")
    parser.add_argument("--dask", action="store_true", help="the same missions on two workers too; after 2 jobs")
    parser.add_argument("--logs", type=Path, help="folder to keep their logs in, for another run")
    parser.add_argument("--resume", type=int, default=1000, help="missions of the resumed audit; 0: none")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mfhca-benchmark-") as name:
        folder = Path(name)
        if given.runs:
            isolation(folder, given.runs)
        if given.missions:
            names = logs_of(given.logs or folder / "logs", given.missions, given.seconds)
            found = scaling(folder, names, given.jobs)
            if given.dask and 2 in found:
                dask(folder, names, found[2])
        if given.resume:
            resume(folder, given.resume)


if __name__ == "__main__":
    main()
