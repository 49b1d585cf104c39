"""Memory of columns that are no longer needed, for the next ones.

Arrays of a mission are made and freed by the hundred. glibc gives what is freed back to the system at once where it lies at the
top of the heap, and every page of it is asked for and zeroed again a moment later.
"""

from __future__ import annotations

import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of mallopt(3)
_KEPT = 128 << 20  # freed at the top of the heap, that a process keeps [bytes]
_LARGE = (
    8 << 20
)  # from here on memory comes from the system and goes back to it: columns of hours would leave gaps that nothing fits into [bytes]


def keep_freed_memory() -> bool:
    """Let this process keep up to 128 MiB that it has freed; for a program of its own, not for one that uses this as a library.

    Returns
    -------
    bool
        Whether the C library can do so: glibc on Linux.
    """
    if sys.platform != "linux":
        return False
    import ctypes

    try:
        set_option = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):  # musl has no such function
        return False
    return bool(set_option(_MMAP_THRESHOLD, _LARGE) and set_option(_TRIM_THRESHOLD, _KEPT))
