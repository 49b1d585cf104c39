"""Ends of a steering fault at the log's own rate: where a constant begins, the angle jumps, the valve leaves its command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.steering.blocks import SensorNoise
from diagnosis.steering.inputs import AxleInputs
from replay.faults import Side

Array = NDArray[np.float64]

_JUMP = 6.0
_DEVIATION, _FOLLOWING = 4.0, 10


def refined_valve(finding: Finding, deviation: Array | None, length: int) -> Finding:
    """Move a valve fault's ends, known to a block, to the samples in which its position leaves and meets its command.

    Where it goes with its command for a while, the fault begins with the first sample in which it does not.

    Parameters
    ----------
    finding : Finding
        With ends on blocks.
    deviation : Array, shape (n,), or None
        Position less command as multiples of its noise; see `diagnosis.steering.redundancy.with_valve_opening`.
    length : int
        Samples per block.
    """
    if deviation is None or finding.side is not Side.ACTUATOR:
        return finding
    reach = 5 * length + 2
    start, size = _first_deviation(deviation, finding.start, reach), deviation.size
    if start == finding.start:  # a valve at rest that is told to rest: what it does shows from its next command on
        start += _first_deviation(deviation[start : finding.stop], 0, finding.stop - start)
    stop = size - _first_deviation(deviation[::-1], size - finding.stop, reach) if finding.stop < size else size
    return replace(finding, start=start, stop=stop) if start < stop else finding


def _first_deviation(deviation: Array, place: int, reach: int) -> int:
    """First sample near `place` that deviates and is followed by more of them; `place` where there is none."""
    a, b = max(0, place - reach), min(deviation.size, place + reach)
    size = np.abs(np.nan_to_num(deviation[a : b + _FOLLOWING]))
    large = size > _DEVIATION
    ahead = np.convolve(size > _DEVIATION / 2, np.ones(_FOLLOWING), mode="full")
    lasting = ahead[_FOLLOWING - 1 :][: large.size] >= 0.6 * _FOLLOWING
    found = np.flatnonzero((large & lasting)[: b - a])
    return a + int(found[0]) if found.size else place


def refined_sensor(finding: Finding, inputs: AxleInputs, length: int) -> Finding:
    """Move a sensor fault's ends, known to a block, to the samples that show them.

    Parameters
    ----------
    finding : Finding
        With ends on blocks.
    inputs : AxleInputs
        The axle's channels.
    length : int
        Samples per block.
    """
    if finding.side is not Side.SENSOR:
        return finding
    y, noise = inputs.angle, inputs.noise
    reach = 3 * length + 2
    if finding.mode.total:
        start, stop = _constant(finding, y, inputs.fresh, noise, reach)
    else:
        start = _jump(finding.start, y, noise, reach, first=True)
        stop = finding.stop if finding.stop >= y.size else _jump(finding.stop, y, noise, reach, first=False)
    return replace(finding, start=start, stop=stop) if start < stop else finding


def _constant(finding: Finding, y: Array, fresh: NDArray[np.bool_], noise: SensorNoise, reach: int) -> tuple[int, int]:
    """Longest run of one value, or of silence, around the middle of the fault, near its ends."""
    a, b = max(0, finding.start - reach), min(y.size, finding.stop + reach)
    part = y[a:b]
    known = np.isfinite(part)
    inner = part[reach : part.size - reach]
    inner = inner[np.isfinite(inner)]
    if not inner.size:
        same = ~known
    else:
        level = float(np.median(inner))
        same = np.abs(np.where(known, part, level) - level) <= max(noise.lsb / 4, 1e-3 * noise.std)
    middle = part.size // 2
    before, after = np.flatnonzero(~same[:middle]), np.flatnonzero(~same[middle:])
    start = a + (int(before[-1]) + 1 if before.size else 0)
    stop = a + middle + (int(after[0]) if after.size else part.size - middle)
    if start > finding.start + reach or stop < finding.stop - reach:
        return finding.start, finding.stop  # single other values within: keep the blocks' ends
    fresh_start = np.flatnonzero(fresh[start:stop])
    return (start + int(fresh_start[0]) if fresh_start.size and inner.size else start), stop


def _jump(place: int, y: Array, noise: SensorNoise, reach: int, *, first: bool) -> int:
    """First or last sample near `place` that jumps by more than the noise; `place` where none does."""
    a, b = max(1, place - reach), min(y.size, place + reach)
    steps = np.abs(y[a:b] - y[a - 1 : b - 1])
    if not steps.size or not np.isfinite(steps).any():
        return place
    limit = _JUMP * max(np.sqrt(2 * noise.white), noise.lsb)
    found = np.flatnonzero(steps > limit)
    if not found.size:
        return place
    return a + int(found[0] if first else found[-1])
