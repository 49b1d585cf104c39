"""Pieces with a time between them in which their common cause would show and does not: they are not one fault."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.estimation.simple_causes import Cause, Measured
from diagnosis.results.assessment import Finding

_LEAST_S = 0.5  # of a gap that tells
_MARKED = 0.5  # of what a cause makes of the gap, root mean square: less is none of it
_BEYOND = 3.0  # times the noise: a cause that makes less would not show


def parted(near: Sequence[Finding], cause: Cause, measured: Measured) -> list[list[Finding]]:
    """Pieces in groups of those with no such gap between them.

    Parameters
    ----------
    near : Sequence[Finding]
        Of one part, in order of time.
    cause : Cause
        What explains them together; one that changes with time, or is late, parts nothing.
    measured : Measured
        The part's channel and reference.
    """
    if cause.changes or cause.late or not cause.at.size:
        return [list(near)]
    usual = float(np.median((measured.y - measured.x)[cause.at]))
    groups: list[list[Finding]] = []
    for f in near:
        if groups and not _tells(max(g.stop for g in groups[-1]), f.start, cause, usual, measured):
            groups[-1].append(f)
        else:
            groups.append([f])
    return groups


def _tells(start: int, stop: int, cause: Cause, usual: float, measured: Measured) -> bool:
    """Whether steps [start, stop) would show a cause and do not; `usual`: an offset's size [unit]."""
    inside = slice(start, max(start, stop))
    x, off = measured.x[inside], (measured.y - measured.x)[inside]
    known = measured.use[inside] & np.isfinite(off)
    apart = np.diff(np.flatnonzero(measured.use))  # readings may be further apart than steps
    every = measured.dt * float(np.median(apart)) if apart.size else measured.dt
    if np.count_nonzero(known) * every < _LEAST_S:
        return False
    made = np.full(x.size, usual) if cause.epsilon is None else -cause.epsilon.value * x
    expected = float(np.sqrt(np.mean(made[known] ** 2)))
    return expected > _BEYOND * measured.noise and float(np.sqrt(np.mean(off[known] ** 2))) < _MARKED * expected
