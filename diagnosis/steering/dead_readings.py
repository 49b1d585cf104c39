"""Angles that seem dead and may be none: a lost message or two, readings that agree by chance, an axle that nobody asks to turn."""

from __future__ import annotations

import numpy as np

from diagnosis.steering.excitation import asked, exercised
from diagnosis.steering.fault_size import level_of
from diagnosis.steering.filter_state import Array
from diagnosis.steering.path import AxleFilter

LEAST_ASKED_S = 0.35  # for how long a motion must be asked for, to see that it does not come
_SURELY_ASKED_S = 1.0  # for longer no axle stands in its dead band or sticks
_FEW_READINGS, _LAPSE_S = 3, 0.1  # readings that agree, seconds without any: no more may be chance, or a message lost
_STEP = 0.01  # of the full angle: what a sensor that dies leaps by is more
_TREMBLES = 5  # changes of a reading that lives
_RESTS = 10  # blocks in which nobody asks it to turn
_REPEATS = 3  # times as long as elsewhere does an angle repeat itself whose sensor is dead


def lapse(axle: AxleFilter, start: int, stop: int) -> bool:
    """Whether a sensor that seems dead may have lost no more than a message or two, or repeats a value by chance; blocks [start, stop)."""
    count = level_of(start, stop, axle)[2]
    return count < _FEW_READINGS if count else (stop - start) * axle.blocks.dt < _LAPSE_S


def at_rest(axle: AxleFilter, start: int, stop: int, *, command_logged: bool) -> bool:
    """Whether an angle merely stays where nobody asks it to leave: an angle without noise, as servos report it, does that in health.

    Where the valve's command is not logged, nothing else tells a dead sensor from an axle that is told to stay; where it is, an angle
    of few digits may still repeat itself for about as long as it does elsewhere at rest, or always where it never changes there; one that
    goes on trembling lives. So does one that reads on from where it stayed after a motion that was asked for briefly: its axle did not make
    it. Blocks [start, stop).
    """
    blocks = axle.blocks
    motion_s = asked(axle, start, stop)[2]
    if motion_s >= _SURELY_ASKED_S:
        return False
    known = np.flatnonzero(blocks.count > 0)
    inside = known[(known >= start) & (known < stop)]
    if not inside.size:
        return False
    before, after = known[known < start], known[known >= stop]
    beside = np.r_[before[-1:], after[:1]]
    level = float(np.median(blocks.mean[inside]))
    stays = bool(np.all(np.abs(blocks.mean[beside] - level) < _STEP * axle.model.stop))
    if motion_s >= LEAST_ASKED_S or not (stays and command_logged):
        return stays  # after a motion that was missed a sensor would read on from elsewhere
    means = blocks.mean[inside]
    if np.count_nonzero(np.diff(means)) >= _TREMBLES and _longest_alike(means) < 0.5 * means.size:
        return True
    resting = ~exercised(axle)
    elsewhere = [blocks.mean[side[resting[side]]] for side in (before, after)]
    if sum(mean.size for mean in elsewhere) < _RESTS or not any(np.diff(mean).any() for mean in elsewhere):
        return True  # nothing shows how it reads in health where it rests
    return _longest_alike(means) < _REPEATS * max(_longest_alike(mean) for mean in elsewhere)


def _longest_alike(mean: Array) -> int:
    """Most blocks on end with one mean [rad], shape (n,)."""
    changes = np.flatnonzero(np.diff(mean) != 0.0)
    return int(np.diff(np.r_[-1, changes, mean.size - 1]).max(initial=0))
