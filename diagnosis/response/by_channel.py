"""What a channel shows by its readings alone: wild ones, and none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.findings import SENSOR_SHARE, Wheel, sensor_finding
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon
from replay.faults import FaultMode

Flags = NDArray[np.bool_]

_SPIKE_GAP_S, _LEAST_SPIKES = 10.0, 3
_LOST_DRIVING_S = 1.0


def spikes_of(wheel: Wheel) -> list[Finding]:
    """Findings of wild readings that come again and again; none where those of the other wheels do, too."""
    if not wheel.spiky:
        return []
    places = wheel.samples.step[wheel.samples.wild]
    groups = np.split(places, np.flatnonzero(np.diff(places) * wheel.dt > _SPIKE_GAP_S) + 1) if places.size else []
    out = []
    for group in groups:
        if group.size < _LEAST_SPIKES:
            continue
        text = (
            f"Spikes: {group.size} readings of {wheel.name} within {(group[-1] - group[0]) * wheel.dt:.1f} s are far off those "
            "before and after them, and no machine moves like that."
        )
        out.append(sensor_finding(int(group[0]), int(group[-1]) + 1, FaultMode.NOISY, 0.97, None, None, (text,)))
    return out


def lost_of(wheel: Wheel, lost: Sequence[tuple[int, int]], driving: Flags) -> list[Finding]:
    """Findings of a channel from which nothing came while others were recorded, where the wheel had to move.

    Parameters
    ----------
    wheel : Wheel
        The wheel.
    lost : Sequence[tuple[int, int]]
        Steps [start, stop) in which nothing came.
    driving : Flags, shape (n,)
        Steps in which it moves, or is to.
    """
    out = []
    for first, last in lost:
        if np.count_nonzero(driving[first:last]) * wheel.dt < _LOST_DRIVING_S:
            continue
        text = f"Nothing came from {wheel.name} for {(last - first) * wheel.dt:.1f} s, while what is recorded with it went on."
        out.append(
            sensor_finding(first, last, FaultMode.NO_SIGNAL, SENSOR_SHARE, Epsilon(1.0, 1.0, 1.0), None, (text,))
        )
    return out
