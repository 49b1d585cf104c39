"""Which rows of the two tables hold on a steering axle, block by block: the checked side of `steering_scan`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import PAIR, STAY, trace
from diagnosis.steering import model_bank as sr
from diagnosis.steering import path_kernel as ss
from diagnosis.steering.blocks import SteeringBlocks
from diagnosis.steering.models import SteeringModel
from diagnosis.steering.step_kernel import enter
from replay.arrays.spill import scratch

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SteeringPath:
    """Most probable models of an axle.

    Attributes
    ----------
    model : NDArray[np.uint8], shape (m,)
        Model of each block, an index into `steering_scan.SENSOR` and `ACTUATOR`.
    mean, cov : Array, shape (m, 6) and (m, 6, 6)
        Of [φ, r, a, b, d, c] along that path.
    noise : Array, shape (m, 2)
        α and β of the sensor's noise where it is learned.
    """

    model: NDArray[np.uint8]
    mean: Array
    cov: Array
    noise: Array

    @property
    def variance(self) -> Array:
        """Variances of [φ, r, a, b, d, c], shape (m, 6)."""
        return np.asarray(np.diagonal(self.cov, axis1=1, axis2=2))

    @property
    def sensor(self) -> NDArray[np.int64]:
        """Row of the sensor."""
        return np.asarray(sr.SENSOR[self.model])

    @property
    def actuator(self) -> NDArray[np.int64]:
        """Row of the valve."""
        return np.asarray(sr.ACTUATOR[self.model])


def allowed_models(*, sensor: bool, actuator: bool, twice: bool) -> NDArray[np.bool_]:
    """Models that leave a side healthy which is not judged here, and combine more where something is measured twice."""
    rows = ((sr.SENSOR == sr.OK) | sensor) & ((sr.ACTUATOR == sr.OK) | actuator)
    return np.asarray(rows & ((np.arange(sr.MODELS) < sr.SECOND) | twice))


def start_state(first: float, p: Array) -> tuple[Array, Array, Array, Array]:
    """Scores, means, covariances and noise before the first block of a mission that may begin with a fault."""
    score = np.full(sr.MODELS, -0.5 * p[15])
    score[0] = 0.0
    z, P = np.zeros((sr.MODELS, sr.STATES)), np.zeros((sr.MODELS, sr.STATES, sr.STATES))
    ig = np.ones((sr.MODELS, 2))
    for m in range(sr.MODELS):
        z[m, 0] = np.clip(first, -p[4], p[4])
        P[m, 0, 0], P[m, 1, 1] = p[4] ** 2, (0.2 * p[3]) ** 2
        enter(m, m, p, z, P, ig)
    return score, z, P, ig


def most_probable(
    blocks: SteeringBlocks, driven: Array, model: SteeringModel, allowed: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Most probable model of each block of a mission, as Viterbi's recursion leaves it.

    Parameters
    ----------
    blocks : SteeringBlocks
        The axle's samples.
    driven : Array, shape (m,)
        `SteeringBlocks.driven` with the plant's gain and rate limit [rad/s].
    model : SteeringModel
        Constants.
    allowed : NDArray[np.bool_], shape (models,)
        Models to consider; the first is always.
    """
    p = model.packed()
    score, z, P, ig = start_state(_first(blocks), p)
    score[~allowed] = -1e12
    back = np.full((blocks.mean.size, sr.MODELS), STAY, dtype=np.uint8)
    b = blocks
    ss.scan(b.mean, b.power, b.count, driven, b.u, b.status, b.second, allowed, p, score, z, P, ig, _row(), back)
    path, _ = trace(back, int(np.argmax(score)))
    return np.asarray(path)


def follow_path(blocks: SteeringBlocks, driven: Array, model: SteeringModel, path: NDArray[np.uint8]) -> SteeringPath:
    """States along a given path."""
    size = path.size
    mean, cov = scratch((size, sr.STATES), np.float64), scratch((size, sr.STATES, sr.STATES), np.float64)
    noise = np.ones((size, 2))
    b, p = blocks, model.packed()
    z, P, ig = ss.started(path[0], _first(blocks), p)
    ss.follow(
        b.mean,
        b.power,
        b.count,
        driven,
        b.u,
        b.status,
        b.second,
        path,
        p,
        z,
        P,
        ig,
        _row(),
        mean,
        cov,
        noise,
    )
    return SteeringPath(path.copy(), mean, cov, noise)


def _row() -> Array:
    return np.zeros((3, sr.STATES))


def _first(blocks: SteeringBlocks) -> float:
    known = np.flatnonzero(blocks.status == PAIR)
    return float(blocks.mean[known[0]]) if known.size else 0.0
