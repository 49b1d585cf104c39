"""The MFHCA loop replayed open-loop: adaptive law L16 (13), drive command L15 (14), steering command L17 (15).

L16 as printed is homogeneous and Ψ̂(0) is not given, so Ψ̂ can only decay. Every mode is therefore offered:

printed      Ψ̂' = −ρΨ̂, exact exponential per step, Ψ̂(0) given or fitted to the implied values
implied      Ψ̂² that the recorded command contains, by the law in use
event_reset  printed, but re-initialised where the implied value jumps
forced       Ψ̂' = −ρΨ̂ + ½ζe²

with ρ = β + |v_c| + |v| + ξ. The readings of L15 differ in the signs; see `LAW_TEXT`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.arrays.numeric import without_nan

Array = NDArray[np.float64]

LAW_TEXT = {
    "signed": "u = −λ(v − v_c) + sgn(v_c)·Ψ̂²",
    "opposed": "u = −λ(v − v_c) − sgn(e)·Ψ̂²",
    "printed": "u = −λ|v| + λ|v_c| + Ψ̂²",
    "sign_abs": "u = sgn(v_c)·(λ(|v_c| − |v|) + Ψ̂²)",
}


def decay_rate(v: Array, v_c: Array, xi: float, beta: float) -> Array:
    """ρ = β + |v_c| + |v| + ξ of L16 (13) [1/s]; speeds in m/s. All of one shape (n,)."""
    return np.asarray(beta + np.abs(v_c) + np.abs(v) + xi)


def proportional_part(law: str, v: Array, v_c: Array) -> Array:
    """Factor of λ in L15 (14) under a reading of the law [m/s]. All of one shape (n,)."""
    if law in ("signed", "opposed"):
        return np.asarray(v_c - v)
    part = np.abs(v_c) - np.abs(v)
    # sgn(0) = 1, as for Ψ̂²
    return np.asarray(part if law == "printed" else np.where(v_c < 0, -part, part))


def adaptive_sign(law: str, v: Array, v_c: Array) -> Array:
    """Sign with which Ψ̂² enters L15 (14) under a reading of the law. All of one shape (n,), speeds in m/s."""
    if law == "printed":
        return np.ones_like(v)
    if law == "opposed":
        return np.asarray(-np.sign(v - v_c))
    return np.where(v_c < 0, -1.0, 1.0)


def drive_command(law: str, v: Array, v_c: Array, psi_squared: Array, lambda_: float, u_max: float) -> Array:
    """Evaluate L15 (14) under a reading of the law, saturated at ±u_max.

    Parameters
    ----------
    law : str
        ``signed``, ``opposed``, ``printed`` or ``sign_abs``.
    v, v_c : Array, shape (n,)
        Measured and commanded wheel speed [m/s].
    psi_squared : Array, shape (n,)
        Ψ̂² [fraction of full opening].
    lambda_ : float
        λ [s/m].
    u_max : float
        Saturation [fraction].

    Returns
    -------
    Array, shape (n,)
        u_a [fraction of full opening].
    """
    u = lambda_ * proportional_part(law, v, v_c) + adaptive_sign(law, v, v_c) * psi_squared
    return np.asarray(np.clip(u, -u_max, u_max))


def implied_psi_squared(
    law: str, u: Array, v: Array, v_c: Array, lambda_: float, u_max: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Ψ̂² that the recorded command contains; negative values are kept.

    Returns
    -------
    psi_squared : Array, shape (n,)
        Implied Ψ̂² [fraction]; NaN where the sign of Ψ̂² is undefined.
    bound : NDArray[np.bool_], shape (n,)
        Where the command is saturated, so that the value is a bound only.
    """
    sign = adaptive_sign(law, v, v_c)
    with np.errstate(invalid="ignore"):
        value = sign * (u - lambda_ * proportional_part(law, v, v_c))
    return np.where(sign == 0, np.nan, value), np.abs(u) >= u_max * (1 - 1e-9)


def printed_decay(rho: Array, dt: float, start: float = 0.0, before: float = 0.0) -> tuple[Array, float]:
    """E(t) = exp(−∫ρ) of the printed law, exact for ρ held over each step.

    Parameters
    ----------
    rho : Array, shape (n,)
        Decay rate [1/s]; NaN counts as the last known one.
    dt : float
        Step [s].
    start : float
        ∫ρ up to the first sample [1], to carry on from an earlier block.
    before : float
        Last known ρ of that block [1/s].

    Returns
    -------
    decay : Array, shape (n,)
        Ψ̂(t)/Ψ̂(0).
    stop : float
        ∫ρ up to the sample after the last, for the next block.
    """
    filled = fill_forward(rho, before)
    total = start + np.concatenate(([0.0], np.cumsum(filled * dt)))
    return np.exp(-total[:-1]), float(total[-1])


def fill_forward(x: Array, first: float = 0.0) -> Array:
    """Replace NaN by the last value before it (`first` before any). Both of shape (n,), in one unit."""
    out = np.empty(x.size)
    _scan_fill(x, first, out)
    return out


@njit(cache=True, nogil=True)
def _scan_fill(x, last, out):  # type: ignore[no-untyped-def]
    for k in range(x.size):
        if np.isfinite(x[k]):
            last = x[k]
        out[k] = last


@njit(cache=True, nogil=True)
def _scan_forced(rho, e, dt, gain, psi, lead):  # type: ignore[no-untyped-def]
    """Ψ̂ ← Ψ̂·exp(−ρ dt) + gain·e²·dt; NaN inputs leave the forcing out. Returns values and the state."""
    out = np.empty(rho.size)
    for k in range(rho.size):
        before = psi
        psi = psi * np.exp(-rho[k] * dt)
        if not np.isnan(e[k]):
            psi += gain * e[k] * e[k] * dt
        out[k] = before + lead * (psi - before)
    return out, psi


