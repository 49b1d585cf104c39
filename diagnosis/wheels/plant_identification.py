"""Identification of all wheels' plants at once: valve map, hysteresis, lag, and how the tyres tie a wheel to the body.

On the ground a wheel follows τ·ν̇ = −ν + map(u) + grip·(body − ν), so that its speed is a lagged sum of ramps of its opening
and of the speed that the other wheels give the body. The sum is linear in its coefficients; lag and hysteresis are
searched. Every window of a second may be faulty, so that the share of them that agree best decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.lag import low_passed
from diagnosis.wheels.robust_fit import Normal, Trimmed, misfits, mode, normal_equations, solve, trimmed
from diagnosis.wheels.valve_map import KNOTS, RAMPS, lagged_ramps, played
from replay.arrays.numeric import without_nan
from replay.machine.config import WheelPlant

Array = NDArray[np.float64]

_WINDOW_S, _ROW_S = 1.0, 0.04
_LAGS = (0.02, 0.05, 0.12, 0.3, 0.7)
_PLAYS = (0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04)
_FREE_LAGS = (0.02, 0.05, 0.1, 0.17, 0.25, 0.35, 0.5, 0.8)
_SMOOTH = 2.5e-5  # ridge on the change of slope from ramp to ramp [opening²]
_STARTS, _STARTS_LATER = 16, 5
_LEAST_WINDOWS = 24
_BETTER = 0.97
_HELD_SHARE = 0.8
_MOST_EFFORT = 2.5  # times the usual opening per speed
_TRIMMED = 3.0  # by which what believed windows leave stands for all healthy ones
_FREE_ENOUGH = 1.3  # of the misfit with the body: below, the wheels run free of it
_OWN_WINDOWS = 12.0  # that weigh as much as the machine's map when a wheel's own is fitted
_MOST_GRIP = 60.0
_SEEN = 0.99
_LEAST_SHARE = 0.03  # of the body in a wheel's speed: below, it runs free
_WIDER, _WIDER_STEPS = 5.0, 4


@dataclass(frozen=True)
class Drive:
    """What is to be explained: block means of all wheels of one mission, shape (n, wheels).

    Attributes
    ----------
    y, u : Array
        Speed [m/s] and opening [fraction].
    body : Array
        Speed at which the wheel would roll by the other wheels [m/s]; NaN where nobody knows.
    moving : NDArray[np.bool_]
        Where the wheel is commanded to move and nothing speaks against its use.
    dt : float
        Block [s].
    """

    y: Array
    u: Array
    body: Array
    moving: NDArray[np.bool_]
    dt: float


@dataclass(frozen=True)
class PlantFit:
    """What a mission or several say of the wheels.

    Attributes
    ----------
    plants : tuple[WheelPlant or None, ...]
        Per wheel.
    misfit : float
        Root of the relative mean square that the believed windows leave.
    typical : float
        The same of the median window.
    windows : int
        Windows in which a wheel drives.
    """

    plants: tuple[WheelPlant | None, ...]
    misfit: float
    typical: float
    windows: int


@dataclass(frozen=True)
class _Windows:
    """Normal equations of windows, and where they come from: mission, wheel, and number among the mission's windows."""

    normal: Normal
    drive: NDArray[np.intp]
    wheel: NDArray[np.intp]
    place: NDArray[np.intp]

    def part(self, chosen: NDArray[np.intp]) -> _Windows:
        return _Windows(self.normal.part(chosen), self.drive[chosen], self.wheel[chosen], self.place[chosen])


@dataclass(frozen=True)
class _Trial:
    hysteresis: float
    lag: float
    found: Trimmed
    windows: _Windows


def identify_plants(
    drives: Sequence[Drive], span: float, share: float = 0.3, coupling: str = "auto"
) -> PlantFit | None:
    """Plants of all wheels from one or more missions; None where they drive too little.

    Parameters
    ----------
    drives : Sequence[Drive]
        The missions.
    span : float
        Top speed of the machine [m/s].
    share : float
        Share of the windows that are believed.
    coupling : str
        ``free``, ``ground`` or ``auto``.
    """
    drives = _usual(drives, span)
    free = _search(drives, span, share, _FREE_LAGS, None)
    if free is None:
        return None
    best = free
    known = any(np.isfinite(d.body).any() for d in drives)
    if coupling != "free" and known:
        # the body explains a wheel with a dead valve too: only windows that obey their openings may show the tyres
        held = _search(drives, span, _HELD_SHARE, _LAGS, free.found.chosen)
        if held is not None and (coupling == "ground" or free.found.score > _FREE_ENOUGH**2 * held.found.score):
            best = _widened(drives, held, span)
    return _finished(drives, best, span, healthy=share > 0.5)


