"""An effort near nothing soon after another fault of the same wheel: two loops on one body hold each other's load, as the fault left them.

A loop whose speed was read wrong pulls against the others, which wind up against it. Once it reads right the load lies otherwise between
them, until a change of speed or a stop shares it anew, so that one that pulls nothing may be sound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged
from diagnosis.response.models import LEAST_P
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from replay.faults import State

Array = NDArray[np.float64]

_SOON_S, _LEAST_S = 60.0, 4.0  # after it ended; for which it lasted
_PULLED = 0.2  # of its usual effort, in the fault before
_LESS = 0.6
_TEXT = "Not long before, its speed was read wrong, against which the drives beside it wound up: how they share the load since is no sure sign."


def after_a_fault(drives: Sequence[Finding], one: Judged, effort: Array | None, block_s: float) -> list[Finding]:
    """Drives that pull nothing, less sure soon after another fault of the wheel in which they pulled.

    Parameters
    ----------
    drives : Sequence[Finding]
        Of `diagnosis.response.effort.idle_drives`.
    one : Judged
        The wheel.
    effort : Array or None, shape (b,)
        Its mean effort of each block, in any unit.
    block_s : float
        Length of a block [s].
    """
    if effort is None or not np.isfinite(effort).any():
        return list(drives)
    usual = float(np.nanquantile(np.abs(effort), 0.75))
    wrong = [
        s
        for s in one.spells
        if s.p >= LEAST_P
        and (s.stop - s.start) * block_s >= _LEAST_S
        and np.nanmedian(np.abs(np.nan_to_num(effort[s.start : s.stop]))) > _PULLED * usual
    ]
    width = int(one.wheel.blocks.start[1])
    return [
        _less_sure(f) if any(s.stop * width <= f.start < s.stop * width + _SOON_S / one.wheel.dt for s in wrong) else f
        for f in drives
    ]


def _less_sure(found: Finding) -> Finding:
    p = _LESS * found.probability
    kept = [replace(h, p=_LESS * h.p) for h in found.hypotheses if h.side != "none"]
    rest = Hypothesis("none", State.HEALTHY.value, 1.0 - sum(h.p for h in kept))
    return replace(found, probability=p, hypotheses=(*kept, rest), evidence=(*found.evidence, _TEXT))
