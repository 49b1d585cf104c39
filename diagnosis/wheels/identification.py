"""Identification of the wheel model τ·v̇ = −v + K·u + load from a mission that may hold faults.

Each window of two seconds gives its own gain. Healthy windows agree and faulty ones scatter, so that the mode of the
gains stands for a healthy wheel even where most windows are faulty. Wheels of one machine are alike, so a wheel's own
mode is believed only near the machine's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.lag import low_passed
from diagnosis.results.plain_numbers import plain
from diagnosis.results.wheel_model import WheelModelFit
from diagnosis.wheels.plant_identification import identify_plants
from diagnosis.wheels.plant_windows import Drive
from diagnosis.wheels.robust_fit import mode
from replay.arrays.numeric import without_nan
from replay.machine.config import Machine, WheelPlant

Array = NDArray[np.float64]

_TAUS = (0.02, 0.035, 0.05, 0.075, 0.1, 0.14, 0.19, 0.25, 0.32, 0.4, 0.5, 0.65, 0.85, 1.1)
_WINDOW_S = 2.0
_MAX_SPREAD = 0.25
_OWN_RANGE = 0.2
_MOST_MISFIT = 0.04  # of the speed, left by the windows that agree best
_LEAST_OWN = 6  # windows near the machine's gain that a wheel needs for its own


def identified(drive: Drive, machine: Machine, given: dict[int, WheelPlant]) -> WheelModelFit | None:
    """Plants with maps of valves, from all wheels together; None where they drive too little.

    Parameters
    ----------
    drive : Drive
        Block means of all wheels.
    machine : Machine
        Its top speed and coupling.
    given : dict[int, WheelPlant]
        Models from the machine file by wheel index; they are taken as they are.
    """
    found = identify_plants([drive], machine.max_speed, coupling=machine.plant.coupling)
    if found is None or all(p is None for p in found.plants):
        return None
    plants = tuple(given.get(i, p) for i, p in enumerate(found.plants))
    reliable = found.misfit <= _MOST_MISFIT
    shown = ", ".join("–" if p is None else f"{plain(p.K)}" for p in plants)
    first = next(p for p in found.plants if p is not None)
    note = (
        f"Model of the {{wheels}} identified in {found.windows} windows of 1 s: K = {shown} {{speed_unit}} at 100{{percent}} where the machine "
        f"works, τ = {plain(first.tau, 2)} s, hysteresis {plain(100 * first.hysteresis, 2)} %, "
        + ("{wheels} free of the ground" if not first.grip else f"grip {plain(first.grip, 2)}")
        + f"; the better windows leave {100 * found.misfit:.1f} % of the speed unexplained, the median one "
        f"{100 * found.typical:.1f} %"
        + ("." if reliable else f": too uncertain to judge gains by (limit {100 * _MOST_MISFIT:.0f} %).")
    )
    return WheelModelFit(plants, found.misfit, found.windows, reliable, note, may_hold=found.may_hold)


def identify(
    y: Array,
    u: Array,
    moving: NDArray[np.bool_],
    dt: float,
    given: dict[int, WheelPlant],
    flow: float | None = None,
    effort: Array | None = None,
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
    effort : Array, shape (n, wheels), or None
        Mean |u| where y and u are means over blocks [fraction]; None: |u|.
    """
    if flow is None:
        return _identify(y, u, moving, dt, given)
    effort = np.abs(without_nan(u)) if effort is None else effort
    asked = effort.sum(axis=1)
    driving = moving.any(axis=1)
    fed = asked <= (np.quantile(asked[driving], 0.6) if driving.any() else 0.0)
    fit = _identify(y, u, moving & fed[:, None], dt, given)
    for _ in range(2):
        if not any(fit.plants):
            return fit
        fed = demand(effort, fit) <= flow
        fit = _identify(y, u, moving & fed[:, None], dt, given)
    return fit


def demand(effort: Array, fit: WheelModelFit) -> Array:
    """Sum of the speeds that openings of size `effort`, shape (n, wheels), ask for [m/s], shape (n,)."""
    known = [p.K for p in fit.plants if p is not None]
    gains = np.array([p.K if p is not None else float(np.median(known)) for p in fit.plants])
    return np.asarray(effort @ gains)


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
        if pooled.size >= 3 and (best is None or np.quantile(pooled, 0.25) < best[0]):
            best = (float(np.quantile(pooled, 0.25)), tau, gains)
    plants: list[WheelPlant | None] = [None] * y.shape[1]
    for i, plant in given.items():
        plants[i] = plant
    if best is None:
        known = all(p is not None for p in plants)
        why = (
            "from the machine file" if known else "no window in which a {wheel} moves under a recorded {valve} command"
        )
        return WheelModelFit(tuple(plants), 0.0, 0, known, f"Model of the {{wheels}}: {why}.", not known)
    _, tau, gains = best
    pooled = np.concatenate(gains)
    centre = mode(pooled)
    near = np.sort(np.abs(pooled - centre))[: max(1, pooled.size // 2)]  # the half that agrees best
    spread = 1.4826 * float(np.median(near)) / abs(centre) if centre else float("inf")
    for i, g in zip(wheels, gains, strict=True):
        if i in given:
            continue
        like = g[np.abs(g - centre) <= _OWN_RANGE * abs(centre)]
        K = mode(like) if like.size >= _LEAST_OWN else centre
        if K > 0:
            plants[i] = WheelPlant(K=K, tau=tau, K_std=spread * abs(K) / np.sqrt(max(1, g.size)))
    reliable = len(given) == len(wheels) or (pooled.size >= 5 and spread <= _MAX_SPREAD and centre > 0)
    shown = ", ".join("–" if p is None else f"{plain(p.K)}" for p in plants)
    note = (
        f"Model of the {{wheels}} identified in {pooled.size} windows of {_WINDOW_S:g} s: K = {shown} {{speed_unit}} at 100{{percent}}, "
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
