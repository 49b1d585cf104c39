"""What the trees say of every wheel's frames: a first look at each, and a second that knows what the first says of all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.forest import Forest, known_share, log_probabilities, looks
from diagnosis.wheels.frames.features import Features
from diagnosis.wheels.frames.said import said_features
from replay.faults import Side

Array = NDArray[np.float64]

_STRANGE = 0.9  # share of known features below which nothing is concluded
_IGNORANT = np.log(np.array([0.6, 0.1, 0.1, 0.1, 0.1]))  # which is called neither healthy nor faulty


def first_look(features: Features, measured: Sequence[bool]) -> dict[int, Array]:
    """Probabilities of the classes of sensor and valve in each frame, shape (frames, 10), by wheel.

    Parameters
    ----------
    features : Features
        Of the mission.
    measured : Sequence[bool]
        Per wheel: whether its valve's opening is measured, so that the valve is judged elsewhere.
    """
    first, out = looks()[0], {}
    for i, x in features.of.items():
        both = [np.exp(log_probabilities(x, forest)) for forest in first]
        if measured[i]:
            both[1] = _healthy(len(x))
        out[i] = np.concatenate(both, axis=1)
    return out


def second_look(features: Features, measured: Sequence[bool], dt: float) -> dict[int, dict[Side, Array]]:
    """Log-probabilities of the classes of each side in each frame, shape (frames, 5), by wheel.

    Where the features are not such as the trees know, the answer is that nobody knows.

    Parameters
    ----------
    features, measured
        As for `first_look`.
    dt : float
        Block [s].
    """
    first, second = looks()
    said = said_features(first_look(features, measured), features.hop * dt)
    out: dict[int, dict[Side, Array]] = {}
    for i, x in features.of.items():
        seen, sides = np.concatenate([x, said[i]], axis=1), (Side.SENSOR, Side.ACTUATOR)
        out[i] = {
            side: _known(x, f, log_probabilities(seen, g)) for side, f, g in zip(sides, first, second, strict=True)
        }
        if measured[i]:
            out[i][Side.ACTUATOR] = np.log(np.maximum(_healthy(len(x)), 1e-12))
    return out


def _known(x: NDArray[np.float32], first: Forest, said: Array) -> Array:
    said[known_share(x, first) < _STRANGE] = _IGNORANT
    return said


def _healthy(frames: int) -> Array:
    return np.tile(np.eye(_IGNORANT.size)[0], (frames, 1))
