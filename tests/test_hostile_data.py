"""Inputs that others made to break the program: each ends in one named state, within stated time and memory."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from diagnosis.audit.isolation.forks import _ONE_THREAD
from diagnosis.audit.store.ingest import ingest
from diagnosis.audit.store.store import FILE_NAME, Store

ROOT = Path(__file__).resolve().parent.parent
CPU_S, ADDRESS_BYTES = 120, 8 << 30
FINE = {0, 1, 2, 3}
DATA = Path(os.environ.get("MFHCA_REFERENCE_DATA", "../shared"))
HOSTILE = (DATA if DATA.is_absolute() else ROOT / DATA) / "hostile"
LOGS = {".mcap", ".bag", ".parquet", ".csv"}


def found(kind: str) -> list[str]:
    """Paths below the folder: ``log``, ``machine`` files, ``audit`` folders."""
    places = [HOSTILE, HOSTILE / "files"]
    every = sorted(path for place in places if place.is_dir() for path in place.iterdir())
    chosen = {
        "log": [path for path in every if path.suffix in LOGS],
        "machine": [path for path in every if path.suffix == ".toml"],
        "audit": [path for path in every if path.is_dir() and path.name.startswith(("audit", "mission"))],
    }
    return [str(path.relative_to(HOSTILE)) for path in chosen[kind]] or [""]


#: Starts commands in processes of their own, forked from one that has imported and loaded what they all need, as an audit's are.
_STARTER = f"""
import json, os, resource, sys
sys.path.insert(0, {str(ROOT)!r})
import cli.main, diagnosis.output, diagnosis.pipeline, diagnosis.report.page
from diagnosis.audit.isolation.fork_server import warm
warm()
for line in sys.stdin:
    words, *streams = json.loads(line)
    if child := os.fork():
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
        continue
    for number, path in enumerate([os.devnull, *streams]):
        os.dup2(os.open(path, os.O_RDWR | os.O_CREAT), number)
    resource.setrlimit(resource.RLIMIT_CPU, ({CPU_S}, {CPU_S}))
    resource.setrlimit(resource.RLIMIT_AS, ({ADDRESS_BYTES}, {ADDRESS_BYTES}))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.argv = ["mfhca", *words]
    cli.main.main()
"""


class Commands:
    """Runs commands, each in a process of its own with limits of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.count = folder, 0
        self.starter: subprocess.Popen[str] | None = None

    def __call__(self, *words: str) -> int:
        """Exit code of a command, which is one that is stated, as is why."""
        if self.starter is None:
            self.starter = subprocess.Popen(
                [sys.executable, "-c", _STARTER],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                env={**os.environ, **_ONE_THREAD},
            )
        assert self.starter.stdin is not None
        assert self.starter.stdout is not None
        self.count += 1
        streams = [self.folder / f"{self.count}.{name}" for name in ("out", "err")]
        self.starter.stdin.write(json.dumps([words, *map(str, streams)]) + "\n")
        self.starter.stdin.flush()
        code = int(self.starter.stdout.readline())
        out, err = (stream.read_text(encoding="utf-8", errors="replace") for stream in streams)
        assert code in FINE, (words, code, err[-2000:])
        assert "Traceback" not in out + err
        assert code < 2 or (out + err).strip(), "no sentence says why"
        return code

    def close(self) -> None:
        """End the process that starts them."""
        if self.starter is not None:
            self.starter.communicate()


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Commands]:
    commands = Commands(tmp_path_factory.mktemp("commands"))
    yield commands
    commands.close()


def there(name: str) -> Path:
    if not name:
        pytest.skip(f"no such data at {HOSTILE}; set MFHCA_REFERENCE_DATA to run this test")
    return HOSTILE / name


@pytest.mark.parametrize("name", found("log"))
def test_a_log_is_judged_or_refused(ran: Commands, tmp_path: Path, name: str) -> None:
    log = there(name)
    ran("inspect", str(log))
    ran("diagnose", str(log), "-o", str(tmp_path / "out"))


@pytest.mark.parametrize("name", found("machine"))
def test_a_machine_file_is_refused(ran: Commands, name: str) -> None:
    assert ran("config", "check", str(there(name))) == 2


@pytest.mark.parametrize("name", found("audit"))
def test_an_audit_gives_every_mission_a_state(ran: Commands, tmp_path: Path, name: str) -> None:
    folder = there(name)
    ran("audit", str(folder), "-o", str(tmp_path / "out"), "-j", "1")
    if not (tmp_path / "out" / FILE_NAME).is_file():  # it says why, or there is no mission
        return
    with Store.open(tmp_path / "out" / FILE_NAME) as store:
        states = [mission.result.state for mission in store.missions() if mission.result is not None]
    assert "crashed" not in states


def test_saved_results_of_other_shapes_are_refused(ran: Commands, tmp_path: Path) -> None:
    shutil.copytree(
        there("report_shape" if found("log") != [""] else ""), tmp_path / "result", copy_function=shutil.copyfile
    )
    (tmp_path / "result").chmod(0o755)
    assert ran("report", str(tmp_path / "result")) in {2, 3}
    (tmp_path / "out" / "results").mkdir(parents=True)
    name = f"{'a' * 8}-{'c' * 8}-1.0-1.json"
    shutil.copyfile(there("results_files_float.json"), tmp_path / "out" / "results" / name)
    with Store.open(tmp_path / "out" / FILE_NAME) as store:
        assert not ingest(store).attempts


def test_an_audit_beside_a_damaged_store_says_so(ran: Commands, tmp_path: Path) -> None:
    store = there("store_18.sqlite" if found("log") != [""] else "")
    (out := tmp_path / "out").mkdir()
    shutil.copyfile(store, out / FILE_NAME)
    ran("audit", str(HOSTILE / "mission_toml_bigint" / "good"), "-o", str(out), "-j", "1")
