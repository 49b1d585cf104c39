"""Valve map, lag and play of a steering axle, identified from the mission with faults in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.blocks import SensorNoise, SteeringBlocks
from diagnosis.steering.plant import LEAST_WINDOWS, OPEN_LIMIT, OPEN_LIMIT_STD, SteeringPlant
from diagnosis.steering.plant_fit import (
    DEAD,
    LAG,
    LIMITS,
    PLAY,
    SIZE,
    SLOPES,
    TOLERANCES,
    Belief,
    FittedPlant,
    fit_plant,
    moving,
    packed,
    predicted_by,
    robust_loss,
    unpacked,
)
from diagnosis.steering.valve_map import ValveMap
from diagnosis.steering.windows import Windows, windows_of

Array = NDArray[np.float64]

LONG_S, SHORT_S = 0.25, 0.1
_COARSE = 5  # blocks
_EACH_SLOPE, _EACH_DEAD, _EACH_LIMIT = 0.15, 0.003, 0.1  # of one direction against the other
_CONFIRMING = 1.2  # times the opening at which a limit is reached: from there on it was seen


@dataclass(frozen=True)
class AxleWindows:
    """Windows of one axle, one entry per mission.

    Attributes
    ----------
    long, short : tuple[Windows, ...]
        For the map, and for lag and play.
    """

    long: tuple[Windows, ...]
    short: tuple[Windows, ...]


def identify_plants(
    axles: Sequence[SteeringBlocks | None],
    noises: Sequence[SensorNoise],
    stop: float,
    known: Sequence[SteeringPlant | None],
) -> list[SteeringPlant | None]:
    """Identify each axle's plant: about the one that is known of it, else its own about what both axles have in common.

    A fault that lasts would make one axle look slow; what the other axle has is the prior of each.

    Parameters
    ----------
    axles : Sequence[SteeringBlocks or None]
        None where an axle cannot be used.
    noises : Sequence[SensorNoise]
        Noise of each sensor.
    stop : float
        Angle of the end stops [rad].
    known : Sequence[SteeringPlant or None]
        What is known of each axle before the mission.
    """
    windows = [
        None if b is None else AxleWindows((windows_of(b, n, stop, LONG_S),), (windows_of(b, n, stop, SHORT_S),))
        for b, n in zip(axles, noises, strict=True)
    ]
    unknown = iter(fit_axles([w for w, k in zip(windows, known, strict=True) if w is not None and k is None]))
    return [
        None if w is None else next(unknown) if k is None else _refined(k, w)
        for w, k in zip(windows, known, strict=True)
    ]


def fit_axles(windows: Sequence[AxleWindows]) -> list[SteeringPlant | None]:
    """Plants of axles of which nothing is known; None for all where they turn too little."""
    scale = usual_rate([part for w in windows for part in w.long])
    if scale is None:
        return [None for _ in windows]
    return [plant_of(w.long, fit, scale) for w, fit in zip(windows, _fit_axles(windows, scale), strict=True)]


def _refined(known: SteeringPlant, windows: AxleWindows) -> SteeringPlant:
    """A known plant after a mission; as it was where the axle turns too little."""
    scale = usual_rate(windows.long)
    if scale is None:
        return known
    prior = Belief(packed(known.valve, known.lag, known.play), known.cov)
    fit = fit_plant(windows.short, prior.mean, prior, scale, TOLERANCES[1:])
    now = plant_of(windows.long, fit, scale)
    seen = min(known.seen[0], now.seen[0]), max(known.seen[1], now.seen[1])
    # the fault of a whole mission leaves nothing that the plant explains: what was known of it holds
    return replace(now, misfit=known.misfit, windows=known.windows, seen=seen)


def _fit_axles(windows: Sequence[AxleWindows], scale: float) -> list[FittedPlant]:
    """Constants of every axle: those of least loss about one that is believed of all, an axle's own or the common ones."""
    alone = [_fit_alone(w.long, w.short, scale) for w in windows]
    if len(windows) == 1:
        return alone
    common = _fit_alone([p for w in windows for p in w.long], [p for w in windows for p in w.short], scale)
    tried = []
    for reference in (*alone, common):
        prior = Belief(reference.x, own_spread(reference.cov))
        tried.append(
            [
                min(
                    (
                        fit_plant(w.short, x, prior, scale, TOLERANCES[1:])
                        for x in ((own.x,) if own is reference else (reference.x, own.x))
                    ),
                    key=lambda fit: fit.loss,
                )
                for w, own in zip(windows, alone, strict=True)
            ]
        )
    return min(tried, key=lambda fits: sum(f.loss for f in fits))


def own_spread(cov: Array) -> Array:
    """Covariance of one axle's constants about those of another. Both of shape (8, 8)."""
    return np.asarray(cov + _structure(0.2, 0.012, 0.1, lag=0.2, play=0.002))


def usual_rate(parts: Sequence[Windows]) -> float | None:
    """Rate at which the axles usually turn [rad/s]; None where they turn too little.

    Where the noise of one sensor would hide the motion of all axles, each is held to its own.
    """
    most = max((w.noise for w in parts), default=0.0)
    for noises in ([most] * len(parts), [w.noise for w in parts]):
        rates = [_turning(w, noise) for w, noise in zip(parts, noises, strict=True)]
        turning = np.concatenate(rates) if rates else np.zeros(0)
        if turning.size >= LEAST_WINDOWS:
            return float(np.quantile(turning, 0.8))
    return None


