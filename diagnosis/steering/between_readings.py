"""Openings that lie between what their command was one reading before and after: a command that jumps between two readings has no noisy valve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.steering.inputs import AxleInputs
from replay.arrays.sliding import largest_within, smallest_within
from replay.faults import FaultMode

_LEAVES, _FEW = 0.2, 10  # of the deviation's root mean square; samples


def between_readings(f: Finding, inputs: AxleInputs) -> bool:
    """Whether a valve that is said to be noisy merely opens between two readings of its command, which come seldom.

    Parameters
    ----------
    f : Finding
        Of the valve.
    inputs : AxleInputs
        The axle's channels, command and opening among them.
    """
    if f.mode is not FaultMode.NOISY or not inputs.valve_redundant:
        return False
    every = np.flatnonzero(inputs.timeline.fresh[inputs.channel("u")])
    opened = np.flatnonzero(inputs.timeline.fresh[inputs.channel("u_applied")])
    apart = int(np.median(np.diff(every))) if every.size > 1 else 1
    if opened.size < every.size:  # the opening comes as seldom: nothing lies between
        return False
    part = slice(max(0, f.start - apart), f.stop + apart)
    u, opening = inputs.values("u")[part], inputs.values("u_applied")[part]
    known = np.isfinite(u) & np.isfinite(opening)
    if np.count_nonzero(known) < _FEW:
        return False
    low, high = (_extreme(u, apart, highest=highest) for highest in (False, True))
    beyond = np.maximum(low - opening, 0.0) + np.maximum(opening - high, 0.0)
    return _rms(beyond[known]) < _LEAVES * _rms((opening - u)[known])


def _extreme(x: NDArray[np.float64], reach: int, *, highest: bool) -> NDArray[np.float64]:
    filled = np.where(np.isfinite(x), x, -np.inf if highest else np.inf)
    return (largest_within if highest else smallest_within)(filled, reach, reach)


def _rms(x: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(x * x)))
