"""Compiled: arrays copied into parts of others.

`into[:] = values` of two arrays compiles the words of an error too, the shapes of both: seconds in each kernel. These
functions are parts of kernels and are never called from Python.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from replay.arrays.compiling import njit


@njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)
def put(into: NDArray[Any], values: NDArray[Any]) -> None:
    """Copy values, shape (n,), into the first n of `into`."""
    for i in range(values.shape[0]):
        into[i] = values[i]


@njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)
def put_rows(into: NDArray[Any], values: NDArray[Any]) -> None:
    """Copy values, shape (m, n), into the first m rows and n columns of `into`."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            into[i, j] = values[i, j]
