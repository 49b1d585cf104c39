"""From what all wheels have in common to the plant of each: its own map near the machine's, its tyres, what stays unexplained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.valve_map import KNOTS, RAMPS
from diagnosis.wheels.plant_windows import Drive, Windows, regressors, rows_of
from diagnosis.wheels.robust_fit import Trimmed, misfits, solve
from replay.machine.config import WheelPlant

Array = NDArray[np.float64]

_SMOOTH = 2.5e-5  # ridge on the change of slope from ramp to ramp [opening²]
_TRIMMED = 3.0  # by which what believed windows leave stands for all healthy ones
_OWN_WINDOWS = 12.0  # that weigh as much as the machine's map when a wheel's own is fitted
_MOST_GRIP = 60.0
_SEEN = 0.99
_LEAST_GAIN = 1e-3  # of the largest speed, at full opening
_LEAST_SHARE = 0.03  # of the body in a wheel's speed: below, it runs free


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
    may_hold : float
        Share of its speed that the ground may give a wheel although the wheels are taken as free of it [1].
    """

    plants: tuple[WheelPlant | None, ...]
    misfit: float
    typical: float
    windows: int
    may_hold: float = 0.0


@dataclass(frozen=True)
class Trial:
    """What was found with one lag and hysteresis.

    Attributes
    ----------
    hysteresis : float
        Width of the spool's play [fraction].
    lag : float
        Of the speed behind opening and body [s].
    found : Trimmed
        Coefficients of all wheels together, and the windows that are believed.
    windows : Windows
        All of them.
    """

    hysteresis: float
    lag: float
    found: Trimmed
    windows: Windows


def plants_of(drives: Sequence[Drive], best: Trial, span: float, *, healthy: bool) -> PlantFit:
    """Every wheel's own coefficients near the machine's, and what they leave unexplained.

    `span` is the largest speed [m/s].
    """
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
            pull = penalty(body) + ridge * _OWN_WINDOWS / own.samples.size
            values = solve(own, pull, values)
            if misfits(own, values, 0.3 * span).mean() > misfits(own, best.found.values, 0.3 * span).mean():
                values = best.found.values
        plants.append(_plant(drives, i, values, best, span, healthy=healthy))
    order = np.sort(best.found.misfit)
    return PlantFit(tuple(plants), float(np.sqrt(best.found.score)), float(np.sqrt(order[order.size // 2])), order.size)


def penalty(body: bool) -> Array:
    """Ridge on the change of slope between neighbouring ramps, forward and in reverse.

    Shape (p, p), p ramps and the body's share where that is asked.
    """
    half = RAMPS // 2
    steps = np.zeros((2 * (half - 1), RAMPS + body))
    for side in range(2):
        for k in range(half - 1):
            steps[side * (half - 1) + k, side * half + k : side * half + k + 2] = -1.0, 1.0
    return np.asarray(_SMOOTH * steps.T @ steps)


def _plant(
    drives: Sequence[Drive], i: int, values: Array, best: Trial, span: float, *, healthy: bool
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
    if not _LEAST_GAIN * span <= K:  # a reading that is held goes with no opening
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


def _seen(drives: Sequence[Drive], best: Trial) -> float:
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


def _unexplained(drives: Sequence[Drive], i: int, values: Array, best: Trial, *, healthy: bool) -> tuple[float, float]:
    """Slow load and quick wander of wheel i that its model leaves in the believed windows, as speeds [m/s] and [m/s/√s]."""
    slow, quick = [np.zeros(0)], [np.zeros(0)]
    believed = best.found.chosen if healthy is False else np.arange(best.windows.wheel.size)
    believed = believed[best.windows.wheel[believed] == i]
    for number, drive in enumerate(drives):
        mine = best.windows.place[believed][best.windows.drive[believed] == number]
        if not mine.size:
            continue
        x = regressors(drive, i, best.hysteresis, best.lag, 1, body=values.size > RAMPS)
        every, length = rows_of(drive.dt)
        left = drive.y[:, i] - x @ values
        left = np.append(left, np.full(-left.size % every, np.nan))  # the last row of a window may be of fewer blocks
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
