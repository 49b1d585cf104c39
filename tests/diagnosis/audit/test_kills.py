"""Audits and their children ended by force at random moments, from a fixed seed: the short form of `tests/benchmarks/kills.py`."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from diagnosis.audit.isolation.child import Work
from diagnosis.audit.isolation.forks import ForkServer
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.isolation.run import run_isolated
from diagnosis.audit.store.outcome import Outcome
from diagnosis.audit.store.store import Store
from replay.machine.config import haulotte
from tests.campaigns import campaign
from tests.diagnosis.audit import samples
from tests.diagnosis.audit.samples import asked_for, missions, run

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="children are forked on Linux")
_WORKS = tuple(f"slow-{i}" for i in range(8))
_AUDIT = """
import sys
from pathlib import Path
from diagnosis.audit import engines
from diagnosis.audit.session import audit
from tests.diagnosis.audit.samples import COLD, asked_for, missions
def tell(event, facts):
    if event == "mission":
        print(facts["name"], flush=True)
logs, out, *works = sys.argv[1:]
audit(missions(Path(logs), *works), asked_for(Path(out)), lambda: engines.local(2, COLD), tell)
"""


def test_children_that_others_end_are_no_crash_and_are_done_by_the_next_audit(tmp_path: Path) -> None:
    draw, over, ended = random.Random(20260), threading.Event(), list[int]()

    def end_now_and_then() -> None:
        while not over.wait(draw.uniform(0.0, 0.3)):
            servers = _children(os.getpid())
            victims = [one for server in servers for one in _children(server)]
            with suppress(ProcessLookupError):
                if victims:
                    os.kill(draw.choice(victims), signal.SIGKILL)
                    ended.append(1)

    killer = threading.Thread(target=end_now_and_then)
    killer.start()
    ends, _ = run(missions(tmp_path / "logs", *_WORKS), asked_for(tmp_path / "out"))
    over.set()
    killer.join()
    assert ended
    assert {end.state for end in ends.values()} <= {"ok", "unreadable"}
    assert all("from outside by SIGKILL" in end.reason for end in ends.values() if end.state != "ok")
    ends, _ = run(missions(tmp_path / "logs", *_WORKS), asked_for(tmp_path / "out"))
    assert {end.state for end in ends.values()} == {"ok"}
    assert [p.name for p in (tmp_path / "out" / ".work").iterdir()] == ["claims"]


@pytest.mark.parametrize("kills", campaign([1, 3]))
def test_audits_that_are_ended_lose_nothing_that_they_acknowledged(tmp_path: Path, kills: int) -> None:
    draw, told = random.Random(20261), list[str]()
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    places = (Path(samples.__file__).parents[3], Path(samples.__file__).parent)
    environment = os.environ | {"TMPDIR": str(temporary), "PYTHONPATH": os.pathsep.join(map(str, places))}
    words = [sys.executable, "-c", _AUDIT, str(tmp_path / "logs"), str(tmp_path / "out"), *_WORKS]
    for kill in (*[True] * kills, False):
        with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            for line in process.stdout:
                told.append(line.strip())
                if kill:
                    time.sleep(draw.uniform(0.0, 0.3))
                    process.kill()
                    kill = False
        if (tmp_path / "out" / "fleet.sqlite").is_file():
            with Store.open(tmp_path / "out" / "fleet.sqlite") as store:
                assert store.database.rows("PRAGMA integrity_check")[0][0] == "ok"
                kept = {one.name for one in store.missions() if one.result is not None and one.result.state == "ok"}
            assert set(told) <= kept
    assert sorted(told) == sorted(_WORKS)  # each exactly once
    assert [p.name for p in (tmp_path / "out" / ".work").iterdir()] == ["claims"]
    assert list(temporary.glob("mfhca-*")) == []


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_server_that_others_end_while_it_starts_costs_no_mission(number: signal.Signals, tmp_path: Path) -> None:
    server, ends = ForkServer(), list[Outcome]()
    server.start()
    assert server._process is not None
    process = server._process
    work = Work((str(tmp_path),), haulotte(), "", "", "", str(tmp_path), str(tmp_path))
    waiting = threading.Thread(target=lambda: ends.append(run_isolated(work, Limits(), server)))
    waiting.start()
    end = time.monotonic() + 20
    while not (server._waiting and _heeds(process.pid)) and time.monotonic() < end:
        time.sleep(0.01)
    process.send_signal(number)
    waiting.join()
    assert [(e.state, e.passing, e.killed, e.reason) for e in ends] == [
        ("unreadable", True, True, f"the process that starts missions ended with {number.name}")
    ]
    server.close()


def _heeds(pid: int) -> bool:
    """Whether a process has a handler of its own for SIGTERM."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("SigCgt:"):
            return bool(int(line.split()[1], 16) >> (signal.SIGTERM - 1) & 1)
    return False


def _children(pid: int) -> list[int]:
    out: list[int] = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            out += [int(word) for word in path.read_text(encoding="ascii").split()]
    return out
