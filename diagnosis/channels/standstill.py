"""Times in which a machine as a whole did not follow: every drive stood still while the commands went on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.evidence import MissionView
from replay.arrays.numeric import without_nan
from replay.arrays.quantiles import median_of, quantile_known
from replay.arrays.runs import runs_of

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Span = tuple[int, int]

_LEAST_S = 2.0  # longer than drives take to answer
STILL = 0.2  # of the driving speed
_ASKED = 2.0  # driving speeds
_TAIL_S = 3.0  # a command that has just begun proves nothing
_LEAST_SAMPLES, _ERRORS = 20, 4.0  # samples that show a noise; standard errors of a mean
_NORMAL = 0.6745  # median of the size of a normal variable, by its standard deviation
_NOISE, _OF_ASKED = (
    4.5,
    0.08,
)  # times the noise of a sample, and share of what is asked: no more than either is standstill


def together_idle(mission: MissionView) -> Flags:
    """Steps in which the machine as a whole did not follow, shape (n,); see `not_followed`."""
    out = np.zeros(mission.timeline.size, np.bool_)
    names = [f"wheel.{w}.v" for w in mission.machine.wheels]
    commands = [mission.command(w) for w in mission.machine.wheels]
    readings = [mission.values(n) for n in names]
    least = mission.machine.limits.driving_speed
    speeds = [
        without_noise(mission.values(n), mission.timeline.fresh[n], c, least)
        if mission.logged(n)
        else mission.values(n)
        for n, y, c in zip(names, readings, commands, strict=True)
    ]
    mission.timeline.store.release()
    for start, stop in not_followed(speeds, commands, least, mission.timeline.dt, readings):
        out[start:stop] = True
    return out


def without_noise(y: Array, fresh: Flags, asked: Array, driving_speed: float) -> Array:
    """Readings by which a wheel is seen to stand, shape (n,) [m/s]: where their noise alone is more than standstill, so much smaller.

    Parameters
    ----------
    y : Array, shape (n,)
        Measured speed [m/s]; NaN where not known.
    fresh : Flags, shape (n,)
        Steps with a new sample.
    asked : Array, shape (n,)
        Commanded speed [m/s].
    driving_speed : float
        Commanded speed from which a drive is driving [m/s].
    """
    value = y[fresh & np.isfinite(y)]
    if value.size < _LEAST_SAMPLES or not np.isfinite(asked).any():
        return y
    noise = float(median_of(np.abs(np.diff(value, 2)))) / (np.sqrt(6.0) * _NORMAL)
    most = min(_NOISE * noise, _OF_ASKED * float(quantile_known(np.abs(asked), 0.9)))
    return y * min(1.0, STILL * driving_speed / most) if most > 0.0 else y


def not_followed(
    speeds: Sequence[Array],
    commands: Sequence[Array],
    driving_speed: float,
    dt: float,
    readings: Sequence[Array] | None = None,
) -> list[Span]:
    """Steps [start, stop) in which all of several drives stand still although every one of them was commanded in that time.

    Parameters
    ----------
    speeds, commands : Sequence[Array], each of shape (n,)
        Measured and commanded speeds of all drives [m/s]; NaN where not known.
    driving_speed : float
        Commanded speed from which a drive is driving [m/s].
    dt : float
        Step [s].
    readings : Sequence[Array] or None, each of shape (n,)
        What the speeds are in the log, where they are without its noise: they must differ from 0 by noise alone [m/s].
    """
    return stood_still(speeds, commands, driving_speed, dt, readings) if len(speeds) > 1 else []


def stood_still(
    speeds: Sequence[Array],
    commands: Sequence[Array],
    driving_speed: float,
    dt: float,
    readings: Sequence[Array] | None = None,
) -> list[Span]:
    """Steps [start, stop) in which some drives, or a single one, stand still although each was commanded; parameters of `not_followed`.

    `speeds`, `commands`, `readings` of shape (n,) each [m/s]; `driving_speed` in m/s, `dt` in s.
    """
    still = np.logical_and.reduce([np.abs(np.nan_to_num(y, nan=np.inf)) <= STILL * driving_speed for y in speeds])
    asked = [np.abs(without_nan(c)) > _ASKED * driving_speed for c in commands]
    out: list[Span] = []
    for start, stop in runs_of(still):
        wanted = [a[start:stop] for a in asked]
        first = np.flatnonzero(np.logical_or.reduce(wanted))
        if first.size and first.size * dt >= _LEAST_S and all(w.any() for w in wanted):
            begin = start + int(first[0])
            long = (stop - begin) * dt >= _TAIL_S
            if long and all(_about_nothing(y[start:stop], STILL * driving_speed) for y in readings or ()):
                out.append((begin, start + int(first[-1]) + 1))
    return out


def _about_nothing(y: Array, still: float) -> bool:
    """Whether readings are standstill each, or their mean differs from 0 by no more than their noise makes it. Of shape (k,) [m/s]."""
    known = y[np.isfinite(y)]
    if not known.size or float(np.max(np.abs(known))) <= still:
        return True
    number = np.count_nonzero(np.diff(known)) + 1
    return bool(abs(float(np.mean(known))) <= _ERRORS * float(np.std(known)) / np.sqrt(number))
