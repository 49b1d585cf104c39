"""What else a mission shows says how far a fault's row may be believed: how often it comes, for how long, and beside which others.

Each family of evidence states its rows by what itself sees. Of rows stated with 0.7 on simulated machines of twenty kinds those that came three times
and more, alone on their machine, were right 383 of 394 times; those stated with 0.6 once or twice while another part failed 52 of 101 times. `_WEIGHTS` is
a logistic regression of what was right among rows that were stated with less than `_SURELY`; ``tests/benchmarks/calibrate_company.py`` fits it. What it
would lower stays: missions of the campaigns have one fault, others have several, which are right beside each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.result import FaultInterval
from diagnosis.results.sentence import about_of
from diagnosis.results.vocabulary import Severity, Tier

_WEIGHTS = (-0.26, 0.88, -0.64, 3.00, -1.31, 0.97)  # constant, logit of the stated probability, and of `features_of`
_SURELY, _MOST = (
    0.9,
    0.89,
)  # what is surer is stated by evidence that leaves little to company; nothing becomes as sure by it
_OFTEN, _BRIEF_S, _LONG_S, _BESIDE_S = 3, 1.5, 10.0, 1.0
_TOLD = 0.03  # change of a probability that is worth a sentence
_JUDGED = (Tier.DIRECT, Tier.MODEL)  # the evidence that it was fitted to
_ALONE = "no other part failed at the same time"
_WORDS = ("while another part failed", "three times or more", "shorter than 1.5 s", "longer than 10 s")


class Told(NamedTuple):
    """A fault as its company sees it.

    Attributes
    ----------
    component : str
        Its wheel or axle.
    row : str
        Its side and mode.
    start_s, stop_s : float
        Mission time [s].
    """

    component: str
    row: str
    start_s: float
    stop_s: float


def features_of(own: Told, all_of_them: Sequence[Told]) -> NDArray[np.float64]:
    """What tells how far a row may be believed, shape (4,): another component at the time, three times or more, brief, long; 1 or 0 each.

    Parameters
    ----------
    own : Told
        The fault.
    all_of_them : Sequence[Told]
        All faults of the mission, itself among them.
    """
    beside = any(
        x.component != own.component and x.start_s < own.stop_s + _BESIDE_S and x.stop_s > own.start_s - _BESIDE_S
        for x in all_of_them
    )
    often = sum(x.component == own.component and x.row == own.row for x in all_of_them) >= _OFTEN
    seconds = own.stop_s - own.start_s
    return np.array([beside, often, seconds < _BRIEF_S, seconds > _LONG_S], dtype=np.float64)


def believed_in_company(p: float, features: NDArray[np.float64]) -> float:
    """Probability of a row that was stated with `p` [1], by `features_of` it, shape (4,); no less than that, and no more than 0.89."""
    given = np.clip(p, 0.02, 0.98)
    logit = _WEIGHTS[0] + _WEIGHTS[1] * np.log(given / (1.0 - given)) + features @ np.array(_WEIGHTS[2:])
    return max(p, float(min(1.0 / (1.0 + np.exp(-logit)), _MOST)))


def in_company(faults: Sequence[FaultInterval]) -> tuple[FaultInterval, ...]:
    """Faults with probabilities that allow for each other; how urgent they are was settled by their own evidence.

    Parameters
    ----------
    faults : Sequence[FaultInterval]
        All faults of a mission.
    """
    told = {f.id: _told(f) for f in faults if f.severity is not Severity.INFO}
    all_of_them = list(told.values())

    def believed(f: FaultInterval) -> FaultInterval:
        if f.id not in told or f.tier not in _JUDGED or f.probability >= _SURELY:
            return f
        features = features_of(told[f.id], all_of_them)
        return _with(f, believed_in_company(f.probability, features), features)

    return tuple(map(believed, faults))


def _told(f: FaultInterval) -> Told:
    return Told(f.component, f"{f.side} {f.mode}", f.start_s, f.stop_s)


def _with(f: FaultInterval, p: float, features: NDArray[np.float64]) -> FaultInterval:
    """The same with a row that has a probability, and all others by what is left."""
    own = {(side, f.mode.value) for side in (*(s.value for s in f.side.sides), f.side.value)}
    had = sum(h.p for h in f.hypotheses if (h.side, h.mode) in own)
    if p <= f.probability or not 0.0 < had < 1.0:
        return f
    kept = [replace(h, p=h.p * (p / had if (h.side, h.mode) in own else (1.0 - p) / (1.0 - had))) for h in f.hypotheses]
    evidence = f.evidence
    if p - f.probability >= _TOLD:
        seen = [words for words, holds in zip(_WORDS, features, strict=True) if holds]
        like = ", ".join([*([] if features[0] else [_ALONE]), *seen])
        words = f"Findings like this one ({like}) were right in {100 * p:.0f} of 100 cases on simulated machines."
        evidence = (*evidence, words)
    hypotheses = tuple(sorted(kept, key=lambda h: -h.p))
    return replace(f, probability=p, hypotheses=hypotheses, evidence=evidence, about=tuple(about_of(evidence)))
