"""What the recursion of all wheels together takes, carries and gives: named tuples of the kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.models import MODELS

Array = NDArray[np.float64]

#: Columns of `JointOutput.inputs`: fields of `WheelInput`, and the log-likelihood of the block.
DRIVE, DRIVE_HALF, DRIVE_NONE, SHARE_NONE, SHARE_SOME, BODY, DOUBT, GAIN = range(8)
#: The last column of `JointState.carried`, behind the first three of `JointOutput.inputs`.
LAGGED_DRIVE = 3


class JointConstants(NamedTuple):
    """What stays the same during a mission."""

    wheels: Array  # (wheels, 19) a row of `WheelConstants` each: a tuple would compile each number of wheels anew
    K: Array  # (wheels,) speed per full opening [m/s]
    known: NDArray[np.bool_]  # (wheels,) whether a wheel has a model
    models: NDArray[np.int64]  # (wheels,) how many models are considered
    flow: float  # what the pump feeds, as a sum of speeds [m/s]
    cost: float  # minus the log-probability of entering a model in one block


class JointInput(NamedTuple):
    """Blocks of all wheels, shape (n, wheels), and their openings, shape (n·width, wheels)."""

    u: Array  # openings beyond the dead zone [fraction]
    y: Array
    samples: Array
    jitter: Array
    white: Array
    slack: Array
    habit: NDArray[np.int8]
    chatter: Array
    wander: Array
    unseen: Array  # by how much faster a valve may drive its wheel than anyone has seen [m/s]
    ratio: Array  # speed of the wheel per speed of the body [1]
    turn: Array  # what it rolls less because it steers [m/s]
    sensed: Array  # speed at which it rolls by sensors of the body [m/s]; NaN where unknown
    sensed_std: Array  # standard deviation of that [m/s]
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    given: NDArray[np.uint8]  # model in which the others take a wheel to be; `STAY`: its own most probable one


class JointState(NamedTuple):
    """What the recursion carries from blocks to blocks."""

    score: Array  # (wheels, models) log-probability of each model, less that of the best
    mean: Array  # (wheels, models, 4)
    cov: Array  # (wheels, models, 4, 4)
    carried: Array  # (wheels, 4) drive that the last samples' openings leave to the next block; lagged drive [m/s]


class JointOutput(NamedTuple):
    """What is written for each of n blocks."""

    back: NDArray[np.uint8]  # (n, wheels, models) model from which each was entered, `STAY` where it was not
    best: NDArray[np.uint8]  # (n, wheels) most probable model by what came before
    fault: Array  # (n, wheels) probability by the same that the wheel is not healthy
    inputs: Array  # (n, wheels, 8) see `DRIVE` and following


class JointWork(NamedTuple):
    """Arrays to work in, of the block at hand."""

    gain: Array  # (models,) log-likelihoods
    top: NDArray[np.int64]  # (wheels,) most probable model
    seen: NDArray[np.int64]  # (wheels,) model in which the others take the wheel to be
    speed: Array  # (wheels,) speed of the body by the wheel [m/s]
    trust: Array  # (wheels,) weight of that
    taken: Array  # (wheels,) flow that its valve takes, as a speed [m/s]
    here: Array  # (wheels, width) see `weights`
    after: Array  # (wheels, width)

    @classmethod
    def of(cls, wheels: int, width: int) -> JointWork:
        """Make them for blocks of `width` samples."""
        gain, here, after = np.zeros(MODELS), np.zeros((wheels, width)), np.zeros((wheels, width))
        top, seen = np.zeros(wheels, dtype=np.int64), np.zeros(wheels, dtype=np.int64)
        return cls(gain, top, seen, np.zeros(wheels), np.zeros(wheels), np.zeros(wheels), here, after)
