"""A lone speed that is a share of itself from one reading to the next, and back again: a sensor's gain changes so, no drive's speed does."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.channel import Samples
from diagnosis.response.inputs import FollowerData
from diagnosis.response.wheel import SENSOR_SHARE, sensor_finding
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon
from replay.faults import FaultMode

Array = NDArray[np.float64]

_LEAST, _LEVEL = 100, 5  # readings of a moving drive; readings to each side of a jump
_HARDER, _USUAL = 3.0, 0.99  # times what readings change by (this quantile of them)
_OTHERS = 3  # largest change of which it is three times without a command that rests
_WITHIN = 0.25  # of a jump, by which the readings next to it differ from their levels
_SHARES = (0.15, 0.75), (1.35, 6.0)
_BACK = 0.2  # by which the product of both jumps may differ from 1
_RESTS, _RESTS_S = 0.1, 1.0  # change of the command, by its size, around a jump
_LEAST_S = 1.0
_P = 0.8, 0.9  # that it is a share, without a command and with one that rests


def shares_at_once(data: FollowerData, samples: Samples, driving_speed: float, dt: float) -> list[Finding]:
    """Times between two jumps of a speed, of which the second one takes back the first.

    Parameters
    ----------
    data : FollowerData
        The drive.
    samples : Samples
        Its readings.
    driving_speed : float
        Speed from which a drive is driving [m/s].
    dt : float
        Step [s].
    """
    good = np.isfinite(samples.value)
    value, step = samples.value[good], samples.step[good]
    if np.count_nonzero(np.abs(value) > driving_speed) < _LEAST:
        return []
    size = np.abs(np.diff(value, prepend=value[0]))
    usual = float(np.quantile(size[size > 0.0], _USUAL)) if (size > 0.0).any() else 0.0
    hardest = np.sort(size)[::-1]
    places = np.flatnonzero(size > driving_speed)
    ratios = {int(k): r for k in places if (r := _ratio(value, int(k))) is not None}
    out: list[Finding] = []
    ends = sorted(ratios)
    for a, b in pairwise(ends):
        if out and int(step[a]) < out[-1].stop:
            continue
        gain = ratios[a]
        rests = all(_rests(data.asked, int(step[k]), dt) for k in (a, b))
        known = np.isfinite(data.asked).any()
        least = _HARDER * (usual if rests else float(hardest[min(2 + _OTHERS - 1, hardest.size - 1)]))
        if (known and not rests) or min(size[a], size[b]) < least:
            continue
        if abs(gain * ratios[b] - 1.0) > _BACK or (step[b] - step[a]) * dt < _LEAST_S:
            continue
        if not any(low < gain < high for low, high in _SHARES):
            continue
        out.append(_finding(data, (int(step[a]), int(step[b])), gain, rests, dt))
    return out


def _ratio(value: Array, k: int) -> float | None:
    """Level after a jump by that before it [1]; None where it is no clean step from one level to another of the same sign."""
    if k < _LEVEL or k + _LEVEL > value.size:
        return None
    before, after = float(np.median(value[k - _LEVEL : k])), float(np.median(value[k : k + _LEVEL]))
    jump = abs(after - before)
    if before * after <= 0.0 or max(abs(value[k - 1] - before), abs(value[k] - after)) > _WITHIN * jump:
        return None
    return after / before


def _rests(asked: Array, at: int, dt: float) -> bool:
    """Whether a command is known and hardly changes around a step. `asked` of shape (n,) [m/s], `dt` in s."""
    reach = round(_RESTS_S / dt)
    around = asked[max(0, at - reach) : at + reach]
    return bool(np.isfinite(around).all() and np.ptp(around) <= _RESTS * float(np.max(np.abs(around))))


def _finding(data: FollowerData, span: tuple[int, int], gain: float, rests: bool, dt: float) -> Finding:
    text = (
        f"{data.name} was {gain:.2f} × what it was from one reading to the next, and back again {(span[1] - span[0]) * dt:.1f} s later in the same "
        f"way{', while its command rested' if rests else ''}: no drive changes its speed so, nor twice by one factor."
    )
    loss = 1.0 - gain
    mode = FaultMode.INEFFICIENT if gain < 1.0 else FaultMode.OUTSIDE_TABLE
    return sensor_finding(
        *span, mode, _P[rests], Epsilon(loss, loss - _BACK / 2, loss + _BACK / 2), None, (text,), SENSOR_SHARE
    )
