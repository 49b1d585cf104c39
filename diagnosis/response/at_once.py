"""How probable it is that a drive does from one reading to the next what a sensor does at once.

A drive takes its time for a change, and so does the machine that it moves. Where a change of size s lies between two readings, with none on
the way, it took less than their pause h and fell into it whole. How fast the drive can be is seen in the log itself: at the hardest starts
and stops of this wheel its readings change by g in the pause, so that s takes τ = h·s/g. With times that are exponentially distributed
around τ, and a beginning anywhere in the pause, the change lies within it with the probability 1 − τ/h · (1 − exp(−h/τ)): .37 for what is
as large as the hardest start, .15 for three times as much, .05 for ten times. That is the likelihood of the drive beside the sensor's, which
is 1; before, each is as probable as the other.

A wheel that jams is no such drive: it may stop between any two readings. A stop says nothing, therefore, however sharp it is. What comes back
from it does where nothing but this drive moves its side of the machine: coming free, it has the machine's mass to set going. Where other
wheels of its side go on, the ground has it turning at once.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.channel import Samples

Array = NDArray[np.float64]

_MOST = 0.5, 0.92, 0.97  # that it is the sensor's, by no jump, by one and by two
_HARDEST = 0.99  # of the changes of a turning wheel are no larger than at its hardest starts and stops
_LEAST = 100  # such changes, from which on they show what a drive can do
_TOO_HARD, _ALIKE = 2.0, 1.35  # times such a change; by which the ratio of a jump may differ from the deviation's
_PAUSE = 0.75  # of the pauses between new values of a turning wheel are no longer than usual
_TURNS = 0.1  # of the usual top speed
_NEAR_S, _LEVEL_S = (
    1.0,
    0.5,
)  # around a step at which a spell ends, about; before a fall, or after a rise, in which a speed has its level
_WHOLE = 0.75  # of that level, or the other way round: less from one reading to the next is no whole step, and more overshoots


def within_a_pause(pause_s: float, mean_s: float) -> float:
    """Probability [1] that a change lies between two readings `pause_s` [s] apart, where such a change takes `mean_s` [s] on average."""
    share = mean_s / pause_s
    return float(1.0 + share * np.expm1(-1.0 / share))


def sensor_by_jumps(samples: Samples, places: Sequence[int], dt: float) -> float:
    """Probability [1] that what begins, or ends, by jumps is the sensor's rather than the drive's; .5 where they say nothing.

    Parameters
    ----------
    samples : Samples
        Of the channel.
    places : Sequence[int]
        Sample behind each jump that a drive would have to make, two at most.
    dt : float
        Step [s].
    """
    hardest, pause = hardest_change(samples, places), usual_pause(samples, dt)
    drive = 1.0
    for at in places:
        size = abs(float(np.nan_to_num(samples.change[at])))
        gap = max(pause, float(samples.step[at] - samples.step[at - 1]) * dt if at else 0.0)
        if size > 0.0 and np.isfinite(gap + hardest):
            drive *= within_a_pause(gap, pause * size / hardest)
    return min(1.0 / (1.0 + drive), _MOST[len(places)])


def back_at_once(samples: Samples, last: int, dt: float) -> tuple[int, int] | None:
    """Samples with which a speed fell to 0 and came back to its level, each from one reading to the next; None where either took its time.

    Parameters
    ----------
    samples : Samples
        Of the channel.
    last : int
        Step at which it ceases to read 0, about.
    dt : float
        Step [s].
    """
    zero = samples.value == 0.0
    falls, rises = np.flatnonzero(~zero[:-1] & zero[1:]) + 1, np.flatnonzero(zero[:-1] & ~zero[1:]) + 1
    back = _nearest(samples, rises, last, dt)
    before = falls[falls < back] if back is not None else falls[:0]
    if back is None or not before.size:
        return None
    fell = int(before[-1])
    whole = _whole(samples, fell, dt, after=False) and _whole(samples, back, dt, after=True)
    return (fell, back) if whole else None


def _nearest(samples: Samples, places: NDArray[np.intp], step: int, dt: float) -> int | None:
    far = np.abs(samples.step[places] - step) * dt
    return int(places[np.argmin(far)]) if far.size and far.min() <= _NEAR_S else None


def _whole(samples: Samples, at: int, dt: float, *, after: bool) -> bool:
    """Whether the reading changes at a sample by the whole level that it has before, or after."""
    reach = np.searchsorted(samples.step, samples.step[at] + np.array([-1, 1]) * round(_LEVEL_S / dt), side="right")
    near = samples.value[at : reach[1]] if after else samples.value[reach[0] : at]
    level = float(np.nanmedian(near)) if np.isfinite(near).any() else 0.0
    change = float(samples.change[at]) * (1.0 if after else -1.0)
    return bool(_WHOLE * abs(level) < change * np.sign(level) < abs(level) / _WHOLE)


def too_hard(samples: Samples, at: int, ratio: float, dt: float) -> int | None:
    """Sample next to step `at` with which the speed changes by about `ratio` [1] and far more than at the drive's hardest; None without any."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        made = samples.value / (samples.value - samples.change)
    hard = np.abs(samples.change) > _TOO_HARD * hardest_change(samples)
    places = np.flatnonzero(hard & (made > ratio / _ALIKE) & (made < ratio * _ALIKE))
    return _nearest(samples, places, at, dt)


def times_harder(samples: Samples, places: Sequence[int]) -> float:
    """How many times as large as the hardest change of the drive the smallest of jumps `places` is [1]; 0 where that is not known."""
    hardest = hardest_change(samples, places)
    return min((abs(float(np.nan_to_num(samples.change[k]))) / hardest for k in places), default=0.0)


def how_hard(samples: Samples, places: Sequence[int]) -> str:
    """How much more a speed changes at samples `places` than at its hardest, as the end of a sentence; empty where it is no more."""
    times = times_harder(samples, places)
    return f", {times:.1f} times as much as at the hardest starts and stops of this {{wheel}}" if times > 1.0 else ""


def hardest_change(samples: Samples, but: Sequence[int] = ()) -> float:
    """What the new values of a turning wheel change by at its hardest starts and stops [m/s]; infinite where it hardly turns.

    Samples `but`, its jumps, are left out.
    """
    use = _turning(samples) & ~samples.same
    use[list(but)] = False
    size = np.abs(samples.change[use])
    size = size[np.isfinite(size)]
    return float(np.quantile(size, _HARDEST)) if size.size >= _LEAST else np.inf


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
