"""The onset of a fault once more, by filterpy alone: which sample divides healthy ones from those of the row best.

Forwards in time the healthy models are stepped over the samples around an onset, backwards the row's own; the onset is where
the sum of what lies before it by the first, and of what lies behind it by the second, is largest. Nothing is taken from the
compiled recursions but the readings and their noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import EXACT, MISMATCH, VARYING_ROWS, ModeModel
from diagnosis.estimation.joined_filters import Course, likelihoods
from diagnosis.estimation.row_filters import models_of
from diagnosis.results.fault_rows import ROWS
from replay.faults import State

Array = NDArray[np.float64]

SAMPLES = 100  # on each side of an onset
_LEAST = 8
_WORTH = 3.0  # log-evidence that an onset must have beside none
_TOLERANCE = 0.5  # of the noise: slow mismatch of healthy readings
_VARYING = 2  # of the noisy row's models, the middle ones
_FLOOR = -18.0
_EQUAL = 1e-6  # log-evidence that is rounding
_HEALTHY = (EXACT, MISMATCH)


class Second(NamedTuple):
    """An onset found again.

    Attributes
    ----------
    place : int
        First faulty sample.
    gain : float
        Log-evidence of that onset beside no fault at all.
    """

    place: int
    gain: float


def channel_model(noise: float, y: Array, x: Array, dt: float) -> ModeModel:
    """What the filters need to know of a channel.

    Parameters
    ----------
    noise : float
        Standard deviation of healthy readings about what is expected.
    y, x : Array, shape (n,)
        Readings that are faulty, if any are, and what is expected of them: how much a constant one moves by itself, and how
        large both are.
    dt : float
        Step [s].
    """
    size = max(float(np.max(np.abs(y), initial=0.0)), float(np.max(np.abs(x), initial=0.0)))
    shaken = float(np.median(np.abs(np.diff(y, n=2)))) / 0.6745 / np.sqrt(6.0) if y.size > 2 else 0.0
    changes = np.abs(np.diff(y))
    step = float(np.min(changes[changes > 0.0], initial=noise))
    constant = min(noise, max(step / np.sqrt(12.0), shaken, 1e-3 * noise))
    return ModeModel(noise, constant, _TOLERANCE * noise, max(size, 10.0 * noise), 0.0, dt)


class Readings(NamedTuple):
    """Samples around an onset.

    Attributes
    ----------
    y, x : Array, shape (n,)
        Readings and what is expected of them; NaN where there are none.
    model : ModeModel
        From `channel_model`.
    state : State
        The fault's row.
    """

    y: Array
    x: Array
    model: ModeModel
    state: State

    @property
    def known(self) -> NDArray[np.intp]:
        """Places of the samples that have both. Shape (k,)."""
        return np.flatnonzero(np.isfinite(self.y) & np.isfinite(self.x))

    def courses(self) -> list[Course]:
        """Healthy models forwards, those of the row backwards; none where there are too few readings."""
        known = self.known
        if known.size < _LEAST:
            return []
        a, b, row = self.y[known], self.x[known], ROWS.index(self.state)
        models = models_of(row)[:_VARYING] if row in VARYING_ROWS else models_of(row)
        forwards = [Course(m, self.model, a, b) for m in _HEALTHY]
        return forwards + [Course(m, self.model, a[::-1], b[::-1]) for m in models]


def second_onsets(asked: Sequence[Readings]) -> list[Second | None]:
    """The onset within the samples of each.

    Returns
    -------
    list[Second | None]
        None where there are too few readings, or where no place in them is an onset.
    """
    courses = [one.courses() for one in asked]
    found = iter(likelihoods([c for one in courses for c in one]))
    return [_best(one, [next(found) for _ in of]) if of else None for one, of in zip(asked, courses, strict=True)]


def _best(asked: Readings, found: list[Array]) -> Second | None:
    """The best place of an onset, from the log-likelihoods of its courses."""
    known, floor = asked.known, _FLOOR - float(np.log(asked.model.span))
    bounded = [np.maximum(x, floor) for x in found]
    healthy = np.maximum.reduce(bounded[: len(_HEALTHY)])
    best: Second | None = None
    for faulty in bounded[len(_HEALTHY) :]:
        total = np.r_[0.0, np.cumsum(healthy)] + np.r_[np.cumsum(faulty)[::-1], 0.0]
        # the first of equal ones: a sample that is an outlier to both models divides them nowhere better than beside it
        k = int(np.argmax(total >= total.max() - _EQUAL))
        gain = float(total[k] - total[-1])
        if k < known.size and gain >= _WORTH and (best is None or gain > best.gain):
            best = Second(int(known[k]), gain)
    return best
