"""A loss that tells little alone and is told by another fault of its part: one pair of bounds in table and sentence."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from diagnosis.direct.same_share import as_beside
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

PAIR: Any = SimpleNamespace(pair=SimpleNamespace(span=1.0))


def loss(mode: FaultMode, epsilon: Epsilon, p: float, other: float = 0.0) -> Finding:
    second = FaultMode.INEFFICIENT if mode is FaultMode.NOISY else FaultMode.NOISY
    rows = (Hypothesis("actuator", mode, p), Hypothesis("actuator", second, other))
    said = (
        f"y followed {1 - epsilon.value:.3f} × u (95 %: {1 - epsilon.high:.3f} to {1 - epsilon.low:.3f}) over 4 s.",
        "The rest has a mean of 0 and a root mean square of 0, which is ε̂ × sat; healthy noise is 0.",
    )
    return Finding(
        start=0,
        stop=400,
        side=Side.ACTUATOR,
        mode=mode,
        probability=p,
        hypotheses=rows,
        epsilon=epsilon,
        sat=Sat(0.0, 0.0, 0.0, 0.0, "1"),
        evidence=said,
        tier=Tier.DIRECT,
    )


def test_the_sentence_states_the_bounds_of_the_table() -> None:
    vague = loss(FaultMode.NOISY, Epsilon(0.45, 0.15, 0.75), 0.6, 0.3)
    sharp = loss(FaultMode.INEFFICIENT, Epsilon(0.46, 0.45, 0.47), 0.95)
    found = as_beside(vague, [vague, sharp], PAIR)
    assert found.mode is FaultMode.INEFFICIENT
    assert found.epsilon is not None
    assert (found.epsilon.low, found.epsilon.high) == pytest.approx((0.40, 0.50))
    assert found.evidence[0] == "y followed 0.550 × u (95 %: 0.500 to 0.600) over 4 s."
    assert not any("ε̂ × sat" in e for e in found.evidence)
    assert as_beside(replace(vague, epsilon=Epsilon(0.8, 0.7, 0.9)), [vague, sharp], PAIR).mode is FaultMode.NOISY
