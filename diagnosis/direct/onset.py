"""Onset and end of a drifting or noise-affected row, sample by sample, once its gain is known.

The path of `diagnosis.estimation.viterbi` learns a row's gain as it goes; near an end of the row it is free enough to follow a
healthy channel too. Here the gain is fixed, the row's filter runs from its inside outwards and the healthy filters run
from the outside inwards: the change lies where both together explain most.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from diagnosis.estimation import fault_models
from diagnosis.estimation.fault_models import CLEAR, PAIR
from diagnosis.estimation.segments import Run

Array = NDArray[np.float64]

_REACH_S = 1.5
_INNER_S = 2.5


@dataclass(frozen=True)
class Channel:
    """Samples of a channel as the path saw them; all of shape (n,).

    Attributes
    ----------
    y, x : Array
        Measured value and reference.
    status : NDArray[np.int8]
        See `diagnosis.estimation.viterbi.forward`.
    quiet : NDArray[np.bool_]
        Where the machine stands.
    """

    y: Array
    x: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]

    def part(self, start: int, stop: int) -> Channel:
        """Samples [start, stop)."""
        s = slice(start, stop)
        return Channel(self.y[s], self.x[s], self.status[s], self.quiet[s])

    def reversed(self) -> Channel:
        """The same samples backwards."""
        return Channel(self.y[::-1].copy(), self.x[::-1].copy(), self.status[::-1].copy(), self.quiet[::-1].copy())

    def evidence(self, model: fault_models.ModeModel) -> Array:
        """Log-evidence of each row; see `modes.segment_evidence`."""
        return fault_models.segment_evidence(self.y, self.x, self.status, self.quiet, model)


@njit(cache=True)
def _healthy(y, x, status, p, decay, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of each sample under y = x + b + n, b an AR(1) of the tolerance's power; none where decay is 0."""
    b, c = 0.0, p[5] if decay > 0.0 else 0.0
    for k in range(y.size):
        out[k] = 0.0
        if status[k] != PAIR and status[k] != CLEAR:
            continue
        c = decay * decay * c + (1 - decay * decay) * p[5] if decay > 0.0 else 0.0
        b *= decay
        s = c + p[0]
        e = y[k] - x[k] - b
        b += c / s * e
        c -= c * c / s
        out[k] = max(-0.5 * (e * e / s + np.log(2 * np.pi * s)), p[8])


@njit(cache=True)
def _drifting(y, x, status, p, delta, walk, power, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of each sample under y = δ·x + δ̄ + n with δ known and δ̄ a random walk."""
    b, c = 0.0, (0.3 * p[2]) ** 2
    for k in range(y.size):
        out[k] = 0.0
        if status[k] != PAIR and status[k] != CLEAR:
            continue
        c += (walk * p[2]) ** 2 * p[3]
        s = c + p[0] * power * power
        e = y[k] - delta * x[k] - b
        b += c / s * e
        c -= c * c / s
        out[k] = max(-0.5 * (e * e / s + np.log(2 * np.pi * s)), p[8]) - p[10]


def refine(run: Run, channel: Channel, delta: float, model: fault_models.ModeModel, before: int, after: int) -> Run:
    """Move the ends of a noisy run to where its fault most probably began and ended.

    Parameters
    ----------
    run : Run
        A run of the row `NOISY`.
    channel : Channel
        All samples.
    delta : float
        Its gain.
    model : ModeModel
        Noise of the channel.
    before, after : int
        Between which samples the ends may lie: where the neighbours end and begin.
    """
    reach, inner = (max(1, round(s / model.dt)) for s in (_REACH_S, _INNER_S))
    inner = min(inner, run.size // 2)
    if inner < 20:
        return run
    first = max(before, run.start - reach)
    start = run.start + inner - _extent(channel.part(first, run.start + inner).reversed(), delta, model)
    last = min(after, run.stop + reach)
    stop = run.stop - inner + _extent(channel.part(run.stop - inner, last), delta, model)
    if first == 0 and start <= 2:
        start = 0  # what held from the first samples on began before them
    return Run(start, stop, run.row) if stop - start >= 20 else run


def _extent(c: Channel, delta: float, model: fault_models.ModeModel) -> int:
    """Number of samples from the first on that belong to the fault; the rest is healthy."""
    p = model.packed()
    back = c.reversed()
    healthy = np.empty((2, c.y.size))
    for row, decay in zip(healthy, (0.0, p[9]), strict=True):
        _healthy(back.y, back.x, back.status, p, decay, row)
    outside = np.concatenate((np.cumsum(healthy, axis=1).max(axis=0)[::-1], [0.0]))
    best, most = c.y.size, -np.inf
    for walk, power in fault_models.NOISY_MODELS:
        fault = np.empty(c.y.size)
        _drifting(c.y, c.x, c.status, p, delta, walk, power, fault)
        score = np.concatenate(([0.0], np.cumsum(fault))) + outside
        k = int(np.argmax(score))
        if score[k] > most:
            best, most = k, float(score[k])
    return best