def forced_psi(
    rho: Array, e: Array, dt: float, zeta: float, start: float = 0.0, before: float = 0.0, lead: float = 0.0
) -> tuple[Array, float]:
    """Ψ̂ of the forced mode, Ψ̂' = −ρΨ̂ + ½ζe².

    Parameters
    ----------
    rho, e : Array, shape (n,)
        Decay rate [1/s] and error [m/s] of every sample.
    dt : float
        Step [s].
    zeta : float
        ζ [s/m²].
    start, before : float
        State and last known ρ of the block before.
    lead : float
        Share of a sample's own step that its Ψ̂ already holds: 0 where the controller gives the command before it advances
        Ψ̂, 1 where after; recorded more slowly than controlled, one of m control steps after is (m + 1)/2m.

    Returns
    -------
    psi : Array, shape (n,)
        Ψ̂ with which each command is given.
    state : float
        To carry on with.
    """
    out, state = _scan_forced(fill_forward(rho, before), e, dt, 0.5 * zeta, start, lead)
    return np.asarray(out), float(state)


@njit(cache=True, nogil=True)
def _scan_event_reset(rho, implied, dt, threshold, run, state, count):  # type: ignore[no-untyped-def]
    """Decay Ψ̂² by exp(−2ρ dt); take the implied value after `run` steps in a row beyond the threshold."""
    out = np.empty(rho.size)
    reset = np.zeros(rho.size, dtype=np.bool_)
    for k in range(rho.size):
        y = implied[k]
        if not np.isnan(y):
            if np.isnan(state):
                state = max(y, 0.0)
            elif abs(y - state) > threshold:
                count += 1
                if count >= run:
                    state = max(y, 0.0)
                    reset[k] = True
                    count = 0
            else:
                count = 0
        out[k] = state
        state = state * np.exp(-2 * rho[k] * dt)
    return out, reset, state, count


def jump_threshold(steps: Array) -> float:
    """Change of the implied Ψ̂² from step to step that counts as a jump: six robust standard deviations [fraction].

    `steps` of shape (n,).
    """
    steps = steps[np.isfinite(steps)]
    spread = 1.4826 * float(np.median(np.abs(steps - np.median(steps)))) if steps.size else 0.0
    return max(6 * spread, 1e-4)


def event_reset_psi(
    rho: Array,
    implied: Array,
    dt: float,
    threshold: float | None = None,
    run: int = 3,
    state: tuple[float, int] = (np.nan, 0),
    before: float = 0.0,
) -> tuple[Array, NDArray[np.bool_], tuple[float, int]]:
    """Ψ̂ that decays as printed and is re-initialised where the implied Ψ̂² jumps.

    Parameters
    ----------
    rho, implied : Array, shape (n,)
        Decay rate [1/s] and implied Ψ̂² [fraction].
    dt : float
        Step [s].
    threshold : float or None
        Jump that counts [fraction]; None takes `jump_threshold` of the implied steps.
    run : int
        Steps in a row that the jump must last.
    state : tuple[float, int]
        Ψ̂² and steps beyond the threshold at the end of the block before.
    before : float
        Last known ρ of that block [1/s].

    Returns
    -------
    psi : Array, shape (n,)
        Ψ̂; NaN before the first implied value.
    reset : NDArray[np.bool_], shape (n,)
        Where it was re-initialised.
    state : tuple[float, int]
        To carry on with.
    """
    if threshold is None:
        threshold = jump_threshold(np.diff(implied))
    out, reset, last, count = _scan_event_reset(fill_forward(rho, before), implied, dt, threshold, run, *state)
    return np.sqrt(out), reset, (float(last), int(count))


def fit_psi0(decay: Array, implied: Array, usable: NDArray[np.bool_]) -> float:
    """Ψ̂(0) of the printed law that fits the implied Ψ̂² best: Ψ̂₀² = max(0, ΣE²y/ΣE⁴).

    All of shape (n,), fractions of full opening.
    """
    use = usable & np.isfinite(implied)
    basis = decay[use] ** 2
    norm = float(basis @ basis)
    return float(np.sqrt(max(0.0, float(basis @ implied[use]) / norm))) if norm > 0 else 0.0


def implied_forcing(implied: Array, rho: Array, dt: float, window_s: float = 0.25) -> Array:
    """Compute the forcing w = d(Ψ̂²)/dt + 2ρΨ̂² over a centred window; zero exactly where the printed law ran.

    Returns
    -------
    Array, shape (n,)
        w [fraction/s]; NaN at the ends and beside missing values.
    """
    half = max(1, round(window_s / 2 / dt))
    out = np.full(implied.size, np.nan)
    if implied.size <= 2 * half:
        return out
    # what the printed law takes from Ψ̂² in a step, by its exponential
    total = np.concatenate(([0.0], np.cumsum(without_nan(-np.expm1(-2.0 * rho * dt) * implied))))
    missing = np.concatenate(([0], np.cumsum(~np.isfinite(rho * implied))))
    span = 2 * half * dt
    a, b = implied[: -2 * half], implied[2 * half :]
    integral = total[2 * half : -1] - total[: -2 * half - 1]
    gap = missing[2 * half : -1] - missing[: -2 * half - 1]
    out[half:-half] = np.where(gap == 0, (b - a + integral) / span, np.nan)
    return out


def steering_command(phi_c: Array, phi: Array, k_ps: float, u_max: float) -> Array:
    """L17 (15): u_s = k_ps(φ_c − φ), saturated at ±u_max; angles in rad, result in fractions of full opening.

    All of one shape (n,).
    """
    return np.asarray(np.clip(k_ps * (phi_c - phi), -u_max, u_max))
