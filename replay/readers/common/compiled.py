"""How the parts of compiled kernels are compiled.

A part is kept with the kernel that calls it and is never called from Python. The kernel holds all arrays for longer
than its parts do, so the counting of references, which can cost more than a walk over bytes, is left out of them; hence
a part makes no arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit

_F = TypeVar("_F", bound=Callable[..., Any])


def part(function: _F) -> _F:
    """Compile a part of a kernel into its caller, as if it stood there."""
    compiled: _F = njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)(function)
    return compiled


def routine(function: _F) -> _F:
    """Compile a part of a kernel that several places call, or that is seldom called."""
    compiled: _F = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)(function)
    return compiled


def plain(data: NDArray[Any]) -> NDArray[Any]:
    """View the same numbers as a plain array that cannot be written, so that one compiled version serves all.

    Both of one shape (n, …).
    """
    data = data.view(np.ndarray)
    data.flags.writeable = False
    return data
