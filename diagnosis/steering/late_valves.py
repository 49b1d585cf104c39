"""A steering valve whose measured opening follows its command with a lag is late, and neither stuck, nor weak, nor noisy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.lag import low_passed
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, Sentence, is_about
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LAGS_S = tuple(0.15 * 1.3**k for k in range(11))  # to 2.1 s
_AROUND_S = 1.0, 2.0  # before and after a finding, in which a lag shows as well
_MOVES, _FEW = 0.05, 25  # of full opening, that command and opening vary by; readings
_LEFT = 0.15  # of the power by which an opening is off its command: what a lag may leave of it
_P = 0.9


def as_late(findings: Sequence[Finding], opening: Array, command: Array, use: Flags, dt: float) -> list[Finding]:
    """Findings of a valve, those outside the tables that a lag of the measured opening explains, and what comes just before and after as well.

    Parameters
    ----------
    findings : Sequence[Finding]
        Of one valve, in order of time.
    opening, command : Array, shape (n,)
        What is measured of it, and what it is told [of full opening].
    use : Flags, shape (n,)
        Where both are new.
    dt : float
        Step [s].
    """
    if not findings:
        return []
    known = np.isfinite(command)
    told = command if known.all() else np.interp(np.arange(command.size), np.flatnonzero(known), command[known])
    out = []
    for f in findings:
        lag = _lag_of(f, opening, told, use, dt)
        out.append(f if lag is None else _late(f, lag))
    return out


def _lag_of(f: Finding, opening: Array, told: Array, use: Flags, dt: float) -> float | None:
    """Time constant [s] with which an opening follows its command in and about a finding; None where that explains it no better than no lag."""
    first = max(0, f.start - round(_AROUND_S[0] / dt))
    part = slice(first, min(told.size, f.stop + round(_AROUND_S[1] / dt)))
    lead = max(0, first - round(4.0 * _LAGS_S[-1] / dt))
    own = use[part]
    y, x = opening[part][own], told[part][own]
    if y.size < _FEW or min(np.std(y), np.std(x)) < _MOVES:
        return None
    off = float(np.sum((y - x) ** 2))
    left = {}
    for lag in _LAGS_S:
        z = low_passed(told[lead : part.stop], lag, dt)[first - lead :][own]
        left[lag] = float(np.sum((y - z) ** 2))
    best = min(left, key=lambda lag: left[lag])
    return best if left[best] < _LEFT * off else None


def _late(f: Finding, lag: float) -> Finding:
    text = Sentence(
        About.LATE,
        "The measured opening follows its command with a lag of ",
        f"{1e3 * lag:.0f}",
        " ms: it is late, and answers.",
    )
    return replace(
        f,
        mode=FaultMode.OUTSIDE_TABLE,
        probability=_P,
        hypotheses=(
            Hypothesis(Side.ACTUATOR.value, FaultMode.OUTSIDE_TABLE.value, _P),
            Hypothesis("none", State.HEALTHY.value, 1.0 - _P),
        ),
        epsilon=None,
        sat=None,
        evidence=(text, *(e for e in f.evidence if not is_about(e, About.TIMES))),
    )
