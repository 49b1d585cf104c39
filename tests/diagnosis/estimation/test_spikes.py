"""Bursts that are single wild readings are one finding; noise, and other faults between them, are not."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.estimation.simple_causes import Measured
from diagnosis.estimation.spikes import with_spikes
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

SIZE, DT, NOISE = 6000, 0.01, 0.004
ALWAYS = np.ones(SIZE, np.bool_)


def finding(start: int, stop: int, mode: FaultMode = FaultMode.NOISY, p: float = 0.95) -> Finding:
    rows = (Hypothesis("sensor", mode, p),)
    return Finding(start, stop, Side.SENSOR, mode, p, rows, None, None, ("old",), Tier.DIRECT, start + 3)


def measured(off: np.ndarray) -> Measured:
    rng = np.random.default_rng(2)
    x = 0.3 * np.sin(np.arange(SIZE) * DT)
    return Measured(x + off + NOISE * rng.standard_normal(SIZE), x, ALWAYS, DT, ("a", "b"), "m/s", NOISE, 0.02)


def spikes(share: float = 0.03) -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.where(rng.random(SIZE) < share, 0.3 * rng.choice((-1.0, 1.0), SIZE), 0.0)


BURSTS = [finding(500, 520), finding(1800, 1840, p=0.98), finding(5200, 5230)]


def test_spikes_are_one_finding_from_the_first_to_the_last() -> None:
    (found,) = with_spikes(BURSTS, measured(spikes()))
    assert (found.start, found.stop, found.mode, found.probability, found.detected) == (
        500,
        5230,
        FaultMode.NOISY,
        0.98,
        503,
    )
    assert found.evidence[0].startswith("Spikes: ")
    assert "off by about 0.3 {speed_unit}" in found.evidence[0]


@pytest.mark.parametrize(
    "off",
    [
        0.05 * np.random.default_rng(4).standard_normal(SIZE),
        spikes(0.4),
        np.where(np.arange(SIZE) % 500 < 40, 0.3, 0.0),
        np.zeros(SIZE),
    ],
    ids=["noise", "more wild readings than others", "long bursts", "nothing"],
)
def test_other_noise_stays_as_it_is(off: np.ndarray) -> None:
    assert with_spikes(BURSTS, measured(off)) == BURSTS


def test_another_fault_between_them_keeps_them_apart() -> None:
    mixed = [*BURSTS, finding(2000, 2500, FaultMode.STUCK)]
    assert with_spikes(mixed, measured(spikes())) == mixed
    assert with_spikes(BURSTS[:1], measured(spikes())) == BURSTS[:1]
