"""Bursts of noise that are one thing: single readings that are far off while all others are right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.sentence import About, is_about
from diagnosis.results.sizes import amount

_FAR = 6.0  # times the noise: a spike
_MOST, _LEAST = 0.12, 5  # of the readings are spikes, and so many at least
_BRIEF, _MOSTLY = 2, 0.8  # readings in a row; of the spikes that are no longer
_POWER = 0.9  # of a deviation, that spikes make


def with_spikes(findings: Sequence[Finding], measured: Measured) -> list[Finding]:
    """Findings of one side, several bursts of noise joined where all of it is spikes.

    Parameters
    ----------
    findings : Sequence[Finding]
        Of one side.
    measured : Measured
        Its channel and reference.
    """
    bursts = [f for f in findings if f.mode.varying]
    if len(bursts) < 2:
        return list(findings)
    first, last = min(f.start for f in bursts), max(f.stop for f in bursts)
    if any(not f.mode.varying and f.start < last and f.stop > first for f in findings):
        return list(findings)
    y, x = measured.y[first:last], measured.x[first:last]
    known = measured.use[first:last] & np.isfinite(y) & np.isfinite(x)
    off = (y - x)[known]
    size = np.abs(off - np.median(off))
    far = size > _FAR * measured.noise
    edges = np.flatnonzero(np.diff(np.r_[False, far, False].astype(np.int8)))
    runs = edges[1::2] - edges[::2]
    number = int(np.count_nonzero(far))
    if not _LEAST <= number <= _MOST * size.size or float(np.mean(runs <= _BRIEF)) < _MOSTLY:
        return list(findings)
    if float(np.sum(size[far] ** 2)) < _POWER * float(np.sum(size**2)):
        return list(findings)
    surest = max(bursts, key=lambda f: f.probability)
    words = (
        f"Spikes: {number} of {size.size} readings are off by about {amount(float(np.median(size[far])), measured.unit, 2)}, one or two "
        "at a time; the others are not."
    )
    raised = [f.detected for f in bursts if f.detected is not None]
    joined = replace(
        surest,
        start=first,
        stop=last,
        epsilon=None,
        sat=None,
        evidence=(words, *(e for e in surest.evidence if is_about(e, About.TIMES))),
        detected=min(raised, default=None),
    )
    return sorted([joined, *(f for f in findings if not f.mode.varying)], key=lambda f: f.start)
