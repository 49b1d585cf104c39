from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from diagnosis.audit.isolation import fork_server
from diagnosis.audit.isolation.child import Work
from diagnosis.audit.isolation.fork_server import Ended, ServerLoop, Stopped, _Child
from diagnosis.audit.isolation.forks import ForkServer
from diagnosis.audit.isolation.fresh_process import Spawner
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.isolation.run import Isolation, run_isolated
from diagnosis.audit.store.outcome import Outcome
from replay.errors import OutputError
from replay.export.mission import write_mission
from replay.machine.config import haulotte
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign_of_rows

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits are held on Linux")
LIMITS = Limits(memory_mb=150, wall_s=15.0, file_mb=20)
SHORT = Limits(memory_mb=150, wall_s=0.5)
POISON = [
    ("fine", "ok", ""),
    ("damaged", "degraded", "12 bytes are missing"),
    ("kill", "unreadable", "ended from outside by SIGKILL; audit again"),
    ("hang", "timeout", "longer than 0.5 s; allow more with --timeout"),
    ("raise", "crashed", "internal error: KeyError: 'topic' (in poison.py, line "),
    ("segfault", "crashed", "ended with SIGSEGV (in string_at"),
    ("exhaust", "out_of_memory", "more than 150 MB"),
    ("exhaust_shared", "out_of_memory", "more than 150 MB"),
    ("leave", "crashed", "ended with code 5"),
    ("fill", "unreadable", "temporary data: File too large; make room or set TMPDIR"),
    ("cut", "crashed", "SIGBUS: a file became shorter while it was read (in _cut, poison.py, line "),
    ("broken", "unreadable", "x.bag ends at byte 12"),
    ("dumb", "degraded", "no wheel speed was found"),
]


def work_of(told: str, folder: Path, judge: str = "poison:judge") -> Work:
    temporary = folder / "tmp"
    temporary.mkdir()
    if judge == "poison:judge":
        (folder / "x.bag").write_text(told, encoding="utf-8")
        told = str(folder / "x.bag")
    return Work((told,), haulotte(), "test", "", "yard", str(folder), str(temporary), judge=judge)


@pytest.mark.parametrize(("told", "state", "reason"), POISON, ids=[p[0] for p in POISON])
def test_every_end_is_one_state_with_its_reason(
    told: str, state: str, reason: str, forks: Isolation, tmp_path: Path
) -> None:
    outcome = run_isolated(work_of(told, tmp_path), SHORT if told == "hang" else LIMITS, forks)
    assert outcome.state == state
    assert reason in outcome.reason
    assert outcome.peak_mb > 0


@pytest.mark.parametrize(
    ("told", "state", "reason"), campaign_of_rows([POISON[i] for i in (0, 3, 2, 5, 6)], 2), ids=lambda p: str(p)[:9]
)
def test_a_fresh_interpreter_gives_the_same_ends(told: str, state: str, reason: str, tmp_path: Path) -> None:
    outcome = run_isolated(work_of(told, tmp_path), SHORT if told == "hang" else LIMITS, Spawner())
    assert outcome.state == state
    assert reason in outcome.reason


@pytest.mark.parametrize("fresh", [False, True])
def test_a_mission_of_an_audit_is_worked_on_part_by_part(forks: Isolation, tmp_path: Path, fresh: bool) -> None:
    outcome = run_isolated(work_of("parts", tmp_path), LIMITS, Spawner() if fresh else forks)
    assert (outcome.state, outcome.reason) == ("degraded", "1 thread")


def test_processor_time_is_limited(forks: Isolation, tmp_path: Path) -> None:
    outcome = run_isolated(work_of("spin", tmp_path), Limits(150, 5.0, 1.0), forks)
    assert (outcome.state, outcome.reason) == ("timeout", "took more than 1 s of a processor; allow more with --cpu")


def test_a_report_without_a_place_is_no_end_of_the_mission(forks: Isolation, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="No space left on device"):
        run_isolated(work_of("unwritten", tmp_path), LIMITS, forks)


def test_a_child_ends_with_the_server_that_started_it(tmp_path: Path) -> None:
    server = ForkServer(warmed=False)
    work = work_of("spin", tmp_path)
    ends: list[Outcome] = []
    thread = threading.Thread(target=lambda: ends.append(run_isolated(work, Limits(150, 30.0), server)))
    thread.start()
    child = _first_child_of_server(server)
    assert server._process is not None
    os.kill(server._process.pid, signal.SIGKILL)
    thread.join()
    assert [(e.state, e.reason) for e in ends] == [
        ("unreadable", "the process that starts missions ended with SIGKILL")
    ]
    _wait_until_gone(child)
    again = run_isolated(work_of("fine", _made(tmp_path / "again")), LIMITS, server)  # it starts anew
    server.close()
    assert again.state == "ok"


def test_closing_the_server_ends_its_children_and_removes_their_folders(tmp_path: Path) -> None:
    server = ForkServer(warmed=False)
    work = work_of("hang", _made(tmp_path / "work"))

    def wait() -> None:
        with pytest.raises(Stopped):
            run_isolated(work, Limits(150, 30.0), server)

    thread = threading.Thread(target=wait)
    thread.start()
    child = _first_child_of_server(server)
    server.close()
    thread.join()
    _wait_until_gone(child)
    assert not (tmp_path / "work").exists()