def _usual(drives: Sequence[Drive], span: float) -> list[Drive]:
    """The missions without what takes far more opening per speed than most of the driving does."""
    effort = []
    for d in drives:
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.where(d.moving & (np.abs(d.y) > 0.15 * span), np.abs(d.u / d.y), np.nan)
        effort.append(ratio[np.isfinite(ratio) & (ratio > 0)])
    every = np.concatenate(effort)
    if not every.size:
        return list(drives)
    usual = float(np.exp(mode(np.log(every))))
    most = _MOST_EFFORT * usual
    return [
        replace(
            d, moving=d.moving & (np.abs(without_nan(d.u)) < most * np.maximum(np.abs(without_nan(d.y)), 0.3 * span))
        )
        for d in drives
    ]


def _search(
    drives: Sequence[Drive], span: float, share: float, lags: Sequence[float], among: NDArray[np.intp] | None
) -> _Trial | None:
    """Lag and hysteresis that explain the best windows best; with the speed of the body `among` some windows alone."""
    body = among is not None

    def trial(hysteresis: float, lag: float, before: _Trial | None) -> _Trial | None:
        windows = _windows(drives, hysteresis, lag, span, body=body)
        if among is not None:
            windows = windows.part(among)
        if windows.wheel.size < _LEAST_WINDOWS:
            return None
        starts = _STARTS if before is None else _STARTS_LATER
        given = None if before is None else before.found.chosen
        found = trimmed(windows.normal, _penalty(body), share, 0.3 * span, starts, given)
        return _Trial(hysteresis, lag, found, windows)

    best: _Trial | None = None
    for lag in lags:
        best = _better(best, trial(0.0, lag, None), 1.0)
        if best is None:
            return None
    assert best is not None
    for hysteresis in _PLAYS[1:]:
        before = best
        best = _better(before, trial(hysteresis, before.lag, before), _BETTER) or before
        if best is not before or hysteresis <= _PLAYS[2]:
            best = _better(best, trial(hysteresis, max(best.lag / 2, 0.01), best), _BETTER) or best
    for factor in (0.7, 1.4):
        best = _better(best, trial(best.hysteresis, best.lag * factor, best), _BETTER) or best
    return best


def _widened(drives: Sequence[Drive], found: _Trial, span: float) -> _Trial:
    """The same from all windows that it explains nearly as well: those that obey their openings alone show little of tyres."""
    windows = _windows(drives, found.hysteresis, found.lag, span, body=True)
    values, score = found.found.values, found.found.score
    for _ in range(_WIDER_STEPS):
        left = misfits(windows.normal, values, 0.3 * span)
        chosen = np.flatnonzero(left <= _WIDER * score)
        values = solve(windows.normal.part(chosen), _penalty(body=True))
    left = misfits(windows.normal, values, 0.3 * span)
    return replace(found, found=Trimmed(values, left, chosen, float(left[chosen].mean())), windows=windows)


def _better(best: _Trial | None, found: _Trial | None, factor: float) -> _Trial | None:
    if found is None or (best is not None and found.found.score >= factor * best.found.score):
        return best
    return found


def _penalty(body: bool) -> Array:
    """Ridge on the change of slope between neighbouring ramps, forward and in reverse."""
    half = RAMPS // 2
    steps = np.zeros((2 * (half - 1), RAMPS + body))
    for side in range(2):
        for k in range(half - 1):
            steps[side * (half - 1) + k, side * half + k : side * half + k + 2] = -1.0, 1.0
    return np.asarray(_SMOOTH * steps.T @ steps)


def _rows(dt: float) -> tuple[int, int]:
    """Blocks of `dt` [s] from row to row, and rows in a window."""
    every = max(1, round(_ROW_S / dt))
    return every, max(4, round(_WINDOW_S / (dt * every)))


