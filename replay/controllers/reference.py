"""The two references: a proportional law, and a proportional and integral one with feed-forward (compiled)."""

from __future__ import annotations

from typing import NamedTuple

from replay.arrays.compiling import njit
from replay.controllers.limits import F, clipped, winds_up


class PGains(NamedTuple):
    """The proportional law: 1 parameter."""

    k: float = 1.0  # [s/m]


class PiGains(NamedTuple):
    """Proportional, integral and feed-forward: 3 parameters."""

    kp: float = 1.9  # [s/m]
    ki: float = 29.1  # [1/m]
    ff: float = 0.436  # opening per commanded speed [s/m]


PI_STATES = 1  # ∫e


@njit(cache=True, no_cpython_wrapper=True)
def p_step(v_ref: F, y: F, u_max: float, g: PGains, u: F) -> None:
    """u = −k e, into `u`; all of shape (wheels,). Speeds in m/s, u in fractions of full opening."""
    for i in range(y.size):
        u[i] = clipped(-g.k * (y[i] - v_ref[i]), u_max)


@njit(cache=True, no_cpython_wrapper=True)
def pi_step(v_ref: F, y: F, dt: float, u_max: float, g: PiGains, s: F, u: F) -> None:
    """u = f v_c − k_p e − k_i ∫e, into `u`; `s`, shape (wheels, PI_STATES), is advanced.

    Speeds in m/s, `dt` in s, u in fractions of full opening.
    """
    for i in range(y.size):
        e = y[i] - v_ref[i]
        raw = g.ff * v_ref[i] - g.kp * e - g.ki * s[i, 0]
        u[i] = clipped(raw, u_max)
        if not winds_up(raw, e, u_max):
            s[i, 0] += dt * e
