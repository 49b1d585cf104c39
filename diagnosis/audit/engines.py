"""Where tasks run: threads of this process, each of which watches a child, or the workers of a Dask cluster."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from diagnosis.audit.isolation.run import isolation
from replay.errors import ConfigError


@dataclass(frozen=True)
class Engine:
    """A way to run tasks.

    Attributes
    ----------
    name : str
        ``local`` or ``dask``.
    executor : Executor
        Runs tasks.
    capacity : Callable[[], int]
        How many run at the same time; may change.
    stop : Callable[[], None]
        Ends what runs, at once.
    shared : bool
        Whether tasks run on other machines, so that results come by way of the output folder.
    """

    name: str
    executor: Executor
    capacity: Callable[[], int]
    stop: Callable[[], None]
    shared: bool = False


@contextmanager
def local(jobs: int, kind: str = "") -> Iterator[Engine]:
    """Threads of this process.

    Parameters
    ----------
    jobs : int
        Missions at the same time.
    kind : str
        How children start: see `diagnosis.audit.isolation.run.isolation`.
    """
    children = isolation(kind)
    children.start()
    executor = ThreadPoolExecutor(jobs, thread_name_prefix="audit")

    def stop() -> None:
        executor.shutdown(wait=False, cancel_futures=True)  # first: a thread that is free takes the next mission
        children.close()

    try:
        yield Engine("local", executor, lambda: jobs, stop)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


@contextmanager
def dask(address: str, wait_s: float = 20.0) -> Iterator[Engine]:
    """Workers of a Dask cluster that can read the logs and write the output under the same paths.

    Parameters
    ----------
    address : str
        Of the scheduler, e.g. ``tcp://host:8786``.
    wait_s : float
        How long to wait for its answer [s].

    Raises
    ------
    ConfigError
        Where Dask is not installed or the scheduler does not answer.
    """
    try:
        distributed: Any = import_module("distributed")
    except ImportError as error:
        raise ConfigError(
            "--dask needs Dask: pip install 'mfhca-replay[dask]', on every host of the cluster"
        ) from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters is said here
    try:
        client = distributed.Client(address, set_as_default=False, timeout=wait_s, name="mfhca-audit")
    except (OSError, ValueError, TimeoutError) as error:
        raise ConfigError(f"--dask {address}: the scheduler does not answer ({error}); see `dask scheduler`") from error
    try:
        client.run_on_scheduler(_one_task_per_worker)
        executor = client.get_executor(pure=False, retries=0)

        def capacity() -> int:
            try:
                if client.status != "running":
                    raise OSError(client.status)
                threads: dict[str, int] = client.nthreads()
            except (OSError, ValueError, TimeoutError) as error:
                raise ConfigError(
                    f"--dask {address}: the scheduler was lost ({error}); finished missions are kept; start it and run the same "
                    "command again to continue"
                ) from error
            return max(sum(threads.values()), 1)

        yield Engine("dask", executor, capacity, lambda: executor.shutdown(wait=False), shared=True)
    finally:
        client.close(timeout=10)


def _one_task_per_worker(dask_scheduler: Any) -> None:
    """Hand each worker what it can do at once, and take a task from a lost worker to no second one by itself."""
    dask_scheduler.allowed_failures = 0
    if dask_scheduler.WORKER_SATURATION < 100:  # not infinite: queues are on
        dask_scheduler.WORKER_SATURATION = 1.0


def is_lost(error: BaseException) -> bool:
    """Whether an error says that who ran the task was lost, rather than what came of the task."""
    names = {c.__name__ for c in type(error).__mro__}
    lost = {"KilledWorker", "CommClosedError", "CancelledError", "FutureCancelledError"}
    return isinstance(error, BrokenExecutor) or bool(names & lost)
