"""The speed of the body by all sensors of it, with its uncertainty, and which of them were left out and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.body.independence import from_wheels
from diagnosis.body.positions import agreement, news, way_readings
from diagnosis.body.rolling import Rolling
from diagnosis.body.sources import BodySensors
from diagnosis.body.track import Readings, Track, track_of
from diagnosis.results.plain_numbers import plain

Array = NDArray[np.float64]

_LEAST_FIXES = 20
_AGREES = (0.7, 1.4)
_CONTRADICTS = 3.0  # standard deviations
_SHARE = 0.03  # of the top speed: what wheels that agree may differ by
_LEAST_STD = 0.005  # of the top speed
_YAW_AGREES = (0.7, 1.4)


@dataclass(frozen=True)
class BodySpeed:
    """The body by its own sensors, in n blocks.

    Attributes
    ----------
    speed, std : Array, shape (n,)
        Forward speed, and its standard deviation [m/s]; NaN where no sensor says anything.
    yaw_doubt : Array, shape (n,)
        By how much the measured yaw rate contradicts speed and steering [rad/s]; 0 where it does not, or is not measured.
    notes : tuple[str, ...]
        Which sensors were used, and which were not and why, one sentence each.
    """

    speed: Array
    std: Array
    yaw_doubt: Array
    notes: tuple[str, ...]

    @property
    def known(self) -> bool:
        """Whether any sensor says anything."""
        return bool(np.isfinite(self.speed).any())


def body_speed(sensors: BodySensors, rolling: Rolling) -> BodySpeed:
    """Speed of the body by whatever of positions, odometry, speed over ground and yaw rate the log holds.

    Parameters
    ----------
    sensors : BodySensors
        What the log holds.
    rolling : Rolling
        The wheels.
    """
    notes: list[str] = []
    yaw_rate = _yaw_rate(sensors, rolling, notes)
    tracks: list[Track] = []
    for name, positions in sensors.positions.items():
        reason, ratio = "", float("nan")
        fixes = news(positions)
        if fixes.t.size < _LEAST_FIXES:
            reason = f"{fixes.t.size} positions that differ are too few"
        elif np.isnan(ratio := agreement(fixes, rolling)):
            reason = "the wheels hardly turn"
        elif not _AGREES[0] < ratio < _AGREES[1]:
            reason = f"it moves {plain(ratio, 2)} times as far as the wheels roll (in the air, slipping, or not this machine)"
        elif name == "odometry" and from_wheels(fixes, rolling):
            reason = "it is computed from the wheels' own speeds"
        if reason:
            notes.append(f"Body sensor {name} left out: {reason}.")
            continue
        track = track_of(lambda delay, fixes=fixes: way_readings(fixes, rolling, yaw_rate, delay), rolling)  # type: ignore[misc]
        tracks.append(track)
        notes.append(_said(name, track))
    if sensors.speed is not None:
        _over_ground(*sensors.speed, rolling, yaw_rate, tracks, notes)
    speed, std = _fused(tracks, rolling)
    return BodySpeed(speed, std, _yaw_doubt(yaw_rate, speed, rolling), tuple(notes))


def _said(name: str, track: Track) -> str:
    text = f"Speed of the body by {name}: ±{plain(float(np.median(track.std)), 2)} m/s, {track.delay:.1f} s late"
    return f"{text}, jumps: {track.jumps}." if track.jumps else f"{text}."


def _over_ground(
    t: Array, values: Array, rolling: Rolling, yaw_rate: Array | None, tracks: list[Track], notes: list[str]
) -> None:
    """Add what a speed over ground says; it has no sign of its own."""
    common = np.interp(t, rolling.edges[:-1] + rolling.dt / 2, rolling.track_speed)
    driving = np.abs(common) > 0.3 * rolling.top
    if driving.sum() < _LEAST_FIXES:
        notes.append("Body sensor speed over ground left out: the wheels hardly turn.")
        return
    ratio = float(np.median(np.abs(values[driving]) / np.abs(common[driving])))
    if not _AGREES[0] < ratio < _AGREES[1]:
        notes.append(
            f"Body sensor speed over ground left out: it is {plain(ratio, 2)} times as fast as the wheels roll."
        )
        return
    rate = rolling.curvature * rolling.speed if yaw_rate is None else np.nan_to_num(yaw_rate)

    def readings(delay: float) -> Readings:
        then = t - delay
        wheels = np.interp(then, rolling.edges[:-1] + rolling.dt / 2, rolling.track_speed)
        beyond = np.sign(wheels) * np.abs(values) - wheels
        cell, inside = rolling.cell_of(then)
        inside &= np.abs(wheels) > 0.1 * rolling.top
        count = np.bincount(cell[inside], minlength=rolling.cells.size)
        many = np.maximum(count, 1)
        total = np.bincount(cell[inside], weights=beyond[inside], minlength=rolling.cells.size)
        rows = np.zeros((rolling.cells.size, 4))
        rows[:, 1], rows[:, 2] = 1.0, -rolling.at_cells(rate)
        rows[:, 3] = rolling.at_cells(rolling.track_speed)
        noise = float(np.median(np.abs(np.diff(beyond)))) / 0.6745 / np.sqrt(2.0)
        return Readings(np.where(count > 0, total / many, np.nan), max(noise, 1e-3 * rolling.top) / np.sqrt(many), rows)

    track = track_of(readings, rolling)
    tracks.append(track)
    notes.append(_said("speed over ground", track))


def _fused(tracks: list[Track], rolling: Rolling) -> tuple[Array, Array]:
    """Forward speed by all tracks and its standard deviation, per block; uncertain where they contradict each other."""
    nothing = np.full(rolling.size, np.nan)
    if not tracks:
        return nothing, nothing
    least = _LEAST_STD * rolling.top
    beyond, std = tracks[0].beyond, np.hypot(tracks[0].std, least)
    for track in tracks[1:]:
        other = np.hypot(track.std, least)
        apart = np.abs(track.beyond - beyond)
        odd = np.where(apart > _CONTRADICTS * np.hypot(std, other), apart, 0.0)
        share = std**2 / (std**2 + other**2)
        beyond = beyond + share * (track.beyond - beyond)
        std = np.hypot(std * other / np.hypot(std, other), odd)
    add, deviation = rolling.per_block(beyond), rolling.per_block(std)
    # all wheels and the command agree, and the sensor says otherwise: either may be wrong
    together = rolling.spread < _SHARE * rolling.top
    contradicts = together & (np.abs(add) > _CONTRADICTS * deviation + _SHARE * rolling.top)
    deviation = np.where(contradicts, np.hypot(deviation, add), deviation)
    unknown = ~np.isfinite(rolling.voters).any(axis=1)
    speed = np.where(unknown, np.nan, rolling.speed + add / rolling.stretch)
    return speed, np.where(unknown, np.nan, deviation / rolling.stretch)


def _yaw_rate(sensors: BodySensors, rolling: Rolling, notes: list[str]) -> Array | None:
    """Measured yaw rate per block without its bias [rad/s]; None where there is none, or it is no yaw rate of this body."""
    if sensors.yaw_rate is None:
        return None
    rate = sensors.yaw_rate
    steered = rolling.curvature * rolling.speed
    still = (np.abs(rolling.speed) < 0.01 * rolling.top) & np.isfinite(rate)
    if still.sum() * rolling.dt > 2.0:
        rate = rate - float(np.median(rate[still]))
    known = np.isfinite(rate) & np.isfinite(steered)
    turning = known & (np.abs(steered) > 0.3 * np.quantile(np.abs(steered[known]), 0.95)) if known.any() else known
    if turning.sum() * rolling.dt < 2.0:
        notes.append("Measured yaw rate left out: the machine hardly turns.")
        return None
    ratio = float(np.median(rate[turning] / steered[turning]))
    if not _YAW_AGREES[0] < ratio < _YAW_AGREES[1]:
        notes.append(f"Measured yaw rate left out: it is {plain(ratio, 2)} times that of speed and steering.")
        return None
    notes.append(
        "Measured yaw rate used: it gives the heading, and where it contradicts the steering nothing is believed."
    )
    return rate


def _yaw_doubt(yaw_rate: Array | None, speed: Array, rolling: Rolling) -> Array:
    """By how much speed and steering contradict the measured yaw rate [rad/s], beyond what they usually do."""
    if yaw_rate is None:
        return np.zeros(rolling.size)
    apart = np.abs(yaw_rate - rolling.curvature * np.where(np.isfinite(speed), speed, rolling.speed))
    width = max(1, round(0.5 / rolling.dt))
    smooth = np.convolve(np.nan_to_num(apart), np.ones(width) / width, mode="same")
    usual = 3.0 * float(np.median(smooth))
    return np.asarray(np.where(smooth > usual, smooth, 0.0))
