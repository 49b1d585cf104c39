"""Independent parts of one mission on all processors: kernels and NumPy's work on whole columns need no interpreter.

No more threads are at work than there are processors: whoever calls works too, parts may divide their own work again,
and a thread that waits for another leaves its place to others. On one processor nothing is begun beside anything.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from typing import Protocol, TypeVar

_T = TypeVar("_T")
_R = TypeVar("_R")

_LONGEST = (
    1_000_000  # rows of a mission; of a longer one, columns of several parts at once would take the memory of them all
)
_MOST = 4

_alone = False


class _Places:
    """Threads at work beside the first one."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._taken = 0

    def take(self, most: int, rows: int) -> int:
        """Take up to so many places on other processors; how many there were."""
        if _alone or most < 1 or rows > _LONGEST:
            return 0
        with self._lock:
            count = max(0, min(most, min(_MOST, processors()) - 1 - self._taken))
            self._taken += count
        return count

    def leave(self) -> None:
        """Leave one place: to others that have work, where this thread waits or is done."""
        with self._lock:
            self._taken -= 1

    def back(self) -> None:
        """Be at work again."""
        with self._lock:
            self._taken += 1


_places = _Places()


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def use_one() -> None:
    """From now on, let this process work on one part after the other: others of its kind have the other processors."""
    global _alone
    _alone = True


def each(
    function: Callable[[_T], _R], items: Iterable[_T], rows: int, begun: Callable[[_T], None] = lambda _: None
) -> list[_R]:
    """What a function gives for each item, in order; the items share nothing that the function changes.

    Parameters
    ----------
    function : Callable
        The exception of the first item that has one is raised here.
    items : Iterable
        What to call it with.
    rows : int
        Length of the columns that it works on.
    begun : Callable
        Told of each item, in order and by the caller's thread, before it is worked on.
    """
    given = list(items)
    helpers = _places.take(len(given) - 1, rows)
    if not helpers:
        out = []
        for item in given:
            begun(item)
            out.append(function(item))
        return out
    left, results, errors = iter(range(len(given))), dict[int, _R](), dict[int, BaseException]()
    taking = threading.Lock()

    def work() -> None:
        while True:
            with taking:
                i = None if errors else next(left, None)
            if i is None:
                return
            try:
                results[i] = function(given[i])
            except BaseException as error:
                errors[i] = error
                return

    with _helping(helpers) as begin:
        try:
            for item in given:
                begun(item)
            for _ in range(helpers):
                begin(work)
            work()
        except BaseException as error:  # an interrupt: helpers take nothing more
            errors[-1] = error
            raise
    if errors:
        raise errors[min(errors)]
    return [results[i] for i in range(len(given))]


@contextmanager
def beside(function: Callable[[], _R], rows: int) -> Iterator[Callable[[], _R]]:
    """Begin some work on another processor, if one is idle; what is handed out waits for its result, or does it then.

    Nothing is left running at the end: what the body raises comes after the work has ended, and instead of its exception.

    Parameters
    ----------
    function : Callable
        It shares nothing that it changes with what is done meanwhile.
    rows : int
        Length of the columns that it works on.
    """
    if not _places.take(1, rows):
        yield function
        return
    with _helping(1) as begin:
        job = begin(function)

        def result() -> _R:
            with _waiting():
                return job.result()

        yield result


class _Begin(Protocol):
    def __call__(self, function: Callable[[], _R]) -> Future[_R]: ...


@contextmanager
def _helping(count: int) -> Iterator[_Begin]:
    """Begin work in so many threads, whose places are taken; at the end they have done it, and their places are free."""
    pool, unused = ThreadPoolExecutor(count), [count]

    def begin(function: Callable[[], _R]) -> Future[_R]:
        # in the caller's context: what NumPy is to ignore is part of it
        job = pool.submit(_leaving, copy_context().run, function)
        unused[0] -= 1
        return job

    try:
        yield begin
    finally:
        for _ in range(unused[0]):
            _places.leave()
        with _waiting():
            pool.shutdown()


@contextmanager
def _waiting() -> Iterator[None]:
    """Leave this thread's place to others while it waits."""
    _places.leave()
    try:
        yield
    finally:
        _places.back()


def _leaving(run: Callable[[Callable[[], _R]], _R], function: Callable[[], _R]) -> _R:
    """Do a helper's work, and leave its place."""
    try:
        return run(function)
    finally:
        _places.leave()
