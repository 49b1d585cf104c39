"""What the gyro reads while the machine stands: an offset, which no comparison with the wheels needs, and a heading adds up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.sizes import turn
from replay.arrays.blocks import release
from replay.arrays.runs import runs_of
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_CELL_S, _AROUND = 0.5, 1  # cells at the ends of a rest, in which it may sway
_STANDS = 0.02  # of the largest speed
_REST_S = 1.0  # of one rest
_LEAST, _ERRORS = 0.02, 4.0  # rad/s that are told: a gyro that was calibrated at rest has a tenth; and by its own noise
_SWAYS = 0.05  # rad/s, of its means: more is a machine that is moved


def offset_at_rest(timeline: Timeline, machine: Machine) -> str:
    """A sentence on what the gyro reads while all wheels stand; empty where that is next to nothing, or not known.

    Parameters
    ----------
    timeline : Timeline
        The aligned mission.
    machine : Machine
        Its wheels and largest speed.
    """
    speeds = [n for w in machine.wheels if (n := f"wheel.{w}.v") in timeline.signals]
    if "imu.yaw_rate" not in timeline.signals or not speeds:
        return ""
    asked = [n for n in ("cmd.v", "cmd.omega", *(f"wheel.{w}.v_ref" for w in machine.wheels)) if n in timeline.signals]
    moves, rate = _cells(timeline, (*speeds, *asked), _STANDS * machine.max_speed)
    rests = []
    for start, stop in runs_of(~moves):
        part = rate[start + _AROUND : stop - _AROUND]
        part = part[np.isfinite(part)]
        if part.size * _CELL_S >= _REST_S and np.std(part) < _SWAYS:
            error = float(np.std(part)) / np.sqrt(part.size)
            rests.append((float(np.mean(part)), error))
    told = [m for m, e in rests if abs(m) > max(_LEAST, _ERRORS * e)]
    if not told:
        return ""
    largest = max(told, key=abs)
    often = "whenever the machine stands" if len(told) == len(rests) > 1 else "while the machine stands"
    if len(told) < len(rests):
        often = f"in {len(told)} of {len(rests)} stops of the machine"
    return (
        f"The gyro (imu.yaw_rate) reads up to {turn(largest, sign='+')} {often}: an offset, by which a heading goes wrong. "
        "Calibrate it at rest. Where speeds are held against it a constant one is taken out."
    )


def _cells(timeline: Timeline, names: tuple[str, ...], least: float) -> tuple[NDArray[np.bool_], Array]:
    """Cells in which anything moves, is asked to, or is not known, and the mean yaw rate of each [rad/s], each of shape (cells,)."""
    width = max(1, round(_CELL_S / timeline.dt))
    moves, rate = [], []
    for cut in timeline.blocks(width):
        largest = np.zeros(cut.stop - cut.start)
        known = np.zeros(largest.size, np.bool_)
        for name in names:
            values = np.asarray(timeline.signals[name][cut])
            largest = np.fmax(largest, np.abs(values))
            if name.endswith(".v") and name != "cmd.v":
                known |= np.isfinite(values)
            release(timeline.signals[name])
        moves.append(_grouped(np.where(known, largest, np.inf), width, np.inf).max(axis=1) > least)
        group = _grouped(np.asarray(timeline.signals["imu.yaw_rate"][cut]), width, np.nan)
        count = np.isfinite(group).sum(axis=1)
        rate.append(np.where(count > 0, np.nansum(group, axis=1) / np.maximum(count, 1), np.nan))
    return np.concatenate(moves), np.concatenate(rate)


def _grouped(x: Array, width: int, fill: float) -> Array:
    """Rows of `width` samples; the last one is filled up."""
    return np.pad(x, (0, -x.size % width), constant_values=fill).reshape(-1, width)
