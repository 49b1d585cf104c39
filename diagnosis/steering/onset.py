"""Ends of a steering sensor's fault at the log's own rate: where a constant begins, where the angle jumps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.steering.blocks import SensorNoise
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

_JUMP = 6.0
_OFF, _FOLLOWING = 4.0, 10


def refined_valve(finding: Finding, off: Array, length: int) -> Finding:
    """Move a valve fault's ends, known to a block, to the samples in which its position leaves and meets its command.

    Parameters
    ----------
    finding : Finding
        With ends on blocks.
    off : Array, shape (n,)
        Position less command as multiples of its noise; see `diagnosis.steering.second_measurement.with_position`.
    length : int
        Samples per block.
    """
    if finding.side is not Side.ACTUATOR:
        return finding
    reach = 5 * length + 2
    start = _first_off(off, finding.start, reach)
    stop = off.size - _first_off(off[::-1], off.size - finding.stop, reach) if finding.stop < off.size else off.size
    return replace(finding, start=start, stop=stop) if start < stop else finding


def _first_off(off: Array, place: int, reach: int) -> int:
    """First sample near `place` that is off and is followed by more of them; `place` where there is none."""
    a, b = max(0, place - reach), min(off.size, place + reach)
    large = np.abs(np.nan_to_num(off[a : b + _FOLLOWING])) > _OFF
    ahead = np.convolve(np.abs(np.nan_to_num(off[a : b + _FOLLOWING])) > _OFF / 2, np.ones(_FOLLOWING), mode="full")
    lasting = ahead[_FOLLOWING - 1 :][: large.size] >= 0.6 * _FOLLOWING
    found = np.flatnonzero((large & lasting)[: b - a])
    return a + int(found[0]) if found.size else place


def refined(finding: Finding, y: Array, fresh: NDArray[np.bool_], noise: SensorNoise, length: int) -> Finding:
    """Move a sensor fault's ends, known to a block, to the samples that show them.

    Parameters
    ----------
    finding : Finding
        With ends on blocks.
    y : Array, shape (n,)
        Angle [rad].
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new sample.
    noise : SensorNoise
        Of the angle.
    length : int
        Samples per block.
    """
    if finding.side is not Side.SENSOR:
        return finding
    reach = 3 * length + 2
    if finding.mode in (FaultMode.STUCK, FaultMode.NO_SIGNAL):
        start, stop = _constant(finding, y, fresh, noise, reach)
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
