"""Onset and end of a drifting or noise-affected row, sample by sample, once its gain is known.

The path of `diagnosis.estimation.viterbi` learns a row's gain as it goes; near an end of the row it is free enough to follow a
healthy channel too. Here the gain is fixed, the row's filter runs from its inside outwards and the healthy filters run
from the outside inwards: the change lies where both together explain most.
"""

from __future__ import annotations

import numpy as np

from diagnosis.direct.kernel import drifting_likelihoods, healthy_likelihoods
from diagnosis.estimation.fault_models import NOISY_MODELS, ModeModel
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.segments import Run

_REACH_S = 1.5
_INNER_S = 2.5


def refine(run: Run, samples: Samples, delta: float, model: ModeModel, before: int, after: int) -> Run:
    """Move the ends of a noisy run to where its fault most probably began and ended.

    The gain is without a unit [1].

    Parameters
    ----------
    run : Run
        A run of a row whose saturation term varies.
    samples : Samples
        All of the channel.
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
    start = run.start + inner - _extent(samples.part(first, run.start + inner).reversed(), delta, model)
    last = min(after, run.stop + reach)
    stop = run.stop - inner + _extent(samples.part(run.stop - inner, last), delta, model)
    if first == 0 and start <= 2:
        start = 0  # what held from the first samples on began before them
    return Run(start, stop, run.row) if stop - start >= 20 else run


def _extent(part: Samples, delta: float, model: ModeModel) -> int:
    """Number of samples from the first on that belong to the fault; the rest is healthy."""
    bank, size = model.bank(), part.y.size
    back = part.reversed()
    healthy = np.empty((2, size))
    for row, decay in zip(healthy, (0.0, bank.decay), strict=True):
        healthy_likelihoods(back, bank, decay, row)
    outside = np.concatenate((np.cumsum(healthy, axis=1).max(axis=0)[::-1], [0.0]))
    best, most = size, -np.inf
    for walk, power in NOISY_MODELS:
        fault = np.empty(size)
        drifting_likelihoods(part, bank, delta, walk, power, fault)
        score = np.concatenate(([0.0], np.cumsum(fault))) + outside
        k = int(np.argmax(score))
        if score[k] > most:
            best, most = k, float(score[k])
    return best
