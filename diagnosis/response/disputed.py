"""A drive keeps to its command, but other channels show another speed: one of them is wrong, or tyres slip, and nothing says which."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.results.assessment import CODE, Assessment, Reason
from replay.faults import State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

HIDES = "the speed varies so much beside what its command, or other channels, make likely that half of it would not show for ten seconds"
DISPUTED = (
    "it keeps to its command, but other channels show another speed: one of them is wrong, or tyres slip, and a loop around a wrong encoder "
    "looks like that, too"
)
_MISFITS, _SHARE = 3.0, 0.2  # usual misfits, and share of the speed, from which on two speeds are two
_NOBODY = 0.3  # of a misfit
_AROUND_S, _MOSTLY = 2.0, 0.5  # over which, and in how much of that


def disputed(one: Judged, block_s: float) -> Flags:
    """Blocks in which a drive reads another speed than the channels beside it, for which nobody is to blame, shape (b,): it is not healthy there.

    For the only drive these are sensors of the body, for others the other wheels. A loop around a wrong encoder holds the reading at its command, so that the command does not tell which of the two is right.

    Parameters
    ----------
    one : Judged
        The wheel.
    block_s : float
        Length of a block [s].
    """
    y = one.wheel.blocks.mean
    if one.view is None or (one.view.nobody is None and not one.alone):
        return np.zeros(y.size, np.bool_)
    apart = np.nan_to_num(np.abs(y - one.view.speed))
    larger = np.maximum(np.abs(np.nan_to_num(y)), np.abs(np.nan_to_num(one.view.speed)))
    off = (apart > _MISFITS * np.nan_to_num(one.view.noise, nan=np.inf)) & (apart > _SHARE * larger)
    if one.view.nobody is not None:
        off &= one.view.nobody > _NOBODY
    width = max(1, round(_AROUND_S / block_s))
    return np.asarray(np.convolve(off, np.ones(width) / width, mode="same") > _MOSTLY)


def doubted(sensor: Assessment, where: Sequence[slice | Flags], why: Reason | None = None) -> Assessment:
    """A sensor of which nothing healthy can be said in some steps, and why, where that is another reason than before.

    Parameters
    ----------
    sensor : Assessment
        The sensor.
    where : Sequence[slice | Flags], each of shape (n,)
        The steps.
    why : Reason or None
        The reason; None: that of before.
    """
    states = sensor.states.copy()
    for part in where:
        states[part] = np.where(states[part] == CODE[State.HEALTHY], CODE[State.NOT_ASSESSED], states[part])
    doubted = replace(sensor, states=states)
    return doubted if why is None else doubted.reasoned(State.NOT_ASSESSED, why)


def disputed_steps(judged: Mapping[str, Judged], block_s: float) -> dict[str, Flags]:
    """Steps in which a wheel's speed is disputed, shape (n,), of wheels that have any; `block_s` is the length of a block [s]."""
    out = {}
    for w, j in judged.items():
        width = int(j.wheel.blocks.start[1]) if j.wheel.blocks.start.size > 1 else 1
        where = np.repeat(disputed(j, block_s), width)[: j.data.y.size]
        if where.any():
            out[w] = where
    return out


def unproved(sensor: Assessment, where: Flags, hides: str) -> Assessment:
    """A sensor of which nothing healthy is said in some steps, for a reason: a gross fault would not have shown, or a rival says otherwise.

    Parameters
    ----------
    sensor : Assessment
        The sensor.
    where : Flags, shape (n,)
        The steps.
    hides : str
        The reason, in words that may go on behind "or".
    """
    if not (where & (sensor.states == CODE[State.HEALTHY])).any():
        return sensor
    known = bool((sensor.states == CODE[State.NOT_ASSESSED]).any())
    more = f"{sensor.reasons.get(State.NOT_ASSESSED, hides)}; or {hides}"
    why = Reason(more, sensor.lacks.get(State.NOT_ASSESSED)) if known else Reason(hides)
    return doubted(sensor, [where], why)
