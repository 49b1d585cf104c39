"""Positions of the body as a way along its track, beyond the way that the wheels have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.body.rolling import Rolling
from diagnosis.body.track import Readings

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_EARTH_RADIUS = 6_371_000.0
_TURN_S, _STEERED_S = (
    120.0,
    20.0,
)  # windows in which the track is turned onto the measured one, with a gyro and without [s]
_AGREE = 0.05  # of the top speed: spread of wheels that agree
_COMPARED_S = 5.0
_LEAST_WAY = 0.3  # of what the top speed makes of the window
_LEAST_NOISE = 1e-4


@dataclass(frozen=True)
class Positions:
    """Fixes of one sensor on a plane.

    Attributes
    ----------
    t : Array, shape (m,)
        When [s of the mission].
    place : Complex, shape (m,)
        Where [m]: east + i·north, or forward + i·left.
    """

    t: Array
    place: Complex


def on_plane(t: Array, lat: Array, lon: Array) -> Positions:
    """Fixes of latitude and longitude [deg] on the plane that touches the earth at the first one.

    All of shape (k,), `t` in s; positions in m, east + i·north.
    """
    north = np.radians(lat - lat[0]) * _EARTH_RADIUS
    east = np.radians(lon - lon[0]) * _EARTH_RADIUS * np.cos(np.radians(lat[0]))
    return Positions(t, east + 1j * north)


def news(positions: Positions) -> Positions:
    """Fixes that differ from the one before: a receiver that repeats itself says nothing."""
    new = np.r_[True, np.diff(positions.place) != 0]
    return Positions(positions.t[new], positions.place[new])


def moves(positions: Positions, rolling: Rolling, yaw_rate: Array | None, delay: float) -> tuple[Array, Complex, Array]:
    """From fix to fix: way by the wheels [m], measured displacement turned onto the track by the wheels [m], heading [rad].

    Parameters
    ----------
    positions, rolling
        Of m fixes.
    yaw_rate : Array, shape (blocks,), or None
        Measured [rad/s].
    delay : float
        By how much the fixes are late [s].

    Returns
    -------
    way : Array, shape (m − 1,)
    displacement : Complex, shape (m − 1,)
        Along the track, and to its left.
    heading : Array, shape (m,)
        From the first one on.
    """
    t = positions.t - delay
    course_rate = rolling.heading(yaw_rate)
    middle = (course_rate[:-1] + course_rate[1:]) / 2 + np.arctan(rolling.lateral)
    step = rolling.track_speed * rolling.dt * np.exp(1j * middle)
    reckoned = np.concatenate([[0.0], np.cumsum(step)])
    there = np.interp(t, rolling.edges, reckoned.real) + 1j * np.interp(t, rolling.edges, reckoned.imag)
    by_wheels, seen = np.diff(there), np.diff(positions.place)
    way = np.diff(np.interp(t, rolling.edges, rolling.way))
    trust = 1.0 / (1.0 + (rolling.spread / (_AGREE * rolling.top)) ** 2)
    agreed = np.interp((t[:-1] + t[1:]) / 2, rolling.edges[:-1], trust)
    turn = _turned(t, by_wheels * agreed, seen, _STEERED_S if yaw_rate is None else _TURN_S)
    course = np.interp((t[:-1] + t[1:]) / 2, rolling.edges[:-1] + rolling.dt / 2, middle)
    heading = np.interp(t, rolling.edges, course_rate)
    return way, seen * np.exp(-1j * (course + turn)), heading


def _turned(t: Array, by_wheels: Complex, seen: Complex, window: float) -> Array:
    """Angle from the track by the wheels to the measured one at each move [rad]; held where nothing moves."""
    middle = (t[:-1] + t[1:]) / 2
    products = np.concatenate([[0.0], np.cumsum(np.conj(by_wheels) * seen)])
    squares = np.concatenate([[0.0], np.cumsum(np.abs(by_wheels) ** 2)])
    a, b = np.searchsorted(middle, middle - window / 2), np.searchsorted(middle, middle + window / 2)
    product, square = products[b] - products[a], squares[b] - squares[a]
    usual = np.abs(by_wheels).max(initial=0.0) ** 2
    sure = square > 3 * usual if usual > 0 else np.zeros(square.shape, dtype=np.bool_)
    if not sure.any():
        return np.zeros(middle.shape)
    unit = product[sure] / np.maximum(np.abs(product[sure]), 1e-300)
    phase = np.unwrap(np.angle(unit))
    return np.asarray(np.interp(middle, middle[sure], phase))


def agreement(positions: Positions, rolling: Rolling) -> float:
    """Measured way over the way by the wheels, median of windows in which they turn [1]; NaN without any."""
    edges = np.arange(0.0, rolling.size * rolling.dt, _COMPARED_S)
    near = np.searchsorted(positions.t, edges)
    near = near[near < positions.t.size]
    there = positions.place[near]
    t = positions.t[near]
    turned = rolling.heading(None)[:-1] + np.arctan(rolling.lateral)
    reckoned = np.concatenate([[0.0], np.cumsum(rolling.track_speed * rolling.dt * np.exp(1j * turned))])
    by_wheels = np.interp(t, rolling.edges, reckoned.real) + 1j * np.interp(t, rolling.edges, reckoned.imag)
    expected = np.abs(np.diff(by_wheels))
    good = expected > _LEAST_WAY * rolling.top * _COMPARED_S
    if not good.any():
        return float("nan")
    return float(np.median(np.abs(np.diff(there))[good] / expected[good]))


def way_readings(positions: Positions, rolling: Rolling, yaw_rate: Array | None, delay: float) -> Readings:
    """What fixes say of the way, per cell; several in one cell are averaged.

    Shape (cells,): the way in m; `yaw_rate` of shape (n,) in rad/s, `delay` in s.
    """
    way, displacement, heading = moves(positions, rolling, yaw_rate, delay)
    beyond = np.concatenate([[0.0], np.cumsum(displacement.real - way)])
    noise = _noise(beyond)
    cells = rolling.cells.size
    cell, inside = rolling.cell_of(positions.t - delay)
    count = np.bincount(cell[inside], minlength=cells)
    many = np.maximum(count, 1)
    z = np.where(count > 0, np.bincount(cell[inside], weights=beyond[inside], minlength=cells) / many, np.nan)
    turned = np.bincount(cell[inside], weights=heading[inside], minlength=cells) / many
    rows = np.zeros((cells, 4))
    rows[:, 0], rows[:, 2] = 1.0, -turned
    return Readings(z, noise / np.sqrt(many), rows)


def _noise(beyond: Array) -> float:
    """Noise of a single fix [m], from the second differences of what it says beyond the wheels."""
    if beyond.size < 3:
        return 1.0
    bend = np.abs(np.diff(beyond, n=2))
    return max(float(np.median(bend) / 0.6745 / np.sqrt(6.0)), _LEAST_NOISE)
