"""Where tasks run: threads of this process, each of which watches a child, or the workers of a Dask cluster."""

from __future__ import annotations

import logging
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
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
        executor = _Workers(client)

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

        yield Engine("dask", executor, capacity, executor.shutdown, shared=True)
    finally:
        client.close(timeout=10)


class _Workers(Executor):
    """Workers of a cluster, where every task ends in a result or an error, whatever becomes of its worker.

    Dask's own executor leaves a task without an end for ever where its result is lost after it was told as finished.
    """

    def __init__(self, client: Any) -> None:
        self._client = client
        self._tasks: weakref.WeakSet[Any] = weakref.WeakSet()

    def submit(self, call: Callable[..., Any], /, *args: Any, **named: Any) -> Future[Any]:
        task = self._client.submit(call, *args, **named, pure=False, retries=0)
        self._tasks.add(task)
        told: Future[Any] = Future()
        self._client.loop.add_callback(self._tell, task, told)
        return told

    @staticmethod
    async def _tell(task: Any, told: Future[Any]) -> None:
        try:
            result = await task
        except BaseException as error:
            told.set_exception(error)
        else:
            told.set_result(result)

    def shutdown(self, wait: bool = False, *, cancel_futures: bool = True) -> None:
        """Cancel what has not ended."""
        self._client.cancel(list(self._tasks))


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
