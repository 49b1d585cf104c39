from __future__ import annotations

import multiprocessing
import os
import random
import signal
import threading
import time
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from diagnosis.audit import engines
from diagnosis.audit.engines import Engine
from diagnosis.audit.isolation.limits import Limits
from replay.errors import ConfigError
from tests.diagnosis.audit.samples import asked_for, missions, run

POISON = ("kill", "hang", "raise", "segfault", "exhaust")
WORKS = ("fine-1", *POISON, "fine-2", "damaged", "broken")
TABLE = {
    "fine-1": "ok", "fine-2": "ok", "damaged": "degraded", "broken": "unreadable", "kill": "unreadable", "hang": "timeout",
    "raise": "crashed", "segfault": "crashed", "exhaust": "out_of_memory",
}  # fmt: skip


@contextmanager
def processes() -> Iterator[Engine]:
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        yield Engine("processes", executor, lambda: 2, lambda: None)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Three workers with one thread each, on this machine alone."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        distributed = pytest.importorskip("distributed")
        made = distributed.LocalCluster(
            n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1", silence_logs=50
        )
        yield made
        made.close(timeout=10)


def test_threads_give_the_table(tmp_path: Path) -> None:
    ends, _ = run(missions(tmp_path / "logs", *WORKS), asked_for(tmp_path / "out"))
    assert {n: e.state for n, e in ends.items()} == TABLE


def test_processes_give_the_same_table(tmp_path: Path) -> None:
    ends, _ = run(missions(tmp_path / "logs", *WORKS), asked_for(tmp_path / "out"), processes)
    assert {n: e.state for n, e in ends.items()} == TABLE


def test_fresh_interpreters_give_the_same_table(tmp_path: Path) -> None:
    works = [work for work in WORKS if work != "hang"]
    asked = asked_for(tmp_path / "out", isolation="spawn", limits=Limits(memory_mb=150, wall_s=30.0))
    ends, _ = run(missions(tmp_path / "logs", *works), asked, lambda: engines.local(2, "spawn"))
    assert {n: e.state for n, e in ends.items()} == {n: s for n, s in TABLE.items() if n != "hang"}


@pytest.mark.filterwarnings("ignore")
def test_a_dask_cluster_gives_the_same_table(cluster: Any, tmp_path: Path) -> None:
    def made() -> Any:
        return engines.dask(cluster.scheduler_address)

    ends, _ = run(missions(tmp_path / "logs", *WORKS), asked_for(tmp_path / "out"), made)
    assert {n: e.state for n, e in ends.items()} == TABLE


@pytest.mark.filterwarnings("ignore")
def test_workers_that_are_killed_cost_no_mission(cluster: Any, tmp_path: Path) -> None:
    found = missions(tmp_path / "logs", *(f"slow-{i}" for i in range(16)))
    over = threading.Event()
    killed = []

    def kill_now_and_then() -> None:
        draw = random.Random(3)
        while not over.wait(0.7) and len(killed) < 3:
            pids = [n.pid for n in cluster.workers.values() if n.pid]
            if pids:
                with suppress(OSError):
                    os.kill(draw.choice(pids), signal.SIGKILL)
                    killed.append(time.monotonic())

    killer = threading.Thread(target=kill_now_and_then)
    killer.start()
    asked = asked_for(tmp_path / "out", limits=Limits(150, 20.0))
    ends, _ = run(found, asked, lambda: engines.dask(cluster.scheduler_address))
    over.set()
    killer.join()
    assert killed
    assert {e.state for e in ends.values()} == {"ok"}
    assert len(ends) == 16


@pytest.mark.filterwarnings("ignore")
def test_a_result_that_is_lost_after_its_task_was_done_is_a_lost_worker(
    cluster: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever holds the result is killed before it was fetched, and so is who computes it again."""
    distributed = pytest.importorskip("distributed")

    async def gather(*_: object, **__: object) -> None:
        raise distributed.KilledWorker("audit_one", None, 0)

    with engines.dask(cluster.scheduler_address) as engine:
        monkeypatch.setattr(distributed.Client, "_gather", gather)
        error = engine.executor.submit(abs, -1).exception(timeout=20)
    assert error is not None
    assert engines.is_lost(error)


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_is_stopped_ends_what_runs(cluster: Any) -> None:
    with engines.dask(cluster.scheduler_address) as engine:
        waiting = [engine.executor.submit(time.sleep, 5.0) for _ in range(9)]
        engine.stop()
        errors = [one.exception(timeout=20) for one in waiting]
    assert all(error is not None and engines.is_lost(error) for error in errors)


@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_that_is_not_there_is_one_sentence() -> None:
    pytest.importorskip("distributed")
    with (
        pytest.raises(ConfigError, match="the scheduler does not answer"),
        engines.dask("tcp://127.0.0.1:1", wait_s=0.3),
    ):
        pass
