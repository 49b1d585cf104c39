"""What an audit survives; run as `python tests/benchmarks/kills.py [--parents N] [--children N] [--seed S]`.

- parents: an audit of short missions is ended by SIGKILL at random moments, one in five while it starts and the others after its
  next mission, and started again until it is complete; what it had acknowledged in its events must stand in the store, whole, and the rest
  is done exactly once more.
- children: processes that diagnose missions, and one time in ten the one that starts them, are ended by SIGKILL, SIGTERM or SIGHUP at
  random moments. No mission may end as ``crashed``, no audit with 70, and one more audit completes what was not.
- a file system without locks, by a library whose flock() fails: one sentence and code 2, nothing spins. Needs a C compiler.

No process and no folder may stay behind in any of them. Exit code 1 where anything is wrong. A full disk: `full_disk.py`.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from audit_runs import (
    below,
    children_of,
    command,
    ended,
    ended_twice,
    left_behind,
    lost,
    short_missions,
    states,
    still_there,
    told,
)

_QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
_SIGNALS = (signal.SIGKILL,) * 8 + (signal.SIGTERM, signal.SIGHUP)
_EXPECTED = {0, 1, 3}
_NO_LOCKS = "#include <errno.h>\nint flock(int fd, int op) { errno = ENOLCK; return -1; }\n"


@dataclass
class Count:
    """What was counted; all but the first two should be 0."""

    kills: int = 0
    completed: int = 0
    lost: int = 0
    done_again: int = 0
    crashed: int = 0
    codes: int = 0
    processes_left: int = 0
    left: list[str] = field(default_factory=list)

    @property
    def wrong(self) -> bool:
        """Whether anything is."""
        return bool(self.lost or self.done_again or self.crashed or self.codes or self.processes_left or self.left)

    def __str__(self) -> str:
        return (
            f"{self.kills} kills, {self.completed} audits completed; acknowledged and lost {self.lost}, done again "
            f"{self.done_again}, crashed {self.crashed}, unexpected codes {self.codes}, processes left "
            f"{self.processes_left}, folders left {len(self.left)}"
        )


class Place:
    """An output with its events and a folder for temporary files of its own."""

    def __init__(self, folder: Path, logs: Path) -> None:
        self.logs, self.out, self.events, self.temporary = (
            logs,
            folder / "out",
            folder / "events.jsonl",
            folder / "temporary",
        )
        self.temporary.mkdir(parents=True)

    def start(self, *more: str) -> subprocess.Popen[bytes]:
        words = [str(self.logs), "-o", str(self.out), "-j", "2", "--events", str(self.events), *more]
        return subprocess.Popen(command(*words), env={**os.environ, "TMPDIR": str(self.temporary)}, **_QUIET)  # type: ignore[call-overload, no-any-return]

    def check(self, count: Count, code: int, *, left: bool = True) -> None:
        """Count what is wrong after an audit that ended by itself; `left`: also what it has left behind."""
        count.codes += code not in _EXPECTED
        count.crashed += sum(state == "crashed" for state in states(self.out).values())
        count.crashed += sum(one.get("state") == "crashed" for one in told(self.events))
        count.left += left_behind(self.out, self.temporary) if left else []

    def clear(self) -> None:
        shutil.rmtree(self.out)
        self.events.unlink()


def parents(place: Place, wanted: int, draw: random.Random) -> Count:
    """End audits."""
    count = Count()
    while count.kills < wanted or place.out.exists():  # the last one is completed too
        process = place.start()
        before = len(ended(place.events))
        if count.kills >= wanted:
            process.wait()
        elif draw.random() < 0.2:
            _wait(process, draw.uniform(0.1, 5.0))
        else:
            while process.poll() is None and len(ended(place.events)) == before:
                time.sleep(0.02)
            _wait(process, draw.uniform(0.0, 1.5))
        if process.poll() is None:
            started = below(process.pid)
            process.kill()
            process.wait()
            count.kills += 1
            count.processes_left += still_there(started)
        count.lost += lost(place.out, place.events)
        count.done_again += ended_twice(place.events)
        if process.returncode >= 0:
            count.completed += 1
            place.check(count, process.returncode)
            place.clear()
        print(f"\rparents: {count}", end="", file=sys.stderr, flush=True)
    return count


def children(place: Place, wanted: int, draw: random.Random) -> Count:
    """End what audits start."""
    count = Count()
    while count.kills < wanted:
        process = place.start()
        while process.poll() is None and count.kills < wanted:
            _wait(process, draw.uniform(0.0, 1.0))
            servers = children_of(process.pid)
            victims = servers if draw.random() < 0.1 else [one for server in servers for one in children_of(server)]
            if victims:
                with suppress(ProcessLookupError):
                    os.kill(draw.choice(victims), draw.choice(_SIGNALS))
                    count.kills += 1
        place.check(count, process.wait(), left=False)  # the next audit removes what a killed server has left
        last = place.start()  # nobody ends anything
        place.check(count, last.wait())
        count.lost += lost(place.out, place.events) + sum(s != "ok" for s in states(place.out).values())
        count.completed += 1
        place.clear()
        print(f"\rchildren: {count}", end="", file=sys.stderr, flush=True)
    return count


def without_locks(folder: Path, logs: Path) -> str:
    """Audit where flock() fails; what is wrong, else nothing."""
    compiler = shutil.which("cc")
    if compiler is None:
        print("no locks: left out, no C compiler")
        return ""
    source, library, out = folder / "no_locks.c", folder / "no_locks.so", folder / "out"
    folder.mkdir()
    source.write_text(_NO_LOCKS, encoding="ascii")
    subprocess.run([compiler, "-shared", "-fPIC", "-o", str(library), str(source)], check=True)
    environment = {**os.environ, "LD_PRELOAD": str(library)}
    done = subprocess.run(
        command(str(logs), "-o", str(out)), env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    said = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
    files = sum(1 for _ in out.rglob("*"))
    print(f"no locks: code {done.returncode}, {files} files, {done.stderr.strip()}")
    fine = done.returncode == 2 and len(said) == 1 and "gives no locks" in said[0] and files < 10
    return "" if fine else "no locks"


def _wait(process: subprocess.Popen[bytes], seconds: float) -> None:
    with suppress(subprocess.TimeoutExpired):
        process.wait(seconds)


def main() -> int:
    """Kill, count, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parents", type=int, default=50, help="kills of audits; 0: none; 500 in full")
    parser.add_argument("--children", type=int, default=30, help="kills of what they start; 0: none; 200 in full")
    parser.add_argument("--missions", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    wrong = []
    with tempfile.TemporaryDirectory(prefix="mfhca-benchmark-") as name:
        folder = Path(name)
        logs = short_missions(folder / "logs", given.missions)
        for kind, kill, wanted in (("parents", parents, given.parents), ("children", children, given.children)):
            if wanted:
                count = kill(Place(folder / kind, logs), wanted, random.Random(given.seed))
                print(f"\n{kind}: {count}", *count.left[:10], flush=True)
                wrong += [kind] * count.wrong
        wrong += [found] if (found := without_locks(folder / "locks", logs)) else []
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