def _windows(drives: Sequence[Drive], hysteresis: float, lag: float, span: float, *, body: bool) -> _Windows:
    """All windows in which a wheel drives."""
    parts = [Normal(np.zeros((0, RAMPS + body, RAMPS + body)), np.zeros((0, RAMPS + body)), np.zeros(0), np.zeros(0))]
    sources = [np.zeros((3, 0), dtype=np.intp)]
    for number, drive in enumerate(drives):
        every, length = _rows(drive.dt)
        for i in range(drive.y.shape[1]):
            if not np.isfinite(drive.u[:, i]).any() or not np.isfinite(drive.y[:, i]).any():
                continue
            x = _regressors(drive, i, hysteresis, lag, every, body=body)
            y = drive.y[::every, i]
            use = drive.moving[::every, i] & np.isfinite(y) & np.isfinite(drive.u[::every, i])
            usable = use & np.isfinite(x).all(axis=1)
            found = normal_equations(np.nan_to_num(x), np.nan_to_num(y), usable, length)
            n = found.samples.size
            power = np.where(use, np.nan_to_num(y) ** 2, 0.0)[: n * length].reshape(n, length).sum(axis=1)
            count = use[: n * length].reshape(n, length).sum(axis=1)
            driven = np.flatnonzero((count > 0.8 * length) & (power > count * (0.1 * span) ** 2))
            parts.append(found.part(driven))
            sources.append(np.stack([np.full(driven.size, number), np.full(driven.size, i), driven]))
    origin = np.asarray(np.concatenate(sources, axis=1), dtype=np.intp)
    normal = Normal(*(np.concatenate(x) for x in zip(*parts, strict=True)))
    return _Windows(normal, origin[0], origin[1], origin[2])


