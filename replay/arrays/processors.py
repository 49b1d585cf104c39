"""Independent parts of one mission on all processors: kernels and NumPy's work on whole columns need no interpreter."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

_T = TypeVar("_T")
_R = TypeVar("_R")

_LONGEST = (
    1_000_000  # rows of a mission; of a longer one, columns of several parts at once would take the memory of them all
)
_MOST = 4

_alone = False


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
        Its exceptions are raised here.
    items : Iterable
        What to call it with.
    rows : int
        Length of the columns that it works on.
    begun : Callable
        Told of each item, in order and by the caller's thread, before it is worked on.
    """
    given = list(items)
    count = min(_MOST, processors(), len(given))
    if _alone or count < 2 or rows > _LONGEST:
        out = []
        for item in given:
            begun(item)
            out.append(function(item))
        return out
    with ThreadPoolExecutor(count) as pool:
        try:
            jobs = []
            for item in given:
                begun(item)
                # in the caller's context: what NumPy is to ignore is part of it
                jobs.append(pool.submit(copy_context().run, function, item))
            return [job.result() for job in jobs]
        except BaseException:  # an interrupt waits for what has begun alone
            pool.shutdown(wait=False, cancel_futures=True)
            raise
