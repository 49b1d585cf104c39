"""A speed channel that is a share of its own joint's position all through the mission, while the other wheels' are not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.inputs import FollowerData, cells
from diagnosis.response.models import BLOCK_S
from diagnosis.response.wheel import sensor_finding
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Epsilon
from replay.faults import FaultMode, State

Array = NDArray[np.float64]

_LEAST_BLOCKS = 80
_MOVES = 0.3  # of the usual speed
_SAME = 0.95, 1.05  # gain of a speed that is its position's slope
_OFF = 0.9, 1.1  # and of one that is not
_NEAR, _MOSTLY = 0.1, 0.8  # of the gain, and of the blocks that it explains so far
_ALIKE, _CLOSER = (
    0.12,
    3.0,
)  # by which what a position makes of its command may differ from the others (logarithm); times as far is the speed
_P = 0.95  # that the speed channel is wrong, set by hand


class Gain(NamedTuple):
    """A speed over the slope of its joint's position [1], and the half width of its 95 % bounds."""

    value: float
    bound: float


def scaled_channels(data: Mapping[str, FollowerData], dt: float) -> dict[str, Gain]:
    """Wheels whose speed is one share of their position's slope, where position and command belong together as in the others.

    Parameters
    ----------
    data : Mapping[str, FollowerData]
        All drives.
    dt : float
        Step [s].
    """
    width = max(1, round(BLOCK_S / dt))
    gains = {w: g for w, d in data.items() if (g := _gain(d, width)) is not None}
    sound = [w for w, g in gains.items() if _SAME[0] < g.value < _SAME[1]]
    answers = [a for w in sound if (a := _answer(data[w].y, data[w].asked)) > 0.0]
    if not answers:
        return {}
    out = {}
    for w, g in gains.items():
        d = data[w]
        if _OFF[0] < g.value < _OFF[1] or d.rolled is None:
            continue
        speed, position = _answer(d.y, d.asked), _answer(d.rolled, d.asked)
        if min(speed, position) <= 0.0:
            continue
        away = [min(abs(float(np.log(x / a))) for a in answers) for x in (position, speed)]
        if away[0] < _ALIKE and away[1] > _CLOSER * away[0]:
            out[w] = g
    return out


def without_gains(data: Mapping[str, FollowerData], gains: Mapping[str, Gain]) -> dict[str, FollowerData]:
    """All drives, with the speeds of scaled channels as their wheels turn: what is judged beside is judged by that."""
    return {w: replace(d, y=d.y / gains[w].value) if w in gains else d for w, d in data.items()}


def told_gain(sides: tuple[Assessment, Assessment], name: str, gain: Gain) -> tuple[Assessment, Assessment]:
    """Sensor and drive of a wheel, with what is known of its channel: it is faulty wherever it was judged.

    Parameters
    ----------
    sides : tuple[Assessment, Assessment]
        Of its true speed.
    name : str
        Of its channel.
    gain : Gain
        Of that.
    """
    sensor, drive = sides
    judged = sensor.states == CODE[State.HEALTHY]
    places = np.flatnonzero(judged)
    if not places.size:
        return sides
    found = _finding(int(places[0]), int(places[-1]) + 1, name, gain)
    states = np.where(judged, CODE[State(found.mode.value)], sensor.states).astype(np.int8)
    findings = tuple(sorted((*sensor.findings, found), key=lambda f: f.start))
    return replace(sensor, states=states, findings=findings), drive


def _finding(start: int, stop: int, name: str, gain: Gain) -> Finding:
    mode = FaultMode.INEFFICIENT if gain.value < 1.0 else FaultMode.OUTSIDE_TABLE
    loss = 1.0 - gain.value
    texts = (
        f"{name} is {gain.value:.2f} × the slope of its own joint's position all through the mission; those of the other wheels agree.",
        "Beside its command the position moves as the other wheels do, so that the position is right and the speed is not.",
    )
    epsilon = Epsilon(loss, loss - gain.bound, loss + gain.bound)
    return sensor_finding(start, stop, mode, _P, epsilon, None, texts)


def _gain(data: FollowerData, width: int) -> Gain | None:
    """Speed over the position's slope; None where one number does not say it, or the wheel hardly moves."""
    if data.rolled is None:
        return None
    y, x = cells(data.y, width), cells(data.rolled, width)
    use = np.isfinite(y) & np.isfinite(x)
    if not use.any():
        return None
    moving = use & (np.abs(x) > _MOVES * float(np.quantile(np.abs(x[use]), 0.9)))
    if np.count_nonzero(moving) < _LEAST_BLOCKS:
        return None
    ratio = y[moving] / x[moving]
    value = float(np.median(ratio))
    off = np.abs(ratio - value)
    if value <= 0.1 or np.mean(off < _NEAR * value) < _MOSTLY:
        return None
    return Gain(value, max(0.01 * value, 3.0 * float(np.median(off)) / float(np.sqrt(ratio.size))))


def _answer(y: Array, asked: Array) -> float:
    """What a wheel makes of its command [1], 0 where that is not known."""
    known = np.isfinite(y) & np.isfinite(asked)
    power = float(asked[known] @ asked[known])
    return float(y[known] @ asked[known]) / power if power > 0.0 else 0.0