def test_a_server_that_is_still_starting_ends_with_the_audit(tmp_path: Path) -> None:
    call = (
        "import time; from diagnosis.audit.isolation.forks import ForkServer; server = ForkServer(); server.start(); "
        "print(server._process.pid, flush=True); time.sleep(60)"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p), "TMPDIR": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", call], env=environment, stdout=subprocess.PIPE, text=True) as audit:
        assert audit.stdout is not None
        server = int(audit.stdout.readline())
        until = time.monotonic() + 20
        while not list(tmp_path.glob("*/warm.*")) and time.monotonic() < until:  # its made-up mission
            time.sleep(0.01)
        audit.kill()
    _wait_until_gone(server)
    assert not list(tmp_path.iterdir())


def test_a_real_log_is_diagnosed(forks: Isolation, mission_log: Path, tmp_path: Path) -> None:
    outcome = run_isolated(
        work_of(str(mission_log), tmp_path, "diagnosis.audit.isolation.child:judge"), Limits(), forks
    )
    assert outcome.state == "ok"
    assert outcome.summary is not None
    assert outcome.summary["result"]["machine_id"] == "yard"  # neither log nor machine file names one
    assert sorted(p.name for p in (tmp_path / "report").iterdir()) == ["report.html", "report.json", "report.parquet"]
    assert not list((tmp_path / "tmp").iterdir())


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def test_a_child_that_does_not_die_is_answered_for_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[int, Ended]] = []
    server = ServerLoop.__new__(ServerLoop)
    server._connection = SimpleNamespace(send=told.append)  # type: ignore[assignment]
    one = _Child(7, work_of("hang", tmp_path), Limits(wall_s=1.0), 0.0, start=time.monotonic() - 2.0)
    server._children = {os.getpid(): one}
    monkeypatch.setattr(fork_server, "_kill", lambda pid: None)  # as of a process that waits for a server that is gone
    server._watch()
    assert told == []
    one.stopped_at -= 20.0
    for _ in range(2):
        server._watch()
    ((number, ended),) = told
    assert (number, ended.code, ended.stopped) == (7, -signal.SIGKILL, "wall")


def _first_child_of_server(server: ForkServer) -> int:
    end = time.monotonic() + 20
    while time.monotonic() < end:
        process = server._process
        if process is not None:
            with suppress(OSError):
                children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="ascii").split()
                if children:
                    return int(children[0])
        time.sleep(0.01)
    raise AssertionError("the server started no child")


def _wait_until_gone(pid: int) -> None:
    end = time.monotonic() + 5
    while time.monotonic() < end:
        try:
            state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
        except OSError:
            return
        if state == "Z":
            return
        time.sleep(0.01)
    raise AssertionError(f"process {pid} is still there")


def test_a_side_file_that_is_off_costs_itself_alone(mission_log: Path, forks: Isolation, tmp_path: Path) -> None:
    said = "side.csv was left out: side.csv"
    (tmp_path / "side.csv").write_text("", encoding="utf-8")
    work = work_of(str(mission_log), tmp_path, "diagnosis.audit.isolation.child:judge")
    outcome = run_isolated(replace(work, files=(str(mission_log), str(tmp_path / "side.csv"))), Limits(), forks)
    assert (outcome.state, outcome.reason[: len(said)]) == ("degraded", said)
    assert str(tmp_path) not in outcome.reason
    assert outcome.summary is not None
    assert outcome.summary["result"]["verdict"] == "not_assessed"  # a log with damage is never ready
    report = json.loads((tmp_path / "report" / "report.json").read_bytes())
    assert [file["damage"] for file in report["log"]["files"]] == [[outcome.reason]]
    assert [file["left_out"] for file in report["log"]["files"]] == [[outcome.reason]]
    assert outcome.summary["result"]["left_out"] == 1


def test_a_side_file_of_other_columns_is_a_note(mission_log: Path, forks: Isolation, tmp_path: Path) -> None:
    (tmp_path / "side.csv").write_text("t,a,b\n0,1,2\n1,1,2\n2,1,2\n", encoding="utf-8")
    work = work_of(str(mission_log), tmp_path, "diagnosis.audit.isolation.child:judge")
    outcome = run_isolated(replace(work, files=(str(mission_log), str(tmp_path / "side.csv"))), Limits(), forks)
    assert (outcome.state, outcome.reason) == ("ok", "")
    report = json.loads((tmp_path / "report" / "report.json").read_bytes())
    assert any("none of its channels" in note for file in report["log"]["files"] for note in file["notes"])


def test_the_same_signals_twice_are_judged_from_the_recording(
    mission_log: Path, forks: Isolation, tmp_path: Path
) -> None:
    options = SimulationOptions(scenario="healthy", duration_s=12.0, rate_hz=100.0)
    write_mission(simulate_mission(options), tmp_path / "side.csv", "twincat")
    work = work_of(str(mission_log), tmp_path, "diagnosis.audit.isolation.child:judge")
    outcome = run_isolated(replace(work, files=(str(mission_log), str(tmp_path / "side.csv"))), Limits(), forks)
    assert (outcome.state, "side.csv was left out: " in outcome.reason) == ("degraded", True), outcome


def test_a_bad_recording_beside_a_good_table_is_unreadable(forks: Isolation, tmp_path: Path) -> None:
    for name in ("a.mcap", "a.csv"):
        (tmp_path / name).write_text("no log", encoding="utf-8")
    work = work_of(str(tmp_path / "a.mcap"), tmp_path, "diagnosis.audit.isolation.child:judge")
    outcome = run_isolated(replace(work, files=(*work.files, str(tmp_path / "a.csv"))), Limits(), forks)
    assert outcome.state == "unreadable"
    assert outcome.reason.startswith(f"{tmp_path}/a.mcap ")
