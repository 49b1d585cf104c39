"""What all laws share: clipping of the command, and when a state that integrates has to wait (compiled)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit

F = NDArray[np.float64]


@njit(cache=True, no_cpython_wrapper=True)
def clipped(raw: float, u_max: float) -> float:
    """Command within ±u_max. In fractions of full opening."""
    return float(min(max(raw, -u_max), u_max))


@njit(cache=True, no_cpython_wrapper=True)
def winds_up(raw: float, e: float, u_max: float) -> bool:
    """Whether a command is beyond ±u_max and its error asks for more of it: u falls with e in every law.

    Commands in fractions of full opening, the error in m/s.
    """
    return bool(abs(raw) >= u_max and raw * e < 0.0)


@njit(cache=True, no_cpython_wrapper=True)
def bounded(value: float, bound: float) -> float:
    """Projection of a parameter estimate onto ±bound. In the unit of the estimate."""
    return float(min(max(value, -bound), bound))
