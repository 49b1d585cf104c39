"""What identification works on: the driving of all wheels, cut into windows of a second with their normal equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.lag import low_passed
from diagnosis.estimation.valve_map import KNOTS, RAMPS, lagged_ramps, played
from diagnosis.wheels.robust_fit import Normal, mode, normal_equations
from replay.arrays.numeric import without_nan

Array = NDArray[np.float64]

_WINDOW_S, _ROW_S = 1.0, 0.04
_MOST_EFFORT = 2.5  # times the usual opening per speed


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
class Windows:
    """Normal equations of windows, and where they come from: mission, wheel, and number among the mission's windows."""

    normal: Normal
    drive: NDArray[np.intp]
    wheel: NDArray[np.intp]
    place: NDArray[np.intp]

    def part(self, chosen: NDArray[np.intp]) -> Windows:
        """Some of them. `chosen` are indices, shape (k,)."""
        return Windows(self.normal.part(chosen), self.drive[chosen], self.wheel[chosen], self.place[chosen])


def usual_driving(drives: Sequence[Drive], span: float) -> list[Drive]:
    """The missions without what takes far more opening per speed than most of the driving does.

    `span` is the largest speed [m/s].
    """
    effort = []
    for d in drives:
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
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


def rows_of(dt: float) -> tuple[int, int]:
    """Blocks of `dt` [s] from row to row, and rows in a window."""
    every = max(1, round(_ROW_S / dt))
    return every, max(4, round(_WINDOW_S / (dt * every)))


def windows_of(drives: Sequence[Drive], hysteresis: float, lag: float, span: float, *, body: bool) -> Windows:
    """All windows in which a wheel drives. Hysteresis in fractions of opening, lag in s, span in m/s."""
    parts = [Normal(np.zeros((0, RAMPS + body, RAMPS + body)), np.zeros((0, RAMPS + body)), np.zeros(0), np.zeros(0))]
    sources = [np.zeros((3, 0), dtype=np.intp)]
    for number, drive in enumerate(drives):
        every, length = rows_of(drive.dt)
        for i in range(drive.y.shape[1]):
            if not np.isfinite(drive.u[:, i]).any() or not np.isfinite(drive.y[:, i]).any():
                continue
            x = regressors(drive, i, hysteresis, lag, every, body=body)
            y = drive.y[::every, i]
            use = drive.moving[::every, i] & np.isfinite(y) & np.isfinite(drive.u[::every, i])
            usable = use & np.isfinite(x).all(axis=1)
            found = normal_equations(x, y, usable, length)
            n = found.samples.size
            power = np.where(use, y**2, 0.0)[: n * length].reshape(n, length).sum(axis=1)
            count = use[: n * length].reshape(n, length).sum(axis=1)
            driven = np.flatnonzero((count > 0.8 * length) & (power > count * (0.1 * span) ** 2))
            parts.append(found.part(driven))
            sources.append(np.stack([np.full(driven.size, number), np.full(driven.size, i), driven]))
    origin = np.asarray(np.concatenate(sources, axis=1), dtype=np.intp)
    normal = Normal(*(np.concatenate(x) for x in zip(*parts, strict=True)))
    return Windows(normal, origin[0], origin[1], origin[2])


def regressors(drive: Drive, i: int, hysteresis: float, lag: float, every: int, *, body: bool) -> Array:
    """Lagged ramps of wheel i's opening, and the lagged speed of the body; shape (rows, p).

    Hysteresis in fractions of opening, lag in s.
    """
    rows = -(-drive.u.shape[0] // every)
    out = np.zeros((rows, RAMPS + body))
    fade = float(np.exp(-drive.dt / lag))
    lagged_ramps(played(drive.u[:, i], hysteresis)[0], KNOTS, fade, every, out)
    if body:
        out[:, RAMPS] = low_passed(drive.body[:, i], lag, drive.dt)[::every]
    return out
