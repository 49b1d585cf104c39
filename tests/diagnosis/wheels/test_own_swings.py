"""A wheel that swings at one frequency leaves open whether its sensor fails; noise, which has none, does not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.own_swings import swing_hz, with_open_side
from replay.faults import FaultMode, Side

DT, N, WIDTH = 0.01, 4_000, 2
T = np.arange(N) * DT


def noise(tau: float, seed: int, dt: float = DT) -> np.ndarray:
    """Noise through a first-order lag; white for 0."""
    white = np.random.default_rng(seed).standard_normal(N)
    if tau == 0.0:
        return white
    out, a = np.zeros(N), np.exp(-dt / tau)
    for k in range(1, N):
        out[k] = a * out[k - 1] + white[k]
    return out


@pytest.mark.parametrize("hz", [1.5, 4.0, 9.3, 20.0])
@pytest.mark.parametrize("seconds", [6.0, 40.0])
def test_a_swing_has_its_frequency(hz: float, seconds: float) -> None:
    off = (np.sin(2 * np.pi * hz * T) + 0.3 * noise(0.0, 1))[: round(seconds / DT)]
    assert swing_hz(off, DT) == pytest.approx(hz, rel=0.1)


@pytest.mark.parametrize("tau", [0.0, 0.02, 0.05, 0.1, 0.8])
@pytest.mark.parametrize("seconds", [3.0, 12.0])
def test_noise_has_none(tau: float, seconds: float) -> None:
    found = [swing_hz(noise(tau, seed)[: round(seconds / DT)], DT) for seed in range(20)]
    assert sum(f is not None for f in found) <= 1


@pytest.mark.parametrize("off", [np.zeros(N), np.full(N, np.nan), np.zeros(0), np.sin(20.0 * T[:30]), 0.01 * T])
def test_nothing_short_and_steady_have_none(off: np.ndarray) -> None:
    assert swing_hz(off, DT) is None


@pytest.mark.parametrize(
    ("off", "side"), [(np.sin(2 * np.pi * 6.0 * T), Side.SENSOR_OR_ACTUATOR), (noise(0.05, 3), Side.SENSOR)]
)
def test_the_side_of_what_swings_is_open_and_nothing_of_it_is_sure(off: np.ndarray, side: Side) -> None:
    rows = (Hypothesis("sensor", FaultMode.NOISY, 0.98), Hypothesis("none", "healthy", 0.02))
    f = Finding(1000, 2000, Side.SENSOR, FaultMode.NOISY, 0.98, rows, None, None, ("It shakes.",), Tier.MODEL)
    path: Any = SimpleNamespace(y=0.3 + 0.1 * off, expected=np.full(N // WIDTH, 0.3), width=WIDTH, dt=DT)
    (got,) = with_open_side(path, WheelFindings([f])).findings
    assert got.side is side
    assert sum(h.p for h in got.hypotheses) == pytest.approx(1.0)
    assert got.evidence[-1] == "It shakes."
    if side is Side.SENSOR_OR_ACTUATOR:
        assert got.mode is FaultMode.OUTSIDE_TABLE  # what swings is seldom noise
        assert [h.mode for h in got.hypotheses] == ["outside_table", "healthy", "noisy"]
        assert [h.p for h in got.hypotheses] == pytest.approx([0.55, 0.35, 0.1])
        assert "swings at 6" in got.evidence[0]
    else:
        assert got is f
