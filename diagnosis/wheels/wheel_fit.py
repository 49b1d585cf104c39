"""Wheel models of the machine file, or identified in the mission."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.wheel_model import WheelModelFit
from diagnosis.wheels.blocks import block_width
from diagnosis.wheels.body import MeasuredBody, rolling_speeds
from diagnosis.wheels.identification import identified, identify
from diagnosis.wheels.motion import Motion, body_speeds
from diagnosis.wheels.plant_windows import Drive
from diagnosis.wheels.wheel_channels import WheelChannels
from replay.arrays.blocks import block_means, release
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
    motion: Motion,
    body: MeasuredBody | None = None,
) -> WheelModelFit | None:
    """Wheel models of the machine file, or identified in this mission; None where nothing allows it.

    Parameters
    ----------
    channels, replay, timeline, machine
        The mission.
    motion : Motion
        How wheels and body move together, by the best estimate of the axles' angles.
    body : MeasuredBody or None
        The body by its own sensors.
    """
    if not (any_finite(channels.opening).any() and any_finite(channels.speed).any()):
        return None
    given = {i: p for i, w in enumerate(machine.wheels) if (p := machine.plant.wheels.get(w)) is not None}
    if len(given) < len(machine.driven):
        found = identified(wheel_drive(channels, replay, timeline, machine, motion, body), machine, given)
        if found is not None:
            return found
    width = min(block_width(timeline.dt), timeline.size)
    means = partial(_means, timeline, width)
    moving = _driving(channels, replay, timeline, width, machine.limits.driving_speed)
    return identify(
        means(np.asarray, channels.speed),
        means(np.asarray, channels.opening),
        moving,
        timeline.dt * width,
        given,
        machine.plant.flow,
        means(lambda u: np.abs(without_nan(u)), channels.opening),
    )


def wheel_drive(
    channels: WheelChannels,
    replay: Replay,
    timeline: Timeline,
    machine: Machine,
    motion: Motion,
    body: MeasuredBody | None = None,
) -> Drive:
    """Block means of all wheels for `diagnosis.wheels.plant_identification`; parameters as in `wheel_fit`."""
    width = min(block_width(timeline.dt), timeline.size)
    means = partial(_means, timeline, width)
    moving = _driving(channels, replay, timeline, width, machine.limits.driving_speed)
    y = means(np.asarray, channels.speed)
    ratios, turns = means(np.asarray, motion.ratio), means(np.asarray, motion.turn)
    rolls = body_speeds(y, ratios, turns)
    if body is not None and body.body.known:
        sensed, std = rolling_speeds(body, ratios, turns)
        doubt = _disagreement(y, rolls, ratios, turns)
        rolls = np.where(np.isfinite(sensed) & ~(doubt < _CONTRADICTS * std), sensed, rolls)
    return Drive(
        y=y,
        u=means(np.asarray, channels.opening),
        body=rolls,
        moving=moving,
        dt=timeline.dt * width,
    )


def _means(timeline: Timeline, width: int, function: Callable[..., NDArray[Any]], *columns: NDArray[Any]) -> Array:
    """Means of a function of columns over whole blocks of `width` rows, shape (n, wheels); a last, cut block is left out."""
    out = []
    for part in timeline.store.blocks(timeline.size // width * width, width):
        out.append(block_means(function(*(c[part] for c in columns)), width))
        release(*columns)
    return np.concatenate(out)


def _driving(
    channels: WheelChannels, replay: Replay, timeline: Timeline, width: int, limit: float
) -> NDArray[np.bool_]:
    """Blocks of `width` samples in most of which a wheel drives faster than `limit` [m/s], shape (n, wheels)."""

    def fast(reference: Array, speed: Array) -> NDArray[np.bool_]:
        return np.asarray(np.abs(np.where(np.isfinite(reference), reference, speed)) > limit)

    return np.asarray(_means(timeline, width, fast, replay.v_ref, channels.speed) > 0.5)


def _disagreement(y: Array, rolls: Array, ratio: Array, turn: Array) -> Array:
    """Largest distance of the other wheels from the speed of the body that they give [m/s], shape (n, wheels)."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        by_wheel, by_others = (y + turn) / ratio, (rolls + turn) / ratio
    far = np.abs(by_wheel[:, None, :] - by_others[:, :, None])
    wheels = np.arange(y.shape[1])
    far[:, wheels, wheels] = 0.0
    return np.asarray(far.max(axis=2))
