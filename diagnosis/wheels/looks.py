"""What the trees say of every wheel's frames: a first look at each, and a second that knows what the first says of all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.forest import Forest, known_share, log_probabilities, looks
from diagnosis.wheels.frames.features import Features
from diagnosis.wheels.frames.said import said_features
from replay.arrays.processors import each
from replay.faults import Side

Array = NDArray[np.float64]
_T = TypeVar("_T")

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
    first = looks()[0]

    def look(i: int) -> Array:
        x = features.of[i]
        valve = _healthy(len(x)) if measured[i] else np.exp(log_probabilities(x, first.actuator))
        return np.concatenate([np.exp(log_probabilities(x, first.sensor)), valve], axis=1)

    return _each(look, features)


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

    def look(i: int) -> dict[Side, Array]:
        x = features.of[i]
        seen = np.concatenate([x, said[i]], axis=1)
        if measured[i]:
            valve = np.log(np.maximum(_healthy(len(x)), 1e-12))
        else:
            valve = _known(x, first.actuator, log_probabilities(seen, second.actuator))
        return {Side.SENSOR: _known(x, first.sensor, log_probabilities(seen, second.sensor)), Side.ACTUATOR: valve}

    return _each(look, features)


def _each(look: Callable[[int], _T], features: Features) -> dict[int, _T]:
    """What is said of each wheel, by wheel."""
    frames = max((len(x) for x in features.of.values()), default=0)
    return dict(zip(features.of, each(look, features.of, frames), strict=True))


def _known(x: NDArray[np.float32], first: Forest, said: Array) -> Array:
    said[known_share(x, first) < _STRANGE] = _IGNORANT
    return said


def _healthy(frames: int) -> Array:
    return np.tile(np.eye(_IGNORANT.size)[0], (frames, 1))
