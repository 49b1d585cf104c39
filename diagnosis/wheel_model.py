"""Identification of the wheel model τ·v̇ = −v + K·u + load from a mission that may hold faults.

Each window of a few seconds gives its own gain; the median over windows and wheels stands for healthy wheels as long
as fewer than half of the windows are faulty. Wheels of one machine are alike, so a wheel's own gain is believed only
near the machine's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from diagnosis.noise import COARSE_STEP_S, moving_sum, white_part
from replay.machine import WheelPlant

Array = NDArray[np.float64]

_TAUS = (0.02, 0.05, 0.08, 0.12, 0.17, 0.25, 0.35, 0.5, 0.7, 1.0)
_WINDOW_S = 2.5
_MAX_SPREAD = 0.25
_OWN_RANGE = 0.1


@dataclass(frozen=True)
class WheelModelFit:
    """Wheel models of one mission.

    Attributes
    ----------
    plants : tuple[WheelPlant or None, ...]
        Per wheel; None where nothing can be identified.
    spread : float
        Relative spread of the windows' gains (robust standard deviation over median).
    windows : int
        Windows used.
    reliable : bool
        Whether gains may be judged by it.
    note : str
        The figures in words.
    identified : bool
        Whether a wheel's model comes from this mission rather than from the machine file.
    """

    plants: tuple[WheelPlant | None, ...]
    spread: float
    windows: int
    reliable: bool
    note: str
    identified: bool = True


def low_passed(u: Array, tau: float, dt: float) -> Array:
    """Response of a first-order lag to u held over each step; NaN counts as 0."""
    a = np.exp(-dt / tau)
    filled = np.nan_to_num(u)
    return np.asarray(lfilter([0.0, 1 - a], [1.0, -a], filled, zi=[filled[0]])[0]) if u.size else u


def identify(
    y: Array,
    u: Array,
    moving: NDArray[np.bool_],
    dt: float,
    given: dict[int, WheelPlant],
    flow: float | None = None,
) -> WheelModelFit:
    """Fit K and τ of every wheel where the pump feeds all that is asked of it.

    Parameters
    ----------
    y, u : Array, shape (n, wheels)
        Measured speed [m/s] and valve opening [fraction]; NaN where not valid.
    moving : NDArray[np.bool_], shape (n, wheels)
        Where the wheel is commanded to move.
    dt : float
        Step [s].
    given : dict[int, WheelPlant]
        Models from the machine file by wheel index; they are taken as they are.
    flow : float or None
        Sum of speeds that the pump can feed [m/s].
    """
    if flow is None:
        return _identify(y, u, moving, dt, given)
    asked = np.abs(np.nan_to_num(u)).sum(axis=1)
    driving = moving.any(axis=1)
    fed = asked <= (np.quantile(asked[driving], 0.6) if driving.any() else 0.0)
    fit = _identify(y, u, moving & fed[:, None], dt, given)
    for _ in range(2):
        if not any(fit.plants):
            return fit
        fed = demand(u, fit) <= flow
        fit = _identify(y, u, moving & fed[:, None], dt, given)
    return fit


def demand(u: Array, fit: WheelModelFit) -> Array:
    """Sum of the speeds that the valves ask for [m/s], shape (n,)."""
    known = [p.K for p in fit.plants if p is not None]
    gains = np.array([p.K if p is not None else float(np.median(known)) for p in fit.plants])
    return np.asarray(np.abs(np.nan_to_num(u)) @ gains)


def fed_openings(y: Array, u: Array, fit: WheelModelFit, flow: float | None, dt: float) -> tuple[Array, Array]:
    """Openings as the shared pump feeds them, and the wheel model's error where it is at its limit.

    Where the valves ask for more than the pump gives, each gets a share between flow/demand and 1, since a faulty
    valve may not take what it asks for. The share is read off the other wheels: the median of their speed over what
    they ask for.

    Parameters
    ----------
    y, u : Array, shape (n, wheels)
        Measured speed [m/s] and valve opening [fraction].
    fit : WheelModelFit
        The wheels' models.
    flow : float or None
        Sum of speeds that the pump can feed [m/s].
    dt : float
        Step [s].

    Returns
    -------
    opening : Array, shape (n, wheels)
        Fed openings [fraction].
    slack : Array, shape (n, wheels)
        Standard deviation of the model's error [m/s]; 0 where the pump feeds everything.
    """
    slack = np.zeros_like(u)
    if flow is None or not any(fit.plants):
        return u, slack
    asked = demand(u, fit)
    last = np.maximum.accumulate(np.where(asked > flow, np.arange(asked.size), -(10**9)))
    lag = max(p.tau for p in fit.plants if p is not None)
    limited = np.arange(asked.size) - last <= 3 * lag / dt
    if not limited.any():
        return u, slack
    ratio = np.full_like(u, np.nan)
    a = 1 - np.exp(-dt / 0.1)
    for i, plant in enumerate(fit.plants):
        if plant is None:
            continue
        pushed = lfilter([a], [1.0, -(1 - a)], plant.K * low_passed(u[:, i], plant.tau, dt))
        speed = lfilter([a], [1.0, -(1 - a)], np.nan_to_num(y[:, i]))
        clear = np.abs(pushed) > 0.02 * flow
        ratio[clear, i] = speed[clear] / pushed[clear]
    floor = np.minimum(1.0, flow / np.maximum(asked, 1e-12))
    opening = u.copy()
    for i, plant in enumerate(fit.plants):
        if plant is None:
            continue
        others = np.delete(ratio, i, axis=1)[limited]
        known = np.isfinite(others).sum(axis=1) >= 2
        share = floor[limited].copy()
        seen = np.full(share.size, np.nan)
        seen[known] = np.nanmedian(others[known], axis=1)
        unlike = seen > 1.3 * share  # a faulty valve takes less than it asks for, and leaves more to the others
        share = np.where(unlike, np.minimum(seen, 1.0), share)
        opening[limited, i] = u[limited, i] * share
        doubt = np.where(known, 0.1, 0.5 * (1 - floor[limited]))
        slack[limited, i] = doubt * plant.K * np.abs(np.nan_to_num(u[limited, i])) * share + 1e-6
    return opening, slack


def _identify(y: Array, u: Array, moving: NDArray[np.bool_], dt: float, given: dict[int, WheelPlant]) -> WheelModelFit:
    """Fit K and τ of every wheel.

    Parameters
    ----------
    y, u : Array, shape (n, wheels)
        Measured speed [m/s] and valve opening [fraction]; NaN where not valid.
    moving : NDArray[np.bool_], shape (n, wheels)
        Where the wheel is commanded to move.
    dt : float
        Step [s].
    given : dict[int, WheelPlant]
        Models from the machine file by wheel index; they are taken as they are.
    """
    wheels = [i for i in range(y.shape[1]) if np.isfinite(u[:, i]).any() and np.isfinite(y[:, i]).any()]
    length = max(8, round(_WINDOW_S / dt))
    best: tuple[float, float, list[Array]] | None = None
    for tau in _TAUS:
        if tau < dt:
            continue
        gains, misfits = [], []
        for i in wheels:
            g, r = _windowed(y[:, i], low_passed(u[:, i], tau, dt), moving[:, i], length)
            gains.append(g)
            misfits.append(r)
        pooled = np.concatenate(misfits) if misfits else np.empty(0)
        if pooled.size >= 3 and (best is None or np.median(pooled) < best[0]):
            best = (float(np.median(pooled)), tau, gains)
    plants: list[WheelPlant | None] = [None] * y.shape[1]
    for i, plant in given.items():
        plants[i] = plant
    if best is None:
        known = all(p is not None for p in plants)
        why = "from the machine file" if known else "no window in which a wheel moves under a recorded valve command"
        return WheelModelFit(tuple(plants), 0.0, 0, known, f"Wheel model: {why}.", not known)
    _, tau, gains = best
    pooled = np.concatenate(gains)
    centre = float(np.median(pooled))
    spread = 1.4826 * float(np.median(np.abs(pooled - centre))) / abs(centre) if centre else float("inf")
    for i, g in zip(wheels, gains, strict=True):
        if i in given:
            continue
        own = float(np.median(g)) if g.size >= 5 else centre
        K = own if abs(own - centre) <= _OWN_RANGE * abs(centre) else centre
        if K > 0:
            plants[i] = WheelPlant(K=K, tau=tau, K_std=spread * abs(K) / np.sqrt(max(1, g.size)))
    reliable = len(given) == len(wheels) or (pooled.size >= 5 and spread <= _MAX_SPREAD and centre > 0)
    shown = ", ".join("–" if p is None else f"{p.K:.3g}" for p in plants)
    note = (
        f"Wheel model identified in {pooled.size} windows of {_WINDOW_S:g} s: K = {shown} m/s per full opening, "
        f"τ = {tau:g} s, spread of the windows {100 * spread:.0f} %"
        + ("." if reliable else f": too uncertain to judge gains by (limit {100 * _MAX_SPREAD:.0f} %).")
    )
    return WheelModelFit(tuple(plants), spread, int(pooled.size), reliable, note, any(i not in given for i in wheels))


def _windowed(y: Array, p: Array, moving: NDArray[np.bool_], length: int) -> tuple[Array, Array]:
    """Gain Σyp/Σp² and relative misfit of every window that moves throughout."""
    count = y.size // length
    use = moving & np.isfinite(y)
    shape = (count, length)
    yy, pp = (np.where(use, q, 0.0)[: count * length].reshape(shape) for q in (y, p))
    share = use[: count * length].reshape(shape).mean(axis=1)
    spp, syp, syy = (pp**2).sum(axis=1), (yy * pp).sum(axis=1), (yy**2).sum(axis=1)
    good = (share > 0.8) & (spp > 0) & (np.ptp(np.where(use, y, 0.0)[: count * length].reshape(shape), axis=1) > 0)
    g = syp[good] / spp[good]
    misfit = (syy[good] - g * syp[good]) / np.maximum(syy[good], 1e-300)
    return g, misfit


def aliasing_slack(u: Array, plant: WheelPlant, dt: float) -> Array:
    """Error of the model [m/s], shape (n,), where u jumps about between samples of a slow log; else 0."""
    if dt < COARSE_STEP_S:
        return np.zeros(u.size)
    width = max(3, round(0.5 / dt))
    rms = np.sqrt(moving_sum(white_part(u) ** 2, width) / width)
    error = plant.K * rms * np.sqrt(dt / plant.tau)
    usual = plant.K * float(np.sqrt(np.nanmean(u**2)))
    return np.where(error > 0.1 * usual, error, 0.0)


def common_load(residuals: Array, dt: float, smooth_s: float = 0.5) -> Array:
    """Load that the other wheels share, as a speed: median of their residuals, smoothed (slope, not a wheel's fault).

    Parameters
    ----------
    residuals : Array, shape (n, wheels)
        y − K·lowpass(u) [m/s]; NaN where not known.
    dt : float
        Step [s].
    smooth_s : float
        Time constant of the smoothing [s].

    Returns
    -------
    Array, shape (n, wheels)
        Zero with fewer than three wheels.
    """
    n, wheels = residuals.shape
    out = np.zeros((n, wheels))
    if wheels < 3:
        return out
    a = 1 - np.exp(-dt / smooth_s)
    filled = np.where(np.isfinite(residuals), residuals, 0.0)
    for i in range(wheels):
        others = np.delete(filled, i, axis=1)
        out[:, i] = lfilter([a], [1.0, -(1 - a)], np.median(others, axis=1))
    return out
