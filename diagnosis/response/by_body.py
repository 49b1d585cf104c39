"""A lone drive of which no answer to a command is found, beside sensors of the body: odometry, its positions, a satellite receiver.

What most of the mission shows of the two is how they belong together. A speed that is a share of that, or nothing, from one moment to
the next is a sensor's; what comes slowly is slip. Nothing is healthy for it: an encoder may be wrong in both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.body import BodySpeed, View, view_of
from diagnosis.response.inputs import FollowerData, cells
from diagnosis.response.models import BLOCK_S
from diagnosis.response.spells import deviations_of
from diagnosis.response.wheel import SENSOR_SHARE, sensor_finding
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon
from diagnosis.results.sentence import About, Sentence, lasting
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_MOVES = 0.3  # of the usual speed
_OFF, _SHARE = 4.0, 0.25  # usual misfits, and of the speed: less is no deviation
_GAP_BLOCKS, _LEAST_S = 2, 3.0  # sound blocks in a deviation; its length
_NOTHING, _LIKE = (
    0.05,
    0.35,
)  # share of the speed that is nothing; of a deviation: what one share of the speed leaves of it
_SUDDEN, _CALM = (
    0.5,
    0.25,
)  # of a deviation, which an end of it makes; of the speed, by which the other one changes then
_AROUND = 2  # blocks to each side of an end, of which it takes the first
_P = 0.85, 0.94  # that the speed is wrong, by one end that comes at once and by both


def beside_the_body(data: FollowerData, speeds: Sequence[BodySpeed], dt: float) -> tuple[Finding, ...]:
    """Times in which a speed is nothing, or a share, of what a sensor of the body makes likely.

    Parameters
    ----------
    data : FollowerData
        The only drive.
    speeds : Sequence[BodySpeed]
        The body's speed by its own sensors, in blocks of `BLOCK_S`.
    dt : float
        Step [s].
    """
    width = max(1, round(BLOCK_S / dt))
    y = cells(data.y, width)
    view = view_of(y, speeds, {"": y}, None, width * dt, None if data.stretch is None else cells(data.stretch, width))
    if view is None:
        return ()
    x, off = view.speed, np.abs(y - view.speed)
    known = np.isfinite(off)
    usual = float(np.quantile(np.abs(x[known]), 0.9))
    moves = known & (np.abs(x) > _MOVES * usual)
    change = np.abs(np.gradient(np.where(np.isfinite(x), x, 0.0)))
    noise = float(np.median(off[moves])) * np.sqrt(view.reach) + change
    found = (
        _finding(data, view, y, span, dt)
        for span in deviations_of(moves & (off > np.maximum(_OFF * noise, _SHARE * np.abs(x))), moves, _GAP_BLOCKS)
    )
    return tuple(f for f in found if f is not None)


def _finding(data: FollowerData, view: View, y: Array, span: tuple[int, int], dt: float) -> Finding | None:
    """What a speed is in a deviation; None where it is no share of what the body does, or came slowly."""
    start, stop = span
    width = max(1, round(BLOCK_S / dt))
    if (stop - start) * width * dt < _LEAST_S:
        return None
    part = slice(start, stop)
    known = np.isfinite(y[part]) & np.isfinite(view.speed[part])
    own, made = y[part][known], view.speed[part][known]
    gain = float(own @ made) / float(made @ made)
    left = float(np.sqrt(np.mean((own - gain * made) ** 2) / np.mean(made**2)))
    ends = sum(_sudden(y, view.speed, at, abs(1.0 - gain)) for at in span)
    if gain < -_NOTHING or abs(1.0 - gain) < _SHARE or left > _LIKE * abs(1.0 - gain) or not ends:
        return None
    nothing = abs(gain) < _NOTHING
    mode = FaultMode.NO_SIGNAL if nothing else FaultMode.INEFFICIENT if gain < 1.0 else FaultMode.OUTSIDE_TABLE
    loss = 1.0 if nothing else 1.0 - gain
    text = (
        f"{data.name} reads {'nothing' if nothing else f'{gain:.2f} × that'} of what {view.name} shows for {lasting((stop - start) * width * dt, 1)}, "
        f"{'both ends of which come' if ends > 1 else 'one end of which comes'} at once; in most of the mission the two agree."
    )
    size = Epsilon(loss, loss, loss) if gain < 1.0 else None
    end = min(stop * width, data.y.size)
    return sensor_finding(
        start * width, end, mode, _P[ends - 1], size, None, (Sentence(About.ONSET, text),), SENSOR_SHARE
    )


def _sudden(y: Array, x: Array, at: int, share: float) -> bool:
    """Whether an end of a deviation is a jump of the speed while the body goes on as before."""
    first, last = at - _AROUND, at + _AROUND - 1
    if first < 0 or last >= y.size or not np.isfinite(np.r_[y[[first, last]], x[[first, last]]]).all():
        return False
    size = 0.5 * abs(x[first] + x[last])
    jump = abs((y[last] - y[first]) - (x[last] - x[first]))
    return bool(jump > _SUDDEN * share * size and abs(x[last] - x[first]) < _CALM * size)
