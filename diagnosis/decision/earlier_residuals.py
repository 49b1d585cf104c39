"""Findings whose residual is beyond its threshold some time before the onset that is stated: then they may have begun as early as that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.decision.second_onsets import steps_between
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.arrays.runs import runs_of

Part = tuple[str, str]

_NEEDED = ("residual", "threshold")
_LOOK_S = (10.0, 5.0, 2.0, 1.0)  # before an onset, as far as the samples are kept
_ON_END, _APART_S = 5, 0.5  # readings of a run, and between runs that are one: as the page finds them
_WORTH_S = 0.3


def with_earlier_residuals(assessments: Mapping[Part, Assessment], dt: float) -> dict[Part, Assessment]:
    """The same with a sentence on each finding by a second measurement whose residual passes its threshold clearly earlier.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    dt : float
        Step [s].
    """
    return {part: _told(a, dt) for part, a in assessments.items()}


def _told(a: Assessment, dt: float) -> Assessment:
    if a.tier is not Tier.DIRECT or not a.findings or any(n not in a.columns for n in _NEEDED):
        return a
    out, before = [], 0
    for f in a.findings:
        early = _begins(f, a, before, dt)
        seconds = (f.start - early) * dt
        out.append(replace(f, evidence=(*f.evidence, _words(early * dt, seconds))) if seconds > _WORTH_S else f)
        before = f.stop
    return replace(a, findings=tuple(out))


def _words(at: float, seconds: float) -> str:
    size = f"{1e3 * seconds:.0f} ms" if seconds < 1.0 else f"{seconds:.2f} s"
    return (
        f"Its residual is beyond its threshold from {at:.2f} s on, {size} before the onset stated: "
        "it may have begun as early as that."
    )


def _begins(f: Finding, a: Assessment, before: int, dt: float) -> int:
    """First step of the stretch beyond the threshold that reaches into a finding, after the one before it; its own start where none does."""
    last = min(f.stop, f.start + max(_ON_END, round(_APART_S / dt)))
    for seconds in _LOOK_S:
        first = max(before, f.start - round(seconds / dt))
        steps = steps_between(a, _NEEDED, first, last) if first < f.start else None
        if steps is not None:
            residual, threshold = steps
            known = np.isfinite(residual) & np.isfinite(threshold)
            at = np.flatnonzero(known)
            return first + _stretch(at, (np.abs(residual) > threshold)[at], f.start - first, dt)
    return f.start


def _stretch(at: NDArray[np.intp], beyond: NDArray[np.bool_], onset: int, dt: float) -> int:
    """Where the stretch begins that lasts at an onset; readings at steps `at`, of which `beyond` pass the threshold."""
    runs = [(int(at[i]), int(at[j - 1])) for i, j in runs_of(beyond) if j - i >= _ON_END]
    start, begin = onset, None
    for a, b in reversed(runs):
        if begin is None:
            if b < onset - _APART_S / dt:
                break
        elif begin - b > _APART_S / dt:
            break
        begin = a
    return start if begin is None else min(start, begin)
