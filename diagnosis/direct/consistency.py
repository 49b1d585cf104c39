"""Consistency test: stretches of a channel that nothing but healthy explains need no other model weighed."""

from __future__ import annotations

import numpy as np

from diagnosis.channels.sample_status import CLEAR, PAIR
from diagnosis.direct.kernel import consistent_blocks
from diagnosis.estimation.samples import Samples

_BLOCK = 32
_MARGIN = 2  # blocks beside one that is not consistent


def with_consistent(samples: Samples, noise: float) -> Samples:
    """Samples with the status `CLEAR` for pairs in stretches that look like healthy noise and nothing else.

    Parameters
    ----------
    samples : Samples
        The channel beside its reference.
    noise : float
        Standard deviation of y − x while healthy [unit of y].
    """
    status = samples.status
    consistent = np.zeros(-(-status.size // _BLOCK), dtype=np.bool_)
    consistent_blocks(samples, noise, _BLOCK, consistent)
    odd = np.flatnonzero(~consistent)
    for step in range(1, _MARGIN + 1):
        consistent[np.maximum(odd - step, 0)] = False
        consistent[np.minimum(odd + step, consistent.size - 1)] = False
    out = status.copy()
    out[np.repeat(consistent, _BLOCK)[: status.size] & (status == PAIR)] = CLEAR
    return samples._replace(status=out)
