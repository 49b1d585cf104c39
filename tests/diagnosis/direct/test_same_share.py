"""A loss that tells little alone and is told by another fault of its part: one pair of bounds in table and sentence."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.channels.sample_status import PAIR as PAIR_STATUS
from diagnosis.direct.same_share import as_beside, as_excess_beside
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.sentence import About, Sentence
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

PAIR: Any = SimpleNamespace(pair=SimpleNamespace(span=1.0))


def loss(mode: FaultMode, epsilon: Epsilon, p: float, other: float = 0.0) -> Finding:
    second = FaultMode.INEFFICIENT if mode is FaultMode.NOISY else FaultMode.NOISY
    rows = (Hypothesis("actuator", mode, p), Hypothesis("actuator", second, other))
    said = (
        Sentence(
            About.SHARE,
            f"y followed {1 - epsilon.value:.3f} × u ",
            f"(95 %: {1 - epsilon.high:.3f} to {1 - epsilon.low:.3f})",
            " over 4 s.",
        ),
        Sentence(
            About.SAT, "The rest has a mean of 0 and a root mean square of 0, which is ε̂ × sat; healthy noise is 0."
        ),
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


def excess(mode: FaultMode, epsilon: Epsilon, start: int, stop: int) -> Finding:
    rows = (Hypothesis("actuator", mode, 0.9), Hypothesis("actuator", FaultMode.NOISY, 0.1))
    return Finding(start, stop, Side.ACTUATOR, mode, 0.9, rows, epsilon, None, ("said",), Tier.DIRECT)


@pytest.mark.parametrize(("stands", "asked", "words"), [(0.84, 0.7, "same excess"), (1.0, 0.93, "stands at its end")])
def test_a_constant_at_the_excess_of_another_fault_or_at_the_end_is_no_stuck_one(
    stands: float, asked: float, words: str
) -> None:
    x = np.r_[0.5 * np.sin(np.arange(400) * 0.05), np.full(400, asked)]
    y = np.r_[1.2 * x[:400], np.full(400, stands)]
    samples = SimpleNamespace(part=lambda a, b: (y[a:b], x[a:b], np.full(b - a, PAIR_STATUS)))
    found: Any = SimpleNamespace(pair=SimpleNamespace(span=1.0, y=y), samples=samples)
    moving = excess(FaultMode.OUTSIDE_TABLE, Epsilon(-0.2, -0.25, -0.15), 0, 400)
    stuck = excess(FaultMode.STUCK, Epsilon(1.0, 0.9, 1.0), 400, 800)
    told = as_excess_beside(stuck, [moving, stuck], found)
    assert told.mode is FaultMode.OUTSIDE_TABLE
    assert sum(h.p for h in told.hypotheses) == pytest.approx(1.0)
    assert words in told.evidence[-1]
    assert as_excess_beside(stuck, [stuck], found) is stuck
    x[400:] = 0.2  # it is told to leave its place
    assert as_excess_beside(stuck, [moving, stuck], found) is stuck


def test_a_gain_that_no_row_has_is_told_by_its_bounds() -> None:
    assert Epsilon(-0.3, -0.5, -0.1).exceeds_table(0.1) == pytest.approx(0.975, abs=0.001)
    assert Epsilon(0.1, 0.0, 0.2).exceeds_table(0.1) < 1e-3
    assert Epsilon(-0.3, -0.3, -0.3).exceeds_table(0.1) == 1.0
