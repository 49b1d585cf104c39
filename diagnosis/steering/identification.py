"""Valve map, lag and play of a steering axle, identified from the mission with faults in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.blocks import SensorNoise, SteeringBlocks
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
from diagnosis.steering.valve_map import ValveMap, rates_at
from diagnosis.steering.windows import Windows, windows_of

Array = NDArray[np.float64]

_LONG_S, _SHORT_S = 0.25, 0.1
_LEAST_WINDOWS = 8
_LEAST_MISFIT = 0.02
_DRIFT = 0.05  # standard deviation of a slope from mission to mission, relative to it
_EACH_SLOPE, _EACH_DEAD, _EACH_LIMIT = 0.15, 0.003, 0.1  # of one direction against the other
_CONFIRMING = 1.2  # times the opening at which a limit is reached: from there on it was seen
_OPEN_LIMIT, _OPEN_LIMIT_STD = 1.5, 0.3  # a limit that was not seen: times the largest rate, and its relative std
_BEYOND = 0.5  # of what a rate grows beyond the openings that were seen: its standard deviation


@dataclass(frozen=True)
class SteeringPlant:
    """Valve and cylinder of an axle: ṙ = (f(u) − r)/lag, φ̇ = r, and the sensor follows φ with a play.

    Attributes
    ----------
    valve : ValveMap
        f, the rate by opening.
    lag : float
        Lag [s].
    play : float
        Half of the sensor's play [rad].
    cov : Array, shape (8, 8)
        Covariance of the constants, in the order of `diagnosis.steering.plant_fit`.
    misfit : float
        Share of a rate that the model does not explain, in the windows that it explains better.
    windows : int
        Windows of steering behind it.
    seen : tuple[float, float]
        Smallest and largest opening at which the axle was seen to obey it [fraction].
    """

    valve: ValveMap
    lag: float
    play: float
    cov: Array
    misfit: float
    windows: int
    seen: tuple[float, float]

    @property
    def gain(self) -> float:
        """Rate per opening beyond the dead band, mean of both directions [rad/s per full opening]."""
        return self.valve.gain

    @property
    def rate(self) -> float:
        """Largest rate [rad/s]."""
        return self.valve.limit

    @property
    def lag_std(self) -> float:
        """Standard deviation of the lag's logarithm, at most 1."""
        return float(min(np.sqrt(self.cov[LAG, LAG]), 1.0))

    @property
    def reliable(self) -> bool:
        """Whether valves can be judged by it."""
        return self.windows >= _LEAST_WINDOWS and self.misfit < 0.25

    def spread(self, u: Array) -> Array:
        """Standard deviation of the rate that is expected at openings [rad/s], shape of u."""
        grid = np.unique(np.concatenate([np.linspace(u.min(), u.max(), 201), [0.0]])) if u.size else np.zeros(1)
        x = packed(self.valve, self.lag, self.play)
        rates = rates_at(grid, self.valve)
        variance = (max(self.misfit, _LEAST_MISFIT) * rates) ** 2
        jacobian = np.empty((grid.size, 6))
        for i in range(6):
            h = np.sqrt(self.cov[i, i])
            up, down = x.copy(), x.copy()
            up[i] += h
            down[i] -= h
            jacobian[:, i] = (rates_at(grid, unpacked(up)[0]) - rates_at(grid, unpacked(down)[0])) / (2 * h)
        variance += np.einsum("ki,ij,kj->k", jacobian, self.cov[:6, :6], jacobian)
        edges = rates_at(np.clip(grid, *self.seen), self.valve)
        variance += (_BEYOND * (rates - edges)) ** 2
        return np.asarray(np.interp(u, grid, np.sqrt(variance)))


def identify_plants(
    axles: Sequence[SteeringBlocks | None], noises: Sequence[SensorNoise], stop: float
) -> list[SteeringPlant | None]:
    """Identify each axle's plant: its own about what both axles have in common.

    A fault that lasts would make one axle look slow; what the other axle has is the prior of each.

    Parameters
    ----------
    axles : Sequence[SteeringBlocks or None]
        None where an axle cannot be used.
    noises : Sequence[SensorNoise]
        Noise of each sensor.
    stop : float
        Angle of the end stops [rad].
    """
    windows = [
        None if b is None else (windows_of(b, w, stop, _LONG_S), windows_of(b, w, stop, _SHORT_S))
        for b, w in zip(axles, noises, strict=True)
    ]
    usable = [w for w in windows if w is not None]
    scale = usual_rate([w[0] for w in usable])
    if scale is None:
        return [None for _ in axles]
    fits = iter(_fit_axles(usable, scale))
    return [None if w is None else plant_of([w[0]], next(fits), scale) for w in windows]


def _fit_axles(windows: Sequence[tuple[Windows, Windows]], scale: float) -> list[FittedPlant]:
    """Constants of every axle: those of least loss about one that is believed of all, an axle's own or the common ones."""
    alone = [_fit_alone([w[0]], [w[1]], scale) for w in windows]
    if len(windows) == 1:
        return alone
    common = _fit_alone([w[0] for w in windows], [w[1] for w in windows], scale)
    tried = []
    for reference in (*alone, common):
        prior = Belief(reference.x, own_spread(reference.cov))
        tried.append(
            [
                min(
                    (fit_plant([w[1]], x, prior, scale, TOLERANCES[1:]) for x in (reference.x, own.x)),
                    key=lambda fit: fit.loss,
                )
                for w, own in zip(windows, alone, strict=True)
            ]
        )
    return min(tried, key=lambda fits: sum(f.loss for f in fits))


def own_spread(cov: Array) -> Array:
    """Covariance of one axle's constants about those of another."""
    return np.asarray(cov + _structure(0.2, 0.012, 0.1, lag=0.2, play=0.002))


def usual_rate(parts: Sequence[Windows]) -> float | None:
    """Rate at which the axles usually turn [rad/s]; None where they turn too little."""
    rates = np.concatenate([np.abs(w.rate[w.good]) for w in parts]) if parts else np.zeros(0)
    noise = max((w.noise for w in parts), default=0.0)
    turning = rates[rates > max(5 * noise, 1e-4)]
    return float(np.quantile(turning, 0.8)) if turning.size >= _LEAST_WINDOWS else None


def _fit_alone(long: Sequence[Windows], short: Sequence[Windows], scale: float) -> FittedPlant:
    """Constants that windows share, from a coarse grid on."""
    starts = _best_of_grid(long, scale)
    rough = [fit_plant(long, x, Belief(x, _wide_spread()), scale, TOLERANCES[:2]) for x in starts]
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
    """The plant of an axle with what it leaves unexplained in the windows that it explains better."""
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
            limits[i] = max(limits[i], _OPEN_LIMIT * slope * max(reach - dead, 0.0))
            place = LIMITS.start + i
            cov[place], cov[:, place] = 0.0, 0.0
            cov[place, place] = _OPEN_LIMIT_STD**2
    return valve._replace(limit_up=limits[0], limit_down=limits[1]), cov
