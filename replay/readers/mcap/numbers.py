"""Compiled reading of numbers from bytes."""

from __future__ import annotations

import numpy as np

from replay.arrays.compiling import njit

# The indexes below are unsigned, so that none is checked for counting from the end, and a number becomes one load.


@njit(cache=True)
def u16(data, at):  # type: ignore[no-untyped-def]
    """Number at a place, lowest byte first."""
    p = np.uint64(at)
    return np.uint64(data[p]) | np.uint64(data[p + np.uint64(1)]) << np.uint64(8)


@njit(cache=True, no_cpython_wrapper=True)
def u32(data, at):  # type: ignore[no-untyped-def]
    """Number at a place, lowest byte first."""
    return u16(data, at) | u16(data, np.uint64(at) + np.uint64(2)) << np.uint64(16)


@njit(cache=True, no_cpython_wrapper=True)
def u64(data, at):  # type: ignore[no-untyped-def]
    """Number at a place, lowest byte first."""
    return u32(data, at) | u32(data, np.uint64(at) + np.uint64(4)) << np.uint64(32)
