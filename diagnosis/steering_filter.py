"""Which rows of the two tables hold on a steering axle, block by block: the checked side of `steering_scan`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis import steering_scan as ss
from diagnosis.modes import PAIR, STAY, trace
from diagnosis.steering_blocks import SteeringBlocks
from diagnosis.steering_model import SteeringModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SteeringPath:
    """Most probable models of an axle.

    Attributes
    ----------
    model : NDArray[np.uint8], shape (m,)
        Model of each block, an index into `steering_scan.SENSOR` and `ACTUATOR`.
    mean, variance : Array, shape (m, 6)
        Of [φ, r, a, b, d, c] along that path.
    """

    model: NDArray[np.uint8]
    mean: Array
    variance: Array

    @property
    def sensor(self) -> NDArray[np.int64]:
        """Row of the sensor."""
        return np.asarray(ss.SENSOR[self.model])

    @property
    def actuator(self) -> NDArray[np.int64]:
        """Row of the valve."""
        return np.asarray(ss.ACTUATOR[self.model])


def allowed_models(*, sensor: bool, actuator: bool) -> NDArray[np.bool_]:
    """Models that leave a side healthy which is not judged here."""
    return np.asarray(((ss.SENSOR == ss.OK) | sensor) & ((ss.ACTUATOR == ss.OK) | actuator))


def start_state(first: float, p: Array) -> tuple[Array, Array, Array, Array]:
    """Scores, means, covariances and noise before the first block of a mission that may begin with a fault."""
    score = np.full(ss.MODELS, -0.5 * p[15])
    score[0] = 0.0
    z, P = np.zeros((ss.MODELS, ss.STATES)), np.zeros((ss.MODELS, ss.STATES, ss.STATES))
    ig = np.ones((ss.MODELS, 2))
    for m in range(ss.MODELS):
        z[m, 0] = np.clip(first, -p[4], p[4])
        P[m, 0, 0], P[m, 1, 1] = p[4] ** 2, (0.2 * p[3]) ** 2
        ss.enter(m, m, p, z, P, ig)
    return score, z, P, ig


def _first(blocks: SteeringBlocks, part: slice) -> float:
    known = np.flatnonzero(blocks.status[part] == PAIR)
    return float(blocks.mean[part][known[0]]) if known.size else 0.0


def _arrays(blocks: SteeringBlocks, driven: Array, part: slice) -> tuple[Array, ...]:
    return (
        blocks.mean[part],
        blocks.power[part],
        blocks.count[part],
        driven[part],
        blocks.u[part],
        blocks.status[part],
    )


def most_probable(
    blocks: SteeringBlocks, driven: Array, model: SteeringModel, allowed: NDArray[np.bool_]
) -> SteeringPath:
    """Most probable models over a mission.

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
    everything = slice(None)
    score, z, P, ig = start_state(_first(blocks, everything), p)
    score[~allowed] = -1e12
    back = np.full((blocks.mean.size, ss.MODELS), STAY, dtype=np.uint8)
    ss.scan(*_arrays(blocks, driven, everything), allowed, p, score, z, P, ig, back)
    path, _ = trace(back, int(np.argmax(score)))
    return SteeringPath(path, *follow_path(blocks, driven, model, path, everything)[:2])


def follow_path(
    blocks: SteeringBlocks, driven: Array, model: SteeringModel, path: NDArray[np.uint8], part: slice
) -> tuple[Array, Array, Array]:
    """States along a given path over a part of the mission: mean and variance (m, 6), log-evidence by block (m,)."""
    p = model.packed()
    _, z, P, ig = start_state(_first(blocks, part), p)
    out = np.zeros((path.size, 2 * ss.STATES))
    told = ss.follow(*_arrays(blocks, driven, part), path, p, z, P, ig, out)
    return out[:, : ss.STATES], out[:, ss.STATES :], told