def _turning(w: Windows, noise: float) -> Array:
    """Rates of windows that noise does not explain [rad/s], shape (k,)."""
    rates = np.abs(w.rate[w.good])
    return np.asarray(rates[rates > max(5 * noise, 1e-4)])


def _fit_alone(long: Sequence[Windows], short: Sequence[Windows], scale: float) -> FittedPlant:
    """Constants that windows share, from a coarse grid on; until a few are left, by openings of coarser blocks."""
    coarse = [w.coarser(_COARSE) for w in long]
    starts = _best_of_grid(coarse, scale)
    rough = [fit_plant(coarse, x, Belief(x, _wide_spread()), scale, TOLERANCES[:2]) for x in starts]
    best = sorted(rough, key=lambda f: f.loss)[:2]
    return min(
        (fit_plant(short, f.x, Belief(f.x, _wide_spread()), scale, TOLERANCES[1:]) for f in best), key=lambda f: f.loss
    )


def _wide_spread() -> Array:
    """Covariance of the constants about a point of the coarse grid."""
    return _structure(0.7, 0.02, 0.5, lag=1.0, play=0.004)


def _structure(slope: float, dead: float, limit: float, *, lag: float, play: float) -> Array:
    """Covariance from what both directions share and what each has for itself."""
    out = np.zeros((SIZE, SIZE))
    for both, common, each in (
        (SLOPES, slope, _EACH_SLOPE),
        (DEAD, dead, _EACH_DEAD),
        (LIMITS, limit, _EACH_LIMIT),
    ):
        out[both, both] = common**2 + each**2 * np.eye(2)
    out[LAG, LAG], out[PLAY, PLAY] = lag**2, play**2
    return out


def _best_of_grid(parts: Sequence[Windows], scale: float) -> list[Array]:
    """The constants of least loss on a grid, one for each dead band."""
    turning = [w.good & (np.abs(w.rate) > 0.3 * scale) for w in parts]
    openings = np.concatenate([np.abs(w.opening[t]) for w, t in zip(parts, turning, strict=True)])
    rates = np.concatenate([np.abs(w.rate[t]) for w, t in zip(parts, turning, strict=True)])
    usable = openings > 0
    top = float(rates.max(initial=scale))
    if not usable.any():
        return [packed(ValveMap(1.0, 1.0, 0.0, 0.0, top, top), 0.06, 0.0)]
    typical, rate = float(np.median(openings[usable])), float(np.median(rates[usable]))
    found = []
    for share in (0.0, 0.2, 0.4, 0.6, 0.8):
        dead = share * typical
        trials = [
            packed(ValveMap(s, s, dead, dead, limit, limit), 0.06, 0.0)
            for s in rate / (typical - dead) * np.geomspace(0.4, 4.0, 12)
            for limit in top * np.array([0.8, 1.5])
        ]
        found.append(min(trials, key=lambda x: robust_loss(parts, x, scale, 0.2)))
    return found


def plant_of(parts: Sequence[Windows], fitted: FittedPlant, scale: float) -> SteeringPlant:
    """The plant of an axle with what it leaves unexplained in the windows that it explains better.

    `scale` is the rate [rad/s] against which errors are counted.
    """
    valve, lag, play = unpacked(fitted.x)
    shares, low, high = [], 0.0, 0.0
    for part in parts:
        predicted = predicted_by(part, fitted.x)
        use = moving(part, predicted, scale) & (np.abs(predicted) > 0.2 * scale)
        share = np.abs(part.rate - predicted)[use] / np.abs(predicted)[use]
        shares.append(share)
        obeyed = part.opening[use][share < 0.15]
        if obeyed.size:
            low, high = min(low, float(obeyed.min())), max(high, float(obeyed.max()))
    all_shares = np.concatenate(shares)
    misfit = float(np.quantile(all_shares, 0.3)) if all_shares.size else 1.0
    valve, cov = _with_open_limits(valve, fitted.cov, (low, high))
    return SteeringPlant(valve, lag, play, cov, misfit, all_shares.size, (low, high))


def _with_open_limits(valve: ValveMap, cov: Array, seen: tuple[float, float]) -> tuple[ValveMap, Array]:
    """Limits that no opening well beyond them has shown are set beyond what was seen, and known roughly."""
    cov = cov.copy()
    down, up = -seen[0], seen[1]
    limits = [valve.limit_up, valve.limit_down]
    for i, (reach, slope, dead) in enumerate(
        ((up, valve.slope_up, valve.dead_up), (down, valve.slope_down, valve.dead_down))
    ):
        if reach < _CONFIRMING * (dead + limits[i] / slope):
            limits[i] = max(limits[i], OPEN_LIMIT * slope * max(reach - dead, 0.0))
            place = LIMITS.start + i
            cov[place], cov[:, place] = 0.0, 0.0
            cov[place, place] = OPEN_LIMIT_STD**2
    return valve._replace(limit_up=limits[0], limit_down=limits[1]), cov
