"""Memory of columns that are no longer needed, for the next ones.

Arrays of a mission are made and freed by the hundred. glibc gives what is freed back to the system at once where it lies at the
top of the heap, and every page of it is asked for and zeroed again a moment later.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of mallopt(3)
_KEPT = 128 << 20  # freed at the top of the heap, that a process keeps [bytes]
_LARGE = 8 << 20  # comes from the system and goes back to it: columns of hours would leave gaps in between [bytes]


def _c_function(name: str) -> Callable[..., int] | None:
    """A function of glibc; None elsewhere."""
    if sys.platform != "linux":
        return None
    import ctypes

    try:
        found: Callable[..., int] = getattr(ctypes.CDLL(None), name)
    except (OSError, AttributeError):  # musl has no such function
        return None
    return found


def keep_freed_memory() -> bool:
    """Let this process keep up to 128 MiB that it has freed; for a program of its own, not for one that uses this as a library.

    Returns
    -------
    bool
        Whether the C library can do so: glibc on Linux.
    """
    set_option = _c_function("mallopt")
    return set_option is not None and bool(set_option(_MMAP_THRESHOLD, _LARGE) and set_option(_TRIM_THRESHOLD, _KEPT))


def give_back() -> bool:
    """Give pages that are free between arrays in use back to the system: hundreds of megabytes after a stage of a long mission.

    Returns
    -------
    bool
        Whether there were any, and the C library can do so: glibc on Linux.
    """
    trim = _c_function("malloc_trim")
    return trim is not None and bool(trim(0))
