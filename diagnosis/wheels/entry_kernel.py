"""Compiled entry into one wheel's models: what a model starts from when it takes over from another.

The state is that of `diagnosis.wheels.step_kernel`.
"""

from __future__ import annotations

# ruff: noqa: SIM109 (compiled: a tuple of constants costs a search)
import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    ODD,
    ODD_LOAD,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_OU_SMALL,
    S_STUCK,
    WheelConstants,
)
from replay.arrays.compiling import njit
from replay.arrays.known_shape import trailing

Array = NDArray[np.float64]

#: States of shape (models, 4) and covariances of shape (models, 4, 4) as kernels know them.
known_states, known_covariances = trailing(4), trailing(4, 4)


@njit(cache=True, error_model="numpy")
def is_scaled(m: int) -> bool:
    """Whether ν of model m is in the scale of a faulty sensor."""
    return m >= S_GAIN and m <= S_OU_LARGE


@njit(cache=True, error_model="numpy", forceinline=True)
def enter(m: int, old: int, k: WheelConstants, z: Array, P: Array) -> None:
    """Start model m from the state of model `old`: speed and load are carried over, the unknowns get their priors.

    States `z` of shape (models, 4) and covariances `P` of shape (models, 4, 4).
    """
    z, P = known_states(z), known_covariances(P)
    v, var = z[old, 0], P[old, 0, 0]
    x, x_var = z[old, 2], min(P[old, 2, 2], 1.0)
    if is_scaled(old):
        g = max(z[old, 1], 0.1)
        var = var / (g * g) + (v / g) ** 2 * P[old, 1, 1] / (g * g)
        v = v / g
    elif old == S_STUCK or old == S_NONE:
        var += (0.05 * k.span) ** 2  # the model alone has carried the speed
    if old == ODD:
        x *= ODD_LOAD
    if m == ODD:
        x /= ODD_LOAD
    elif old > ODD:
        x_var = max(x_var, 0.5)
    for i in range(4):
        z[m, i] = 0.0
        for j in range(4):
            P[m, i, j] = 0.0
    z[m, 0], z[m, 1], z[m, 2] = v, 1.0, x
    P[m, 0, 0], P[m, 2, 2] = var, x_var
    if m == S_STUCK:
        P[m, 3, 3] = k.span**2
    elif is_scaled(m):
        g, g_var = (0.5, 0.09) if m == S_GAIN else (0.65, 0.04)
        z[m, 0], z[m, 1] = g * v, g
        P[m, 0, 0] = g_var * v * v + (g * g + g_var) * var
        P[m, 1, 1] = g_var
        P[m, 0, 1] = P[m, 1, 0] = g_var * v
        if m == S_OU_SMALL:
            P[m, 3, 3] = (0.08 * k.span) ** 2
        elif m == S_OU_LARGE:
            P[m, 3, 3] = (0.15 * k.span) ** 2
        elif m != S_GAIN:
            P[m, 3, 3] = (0.1 * k.span) ** 2
    elif m == A_GAIN:
        z[m, 1], P[m, 1, 1] = 0.5, 0.09
    elif m == A_NONE:
        z[m, 1] = 0.0
    elif m == A_STUCK:
        z[m, 1], P[m, 3, 3] = 0.0, k.valve_span**2
    elif m == A_BIAS:
        z[m, 1], P[m, 1, 1] = 0.6, 0.04
        P[m, 3, 3] = (0.5 * k.valve_span) ** 2
