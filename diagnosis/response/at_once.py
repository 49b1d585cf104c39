"""How probable it is that a drive does from one reading to the next what a sensor does at once.

A wheel that seizes, a brake that closes and a drive that loses its power take their time, and so do drives that start again. Where a
change lies between two readings, with none on the way, that time was shorter than the pause between them and fell into it whole. With
times that are exponentially distributed around a mean τ, and a beginning anywhere in a pause of h, this has the probability
1 − τ/h · (1 − exp(−h/τ)): .03 for τ = .15 s and readings 100 times a second, .15 for 20 times, .27 for 10 times. That is the likelihood
of the drive beside the sensor's, which is 1; before, each is as probable as the other. The times are set by hand: gears and brakes stop a
wheel within .02–.3 s, a controller starts one within .1–1 s, and a drive that grows weak has the mass of the machine behind it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.channel import Samples

Array = NDArray[np.float64]

#: Mean time [s] in which a wheel is stopped, one starts again, and a drive grows weak or recovers.
STOPS_S, STARTS_S, FADES_S = 0.15, 0.25, 0.3
_MOST = 0.5, 0.92, 0.97  # that it is the sensor's, by no jump, by one and by two
_LEAPS, _STEADY = (
    2.0,
    0.5,
)  # times the change that as many of the new values of a turning wheel do not exceed: less is no jump
_NEAR_S = 1.0
_USUAL = 0.995  # of the changes of a turning wheel are no larger than usual
_PAUSE = 0.75  # of the pauses between new values of a turning wheel are no longer than usual
_TURNS = 0.1  # of the usual top speed


class Jump(NamedTuple):
    """A sample behind a jump, and the mean time that a drive takes for such a change [s]."""

    sample: int
    mean_s: float


def within_a_pause(pause_s: float, mean_s: float) -> float:
    """Probability [1] that a change lies between two readings `pause_s` [s] apart, where such a change takes `mean_s` [s] on average."""
    share = mean_s / pause_s
    return float(1.0 + share * np.expm1(-1.0 / share))


def sensor_by_jumps(samples: Samples, jumps: list[Jump], dt: float) -> float:
    """Probability [1] that what begins, or ends, by jumps is the sensor's rather than the drive's; .5 where they say nothing.

    A drive takes no longer for a change than it does for one of that size at its hardest starts and stops.

    Parameters
    ----------
    samples : Samples
        Of the channel.
    jumps : list[Jump]
        Where it begins and ends.
    dt : float
        Step [s].
    """
    places = [j.sample for j in jumps]
    usual, pause = usual_change(samples, places), usual_pause(samples, dt)
    drive = 1.0
    for at, mean_s in jumps:
        size = abs(float(np.nan_to_num(samples.change[at])))
        least = max(pause, float(samples.step[at] - samples.step[at - 1]) * dt if at else 0.0)
        hardest = size * pause / usual if usual > 0.0 else mean_s
        drive *= within_a_pause(least, min(mean_s, hardest)) if size > 0.0 and np.isfinite(least + hardest) else 1.0
    return min(1.0 / (1.0 + drive), _MOST[len(jumps)])


def to_zero(samples: Samples, at: int, dt: float, *, ends: bool = False) -> int | None:
    """Sample with the first reading of 0 of those that a speed shows from about step `at`, or, where it ends, the first one behind them.

    None where there is none, or it came by a change as a turning wheel makes it.

    Parameters
    ----------
    samples : Samples
        Of the channel.
    at : int
        Step at which it begins, or ends, about.
    dt : float
        Step [s].
    ends : bool
        Whether the end is asked for.
    """
    zero = samples.value == 0.0
    edge = np.flatnonzero((zero[:-1] & ~zero[1:]) if ends else (~zero[:-1] & zero[1:])) + 1
    edge = edge[np.isfinite(samples.change[edge])]
    far = np.abs(samples.step[edge] - at) * dt
    if not edge.size or far.min() > _NEAR_S:
        return None
    found = int(edge[np.argmin(far)])
    return found if abs(samples.change[found]) > _LEAPS * steady_change(samples) else None


def steady_change(samples: Samples) -> float:
    """What the readings of a turning wheel change by while its speed is steady [m/s]: less than nine of ten of all its changes."""
    size = np.abs(samples.change[_turning(samples) & ~samples.same])
    size = size[np.isfinite(size)]
    return float(np.quantile(size, _STEADY)) if size.size else np.inf


def usual_change(samples: Samples, but: list[int]) -> float:
    """What the readings of a turning wheel change by at most [m/s], those at `but`, its jumps, left out; infinite where it does not turn."""
    use = _turning(samples)
    use[but] = False
    size = np.abs(samples.change[use])
    size = size[np.isfinite(size)]
    return float(np.quantile(size, _USUAL)) if size.size else np.inf


def usual_pause(samples: Samples, dt: float) -> float:
    """Time between new values of a turning wheel [s]: a driver that reads its wheels ten times a second may repeat each value.

    `dt` is a step [s].
    """
    places = samples.step[_turning(samples) & ~samples.same]
    return float(np.quantile(np.diff(places), _PAUSE)) * dt if places.size > 1 else np.inf


def _turning(samples: Samples) -> NDArray[np.bool_]:
    known = np.abs(samples.value[np.isfinite(samples.value)])
    top = float(np.quantile(known, 0.99)) if known.size else 0.0
    return np.asarray(np.abs(np.nan_to_num(samples.value)) > _TURNS * top)
