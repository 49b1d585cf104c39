"""Wheel models of the machine file, or identified in the mission."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.wheel_model import WheelModelFit
from diagnosis.wheels.blocks import block_width
from diagnosis.wheels.body import MeasuredBody, rolling_speeds
from diagnosis.wheels.identification import identified, identify
from diagnosis.wheels.motion import body_speeds, in_motion
from diagnosis.wheels.plant_identification import Drive
from diagnosis.wheels.wheel_channels import WheelChannels
from replay.arrays.blocks import release
from replay.arrays.numeric import without_nan
from replay.control.loop import Replay, any_finite
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_CONTRADICTS = 2.0  # standard deviations from which on wheels are less sure of the body than its own sensors


def wheel_fit(
    channels: WheelChannels,
    replay: Replay,
    timeline: Timeline,
    machine: Machine,
    angle: Array,
    body: MeasuredBody | None = None,
) -> WheelModelFit | None:
    """Wheel models of the machine file, or identified in this mission; None where nothing allows it.

    Parameters
    ----------
    channels, replay, timeline, machine
        The mission.
    angle : Array, shape (n, axles)
        Best estimate of the axles' angles [rad].
    body : MeasuredBody or None
        The body by its own sensors.
    """
    if not (any_finite(channels.opening).any() and any_finite(channels.speed).any()):
        return None
    given = {i: p for i, w in enumerate(machine.wheels) if (p := machine.plant.wheels.get(w)) is not None}
    if len(given) < len(machine.wheels):
        found = identified(wheel_drive(channels, replay, timeline, machine, angle, body), machine, given)
        if found is not None:
            return found
    width = min(block_width(timeline.dt), timeline.size)
    limit = machine.limits.driving_speed

    def mean(function: Callable[..., NDArray[Any]], *columns: Array) -> Array:
        out = []
        for part in timeline.store.blocks(timeline.size // width * width, width):
            x = np.asarray(function(*(c[part] for c in columns)), np.float64)
            out.append(x.reshape(-1, width, x.shape[1]).mean(axis=1))
            release(*columns)
        return np.concatenate(out)

    moving = mean(lambda ref, v: np.abs(np.where(np.isfinite(ref), ref, v)) > limit, replay.v_ref, channels.speed)
    return identify(
        mean(np.asarray, channels.speed),
        mean(np.asarray, channels.opening),
        np.asarray(moving > 0.5),
        timeline.dt * width,
        given,
        machine.plant.flow,
        mean(lambda u: np.abs(without_nan(u)), channels.opening),
    )


def wheel_drive(
    channels: WheelChannels,
    replay: Replay,
    timeline: Timeline,
    machine: Machine,
    angle: Array,
    body: MeasuredBody | None = None,
) -> Drive:
    """Block means of all wheels for `diagnosis.wheels.plant_identification`; parameters as in `wheel_fit`."""
    width = min(block_width(timeline.dt), timeline.size)
    limit = machine.limits.driving_speed
    ratio, turn = in_motion(angle, machine, timeline)

    def mean(function: Callable[..., NDArray[Any]], *columns: Array) -> Array:
        out = []
        for part in timeline.store.blocks(timeline.size // width * width, width):
            x = np.asarray(function(*(c[part] for c in columns)), np.float64)
            out.append(x.reshape(-1, width, x.shape[1]).mean(axis=1))
            release(*columns)
        return np.concatenate(out)

    moving = mean(lambda ref, v: np.abs(np.where(np.isfinite(ref), ref, v)) > limit, replay.v_ref, channels.speed)
    y = mean(np.asarray, channels.speed)
    ratios, turns = mean(np.asarray, ratio), mean(np.asarray, turn)
    rolls = body_speeds(y, ratios, turns)
    if body is not None and body.body.known:
        sensed, std = rolling_speeds(body, ratios, turns)
        doubt = _disagreement(y, rolls, ratios, turns)
        rolls = np.where(np.isfinite(sensed) & ~(doubt < _CONTRADICTS * std), sensed, rolls)
    return Drive(
        y=y,
        u=mean(np.asarray, channels.opening),
        body=rolls,
        moving=np.asarray(moving > 0.5),
        dt=timeline.dt * width,
    )


def _disagreement(y: Array, rolls: Array, ratio: Array, turn: Array) -> Array:
    """Largest distance of the other wheels from the speed of the body that they give [m/s], shape (n, wheels)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        by_wheel, by_others = (y + turn) / ratio, (rolls + turn) / ratio
    far = np.abs(by_wheel[:, None, :] - by_others[:, :, None])
    wheels = np.arange(y.shape[1])
    far[:, wheels, wheels] = 0.0
    return np.asarray(far.max(axis=2))