def _regressors(drive: Drive, i: int, hysteresis: float, lag: float, every: int, *, body: bool) -> Array:
    """Lagged ramps of wheel i's opening, and the lagged speed of the body; shape (rows, p)."""
    rows = -(-drive.u.shape[0] // every)
    out = np.zeros((rows, RAMPS + body))
    fade = float(np.exp(-drive.dt / lag))
    lagged_ramps(played(drive.u[:, i], hysteresis)[0], KNOTS, fade, every, out)
    if body:
        out[:, RAMPS] = low_passed(drive.body[:, i], lag, drive.dt)[::every]
    return out


def _finished(drives: Sequence[Drive], best: _Trial, span: float, *, healthy: bool) -> PlantFit:
    """Every wheel's own coefficients near the machine's, and what they leave unexplained."""
    body = best.found.values.size > RAMPS
    normal, wheel = best.windows.normal, best.windows.wheel
    chosen = np.zeros(wheel.size, dtype=np.bool_)
    chosen[best.found.chosen] = True
    ridge = normal.gram[chosen].mean(axis=0) / normal.samples[chosen].mean()
    plants: list[WheelPlant | None] = []
    for i in range(drives[0].y.shape[1]):
        own = normal.part(chosen & (wheel == i))
        if not (wheel == i).any():
            plants.append(None)
            continue
        values = best.found.values
        if own.samples.size:
            pull = _penalty(body) + ridge * _OWN_WINDOWS / own.samples.size
            values = solve(own, pull, values)
            if misfits(own, values, 0.3 * span).mean() > misfits(own, best.found.values, 0.3 * span).mean():
                values = best.found.values
        plants.append(_plant(drives, i, values, best, span, healthy=healthy))
    order = np.sort(best.found.misfit)
    return PlantFit(tuple(plants), float(np.sqrt(best.found.score)), float(np.sqrt(order[order.size // 2])), order.size)


def _plant(
    drives: Sequence[Drive], i: int, values: Array, best: _Trial, span: float, *, healthy: bool
) -> WheelPlant | None:
    """Constants of wheel i from its coefficients."""
    share = min(float(values[RAMPS]), _MOST_GRIP / (1 + _MOST_GRIP)) if values.size > RAMPS else 0.0
    share = share if share >= _LEAST_SHARE else 0.0
    grip = share / (1.0 - share)
    half = RAMPS // 2
    slopes = values[:RAMPS] / (1.0 - share)
    seen = _seen(drives, best)
    if seen <= 0:
        return None
    sides = [_side(slopes[:half], seen, span), _side(slopes[half:], seen, span)]
    openings = np.r_[-KNOTS[:0:-1], KNOTS]
    speeds = np.r_[-sides[1][0][:0:-1], sides[0][0]]
    unseen = np.r_[-sides[1][1][:0:-1], sides[0][1]]
    K = 0.5 * float(np.interp(seen, openings, speeds) - np.interp(-seen, openings, speeds)) / seen
    if K <= 0:
        return None
    lag = best.lag * (1.0 + grip)
    load, wander = _unexplained(drives, i, values, best, healthy=healthy)
    return WheelPlant(
        K=K,
        tau=lag,
        load=load * (1.0 + grip),
        openings=tuple(openings.tolist()),
        speeds=tuple(np.maximum.accumulate(speeds).tolist()),
        unseen=tuple(unseen.tolist()),
        hysteresis=best.hysteresis,
        grip=grip,
        wander=wander,
    )


def _seen(drives: Sequence[Drive], best: _Trial) -> float:
    """Opening up to which wheels drove while they were explained [fraction]."""
    half = RAMPS // 2
    # mean excitation of the believed windows beyond each knot, by the power of the ramps that begin there
    power = best.windows.normal.gram[best.found.chosen][:, np.arange(RAMPS), np.arange(RAMPS)]
    used = (
        power > 0.05 * best.windows.normal.samples[best.found.chosen, None] * np.diff(np.r_[KNOTS])[_FOLD] ** 2
    ).sum(axis=0)
    both = np.maximum(used[:half], used[half:])
    known = np.flatnonzero(both >= max(3, 0.02 * best.found.chosen.size))
    return float(KNOTS[known[-1] + 1]) if known.size else 0.0


_FOLD = np.r_[np.arange(RAMPS // 2), np.arange(RAMPS // 2)]


def _side(slopes: Array, seen: float, span: float) -> tuple[Array, Array]:
    """Speeds at the knots of one direction, and by how much faster a wheel may be where none was seen."""
    speeds = np.r_[0.0, np.cumsum(slopes * np.diff(KNOTS))]
    top = float(np.interp(seen, KNOTS, speeds))
    beyond = seen + 1e-9 < KNOTS
    steep = max(top / seen, float(slopes.max(initial=0.0)))
    speeds[beyond] = max(top, 1e-3 * span)
    return speeds, np.asarray(steep * np.maximum(KNOTS - seen, 0.0) * beyond)


def _unexplained(drives: Sequence[Drive], i: int, values: Array, best: _Trial, *, healthy: bool) -> tuple[float, float]:
    """Slow load and quick wander of wheel i that its model leaves in the believed windows, as speeds [m/s] and [m/s/√s]."""
    slow, quick = [np.zeros(0)], [np.zeros(0)]
    believed = best.found.chosen if healthy is False else np.arange(best.windows.wheel.size)
    believed = believed[best.windows.wheel[believed] == i]
    for number, drive in enumerate(drives):
        mine = best.windows.place[believed][best.windows.drive[believed] == number]
        if not mine.size:
            continue
        x = _regressors(drive, i, best.hysteresis, best.lag, 1, body=values.size > RAMPS)
        every, length = _rows(drive.dt)
        left = drive.y[:, i] - x @ values
        rows = left[: left.size // (every * length) * every * length].reshape(-1, every * length)[mine]
        near, far = (_growth(rows, float(np.exp(-drive.dt / best.lag)), k) for k in (1, min(5, rows.shape[1] - 1)))
        slow.append(np.nanmean(rows, axis=1) ** 2)
        quick.append((far - near) / (4 * drive.dt))  # the sensor's noise is in both
    load, wander = np.concatenate(slow), np.concatenate(quick)
    if not load.size:
        return 0.0, 0.0
    if healthy:
        most = np.quantile(load, _SEEN), np.quantile(wander, _SEEN)
        return float(np.sqrt(np.minimum(load, most[0]).mean())), float(
            np.sqrt(max(np.minimum(wander, most[1]).mean(), 0.0))
        )
    return float(_TRIMMED * np.sqrt(np.median(load))), float(_TRIMMED * np.sqrt(max(np.median(wander), 0.0)))


def _growth(rows: Array, fade: float, ahead: int) -> Array:
    """Mean square by which each row's errors change in `ahead` blocks beyond what fades, shape (rows,)."""
    return np.asarray(np.nanmean((rows[:, ahead:] - fade**ahead * rows[:, :-ahead]) ** 2, axis=1))
