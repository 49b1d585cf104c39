"""Times in which a machine as a whole did not follow: every drive stood still while the commands went on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.evidence import MissionView

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Span = tuple[int, int]

_LEAST_S = 2.0  # longer than drives take to answer
STILL = 0.2  # of the driving speed
_ASKED = 2.0  # driving speeds
_TAIL_S = 3.0  # a command that has just begun proves nothing


def together_idle(mission: MissionView) -> Flags:
    """Steps in which the machine as a whole did not follow, shape (n,); see `not_followed`."""
    out = np.zeros(mission.timeline.size, np.bool_)
    names = [f"wheel.{w}.v" for w in mission.machine.wheels]
    speeds = [mission.values(n) for n in names]
    commands = [mission.command(w) for w in mission.machine.wheels]
    for start, stop in not_followed(speeds, commands, mission.machine.limits.driving_speed, mission.timeline.dt):
        out[start:stop] = True
    return out


def not_followed(speeds: Sequence[Array], commands: Sequence[Array], driving_speed: float, dt: float) -> list[Span]:
    """Steps [start, stop) in which all of several drives stand still although every one of them was commanded in that time.

    Parameters
    ----------
    speeds, commands : Sequence[Array], each of shape (n,)
        Measured and commanded speeds of all drives [m/s]; NaN where not known.
    driving_speed : float
        Commanded speed from which a drive is driving [m/s].
    dt : float
        Step [s].
    """
    return stood_still(speeds, commands, driving_speed, dt) if len(speeds) > 1 else []


def stood_still(speeds: Sequence[Array], commands: Sequence[Array], driving_speed: float, dt: float) -> list[Span]:
    """Steps [start, stop) in which some drives, or a single one, stand still although each was commanded; parameters of `not_followed`.

    `speeds`, `commands` of shape (n,) each [m/s]; `driving_speed` in m/s, `dt` in s.
    """
    still = np.logical_and.reduce([np.abs(np.nan_to_num(y, nan=np.inf)) <= STILL * driving_speed for y in speeds])
    asked = [np.abs(np.nan_to_num(c)) > _ASKED * driving_speed for c in commands]
    edge = np.flatnonzero(np.diff(np.r_[False, still, False].astype(np.int8)))
    out: list[Span] = []
    for start, stop in zip(edge[::2].tolist(), edge[1::2].tolist(), strict=True):
        wanted = [a[start:stop] for a in asked]
        first = np.flatnonzero(np.logical_or.reduce(wanted))
        if first.size and first.size * dt >= _LEAST_S and all(w.any() for w in wanted):
            begin = start + int(first[0])
            if (stop - begin) * dt >= _TAIL_S:
                out.append((begin, start + int(first[-1]) + 1))
    return out
