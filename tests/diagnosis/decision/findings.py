"""Findings and assessed parts of a small machine."""

from __future__ import annotations

import numpy as np

from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits, haulotte

N, STEP = 30_000, 1_000_000  # 30 s at 1 kHz
LIMITS = Limits()
MACHINE = haulotte()
WHEELS, AXLES = ("FR", "FL"), ("front",)
SIDES = ("sensor", "actuator")


def finding(
    side: Side, mode: FaultMode, start: int = 1000, stop: int = 9000, p: float = 0.99, epsilon: float | None = 1.0
) -> Finding:
    return Finding(
        start=start,
        stop=stop,
        side=side,
        mode=mode,
        probability=p,
        hypotheses=(Hypothesis(side.value, mode.value, p), Hypothesis(side.value, "healthy", 1 - p)),
        epsilon=None if epsilon is None else Epsilon(epsilon, epsilon - 0.01, epsilon + 0.01),
        sat=None,
        evidence=("what decided",),
        tier=Tier.DIRECT,
    )


def assessed(*findings: Finding) -> Assessment:
    states = np.full(N, CODE[State.HEALTHY])
    for f in findings:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    return Assessment(states=states, findings=findings, tier=Tier.DIRECT)


def machine(**parts: Assessment) -> dict[tuple[str, str], Assessment]:
    """Assessments of two wheels and an axle, healthy but for `parts` (``FR_sensor=…``)."""
    keys = [(c, s) for c in (*WHEELS, *AXLES) for s in SIDES]
    return {(c, s): parts.get(f"{c}_{s}", assessed()) for c, s in keys}
