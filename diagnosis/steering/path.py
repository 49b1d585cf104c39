"""The most probable models of a steering axle, block by block: the checked side of `diagnosis.steering.path_kernel`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.estimation.back_pointers import STAY, trace
from diagnosis.steering import path_kernel
from diagnosis.steering.blocks import SteeringBlocks
from diagnosis.steering.driven import Driven
from diagnosis.steering.filter_constants import FilterConstants
from diagnosis.steering.filter_state import Array, BlockSeries, FilterBank, SteeringPath
from diagnosis.steering.model_bank import ACTUATOR, FIRST_HIDDEN, HEALTHY, HEALTHY_MODEL, MODELS, SENSOR, STATES
from diagnosis.steering.models import SteeringModel

Models = NDArray[np.uint8]


@dataclass(frozen=True)
class AxleFilter:
    """The filters of one axle: its blocks and the models to consider.

    Attributes
    ----------
    blocks : SteeringBlocks
        The axle's samples.
    driven : Driven
        What the valve's map gives at the command.
    model : SteeringModel
        Constants.
    allowed : NDArray[np.bool_], shape (models,)
        Models to consider; the first is always.
    names : tuple[str, str]
        Channels of angle and command.
    """

    blocks: SteeringBlocks
    driven: Driven
    model: SteeringModel
    allowed: NDArray[np.bool_]
    names: tuple[str, str]

    @cached_property
    def constants(self) -> FilterConstants:
        """The model's constants for the compiled filters."""
        return self.model.constants()

    @cached_property
    def series(self) -> BlockSeries:
        """The blocks for the compiled filters."""
        return self.driven.series(self.blocks)

    @property
    def first_angle(self) -> float:
        """First measured angle [rad]; 0 where there is none."""
        known = np.flatnonzero(self.blocks.status == PAIR)
        return float(self.blocks.mean[known[0]]) if known.size else 0.0


def allowed_models(*, sensor: bool, actuator: bool, redundant: bool) -> NDArray[np.bool_]:
    """Models that leave a side healthy which is not judged here, and combine more where something is redundant.

    Shape (MODELS,).
    """
    rows = ((SENSOR == HEALTHY) | sensor) & ((ACTUATOR == HEALTHY) | actuator)
    return np.asarray(rows & ((np.arange(MODELS) < FIRST_HIDDEN) | redundant))


def start_states(first: float, constants: FilterConstants) -> tuple[Array, FilterBank]:
    """Scores and states of all models before the first block of a mission that may begin with a fault.

    Scores of shape (MODELS,); `first` is an angle [rad].
    """
    score = np.full(MODELS, -0.5 * constants.switch_cost)
    score[HEALTHY_MODEL] = 0.0
    bank = path_kernel.empty_bank()
    for m in range(MODELS):
        path_kernel.start(m, first, constants, bank)
    return score, bank


def most_probable(axle: AxleFilter) -> Models:
    """Most probable model of each block of a mission, as Viterbi's recursion leaves it, shape (m,)."""
    score, bank = start_states(axle.first_angle, axle.constants)
    score[~axle.allowed] = -1e12
    back = np.full((axle.blocks.mean.size, MODELS), STAY, dtype=np.uint8)
    path_kernel.scan(axle.series, axle.allowed, axle.constants, score, bank, back)
    path, _ = trace(back, int(np.argmax(score)))
    return np.asarray(path)


def follow_path(axle: AxleFilter, models: Models, known: SteeringPath | None = None) -> SteeringPath:
    """States along a given path. `models` of shape (m,), a model per block.

    Those of another path of the axle, `known`, hold up to the block where the two part; it is used up, for its columns are written anew
    from there on.
    """
    size = models.size
    if known is not None:
        parted = np.flatnonzero(models != known.model)
        if not parted.size:
            return known
        path = known._replace(model=models.copy())
        path_kernel.path_evidence(
            axle.series, path.model, int(parted[0]), size, path, axle.first_angle, axle.constants, True
        )
        return path
    path = SteeringPath(
        model=models.copy(),
        mean=axle.blocks.store.zeros((size, STATES), np.float64),
        cov=axle.blocks.store.zeros((size, STATES, STATES), np.float64),
        noise=np.ones((size, 2)),
        gap=np.zeros((size, 2)),
    )
    path_kernel.path_evidence(axle.series, path.model, 0, size, path, axle.first_angle, axle.constants, True)
    return path


def evidence_of(axle: AxleFilter, known: SteeringPath, models: Models, start: int, stop: int) -> tuple[float, Array]:
    """Log-evidence of a path over [start, stop), its switches paid for, and its state [φ, r, a, b, d, c] at the end.

    Up to `start` it is the path `known`, whose states are there.

    `models` of shape (m,); the state of shape (6,).
    """
    first = float(axle.series.mean[0])
    found: tuple[float, Array] = path_kernel.path_evidence(
        axle.series, models, start, stop, known, first, axle.constants, False
    )
    return found
