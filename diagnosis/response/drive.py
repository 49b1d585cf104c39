"""Drives that do something else than their commands while another view of the wheel shows that its sensor is right."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.inputs import cells
from diagnosis.response.machine import Judged
from diagnosis.response.models import Beside, Blocks
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_FAR, _FAR_OF_TOP = 3.0, 0.25  # usual misfits beside the command, and share of the top speed, that are no answer to it
_AGREES = 2.5  # usual misfits beside the other view
_CLOSER = (
    0.5  # of the misfit beside the command: so much less is that beside the other view, and that of the other wheels
)
_GAP_S, _LEAST_S, _LONG_S = 0.75, 2.0, 4.0
_P = 0.9, 0.95  # that the drive is at fault, from the least time on, and for long
_STANDS, _FULL = 0.1, 0.9  # of what the command makes it do
_ANSWER_S = 1.0  # within which a drive answers
_STEADY = 0.25  # spread of a speed that does not follow its command, by its size


def unanswered(wheel: str, judged: Mapping[str, Judged], views: Mapping[str, Beside], block_s: float) -> list[Finding]:
    """Times in which a drive did not answer its command, by a sensor that another view confirms.

    Only a view of this very wheel will do: a wheel of the same side is pulled along by the ground, and skids.

    Parameters
    ----------
    wheel : str
        The wheel.
    judged : Mapping[str, Judged]
        All wheels.
    views : Mapping[str, Beside]
        Other views of their speeds.
    block_s : float
        Length of a block [s].
    """
    one, view = judged[wheel], views.get(wheel)
    if view is None or not view.own or not one.response.answered:
        return []
    blocks = one.wheel.blocks
    off = np.nan_to_num(_off(blocks))
    others = [np.nan_to_num(_off(j.wheel.blocks)) for w, j in judged.items() if w != wheel]
    beside = np.nan_to_num(np.abs(blocks.mean - view.speed), nan=np.inf)
    there = off > np.maximum(_FAR * blocks.noise, _FAR_OF_TOP * float(np.nanquantile(np.abs(blocks.mean), 0.95)))
    there &= (beside < _AGREES * np.nan_to_num(view.noise)) & (beside < _CLOSER * off)
    there &= np.logical_and.reduce([x < _CLOSER * off for x in others]) if others else True
    there &= _off_asked(one, block_s) > _CLOSER * off
    found = []
    for start, stop in _spans(there, round(_GAP_S / block_s)):
        if (stop - start) * block_s >= _LEAST_S and np.mean(there[start:stop]) > 0.5:
            found.append(_finding(one, view, start, stop, block_s))
    return found


def _off(blocks: Blocks) -> Array:
    return np.abs(blocks.mean - np.clip(blocks.mean, blocks.low, blocks.high))


def _off_asked(one: Judged, block_s: float) -> Array:
    """How far each block is from what is asked of the wheel [m/s], whatever the drive makes of it in most of the mission."""
    blocks = one.wheel.blocks
    asked = cells(one.data.asked, int(blocks.start[1]) if blocks.start.size > 1 else 1)
    back = round(_ANSWER_S / block_s)
    recent = [np.r_[np.full(k, np.nan), asked[: asked.size - k]] for k in range(back + 1)]
    low, high = (pick.reduce(recent) for pick in (np.fmin, np.fmax))
    return np.nan_to_num(np.abs(blocks.mean - np.clip(blocks.mean, low, high)), nan=np.inf)


def _spans(there: Flags, gap: int) -> list[tuple[int, int]]:
    edge = np.flatnonzero(np.diff(np.r_[False, there, False].astype(np.int8)))
    out: list[tuple[int, int]] = []
    for a, b in zip(edge[::2].tolist(), edge[1::2].tolist(), strict=True):
        if out and a - out[-1][1] <= gap:
            out[-1] = out[-1][0], b
        else:
            out.append((a, b))
    return out


def _finding(one: Judged, view: Beside, start: int, stop: int, block_s: float) -> Finding:
    blocks, part = one.wheel.blocks, slice(start, stop)
    width = int(blocks.start[1]) if blocks.start.size > 1 else 1
    y, asked = np.nan_to_num(blocks.mean[part]), 0.5 * (blocks.low[part] + blocks.high[part])
    power = float(asked @ asked)
    gain = float(y @ asked) / power if power > 0.0 else np.inf
    size = float(np.median(np.abs(y)))
    steady = float(np.std(y)) < _STEADY * size
    mode = (
        FaultMode.NO_SIGNAL if abs(gain) < _STANDS and size < _STANDS * float(np.max(np.abs(asked)))
        else FaultMode.INEFFICIENT if _STANDS <= gain < _FULL and not (steady and np.ptp(asked) > size)
        else FaultMode.STUCK if steady else FaultMode.OUTSIDE_TABLE
    )  # fmt: skip
    epsilon = {
        FaultMode.INEFFICIENT: Epsilon(1.0 - gain, max(0.9 - gain, 0.0), min(1.1 - gain, 1.0)),
        FaultMode.NO_SIGNAL: Epsilon(1.0, 1.0, 1.0),
        FaultMode.STUCK: Epsilon(1.0, 1.0, 1.0),
    }.get(mode)
    p = _P[(stop - start) * block_s >= _LONG_S]
    texts = (
        f"{one.data.name} is {size:.2g} {{speed_unit}} (median) for {(stop - start) * block_s:.1f} s, where its command makes it "
        f"{float(np.median(np.abs(asked))):.2g} {{speed_unit}} otherwise.",
        f"{view.compared} and the measured motion of the body show the same speed as the sensor, so that the sensor is right and the "
        "{valve} does not do what it is told.",
    )
    rest = Hypothesis(Side.SENSOR.value, mode.value, 0.5 * (1.0 - p))
    return Finding(
        start=start * width, stop=min(stop * width, one.data.y.size), side=Side.ACTUATOR, mode=mode, probability=p,
        hypotheses=(Hypothesis(Side.ACTUATOR.value, mode.value, p), rest, Hypothesis("none", State.HEALTHY.value, 0.5 * (1.0 - p))),
        epsilon=epsilon, sat=None, evidence=texts, tier=Tier.RESPONSE,
    )  # fmt: skip
