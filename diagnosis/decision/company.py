"""What else a mission shows says how far a fault's row may be believed: how often it comes, for how long, and beside which others.

Each family of evidence states its rows by what itself sees. Of rows stated with 0.7 on simulated machines of twenty kinds those that came three times
and more, alone on their machine, were right 383 of 394 times; those stated with 0.6 once or twice beside a fault of another part 55 of 122 times, brief
ones 1 of 16. `_WEIGHTS` is a logistic regression of what was right among rows that were stated with less than `_SURELY`;
``tests/benchmarks/calibrate_company.py`` fits it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.result import FaultInterval, Hypothesis
from diagnosis.results.sentence import about_of
from diagnosis.results.vocabulary import Severity, Tier
from replay.faults import FaultMode, State

_WEIGHTS = (-0.19, 0.87, -0.78, 2.95, -1.24, 0.94)  # constant, logit of the stated probability, and of `features_of`
_SURELY, _MOST = (
    0.9,
    0.89,
)  # what is surer is stated by evidence that leaves little to company; nothing becomes as sure by it
_OFTEN, _BRIEF_S, _LONG_S = 3, 1.5, 10.0
_TOLD = 0.03  # change of a probability that is worth a sentence
_JUDGED = (Tier.DIRECT, Tier.MODEL)  # the evidence that it was fitted to
_ALONE = "nothing else found on the machine"
_WORDS = ("beside faults of other parts", "three times or more", "shorter than 1.5 s", "longer than 10 s")


class Told(NamedTuple):
    """A fault as its company sees it.

    Attributes
    ----------
    component : str
        Its wheel or axle.
    row : str
        Its side and mode.
    seconds : float
        Its length [s].
    """

    component: str
    row: str
    seconds: float


def features_of(own: Told, all_of_them: Sequence[Told]) -> NDArray[np.float64]:
    """What tells how far a row may be believed, shape (4,): other components, three times or more, brief, long; 1 or 0 each.

    Parameters
    ----------
    own : Told
        The fault.
    all_of_them : Sequence[Told]
        All faults of the mission, itself among them.
    """
    beside = any(x.component != own.component for x in all_of_them)
    often = sum(x.component == own.component and x.row == own.row for x in all_of_them) >= _OFTEN
    return np.array([beside, often, own.seconds < _BRIEF_S, own.seconds > _LONG_S], dtype=np.float64)


def believed_in_company(p: float, features: NDArray[np.float64]) -> float:
    """Probability of a row that was stated with `p` [1], by `features_of` it, shape (4,)."""
    given = np.clip(p, 0.02, 0.98)
    logit = _WEIGHTS[0] + _WEIGHTS[1] * np.log(given / (1.0 - given)) + features @ np.array(_WEIGHTS[2:])
    return float(min(1.0 / (1.0 + np.exp(-logit)), _MOST))


def in_company(faults: Sequence[FaultInterval]) -> tuple[FaultInterval, ...]:
    """Faults with probabilities that allow for each other; how urgent they are was settled by their own evidence.

    Whether anything is wrong becomes no less probable: what a row loses goes to faults that are in no row.

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
        p = believed_in_company(f.probability, features)
        return _raised(f, p, features) if p > f.probability else _lowered(f, p, features)

    return tuple(map(believed, faults))


def _told(f: FaultInterval) -> Told:
    return Told(f.component, f"{f.side} {f.mode}", f.stop_s - f.start_s)


def _raised(f: FaultInterval, p: float, features: NDArray[np.float64]) -> FaultInterval:
    own = _rows(f)
    had = sum(h.p for h in f.hypotheses if (h.side, h.mode) in own)
    if not 0.0 < had < 1.0:
        return f
    kept = [replace(h, p=h.p * (p / had if (h.side, h.mode) in own else (1.0 - p) / (1.0 - had))) for h in f.hypotheses]
    return _stated(f, p, kept, features)


def _lowered(f: FaultInterval, p: float, features: NDArray[np.float64]) -> FaultInterval:
    """The same in favour of faults that are in no row; they and health become no more probable than the row itself."""
    own, none = _rows(f), (f.side.value, FaultMode.OUTSIDE_TABLE.value)
    had = sum(h.p for h in f.hypotheses if (h.side, h.mode) in own)
    outside = sum(h.p for h in f.hypotheses if (h.side, h.mode) == none)
    healthy = sum(h.p for h in f.hypotheses if h.mode == State.HEALTHY.value)
    p = max(p, 0.5 * (had + outside), min(healthy, had))
    if f.mode is FaultMode.OUTSIDE_TABLE or not 0.0 < p < had:
        return f
    kept = [replace(h, p=h.p * p / had) if (h.side, h.mode) in own else h for h in f.hypotheses]
    others = [h for h in kept if (h.side, h.mode) != none]
    return _stated(f, p, [*others, Hypothesis(*none, outside + had - p)], features)


def _rows(f: FaultInterval) -> set[tuple[str, str]]:
    """Side and mode of the hypotheses that a fault names."""
    return {(side, f.mode.value) for side in (*(s.value for s in f.side.sides), f.side.value)}


def _stated(
    f: FaultInterval, p: float, hypotheses: Sequence[Hypothesis], features: NDArray[np.float64]
) -> FaultInterval:
    named = tuple(sorted(hypotheses, key=lambda h: -h.p))
    evidence = f.evidence
    if abs(p - f.probability) >= _TOLD:
        seen = [words for words, holds in zip(_WORDS, features, strict=True) if holds]
        like = ", ".join([*([] if features[0] else [_ALONE]), *seen])
        words = f"Findings like this one ({like}) were right in {100 * p:.0f} of 100 cases on simulated machines."
        evidence = (*evidence, words)
    return replace(f, probability=p, hypotheses=named, evidence=evidence, about=tuple(about_of(evidence)))
