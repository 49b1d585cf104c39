"""A lone channel that is noisy for half of a mission is noisy, and one that is rougher at speed or on other ground is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.response.assess import assess_response
from replay.faults import FaultMode
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, Array, followers_of, geometry, speeds


def modes(noise: Array, seed: int = 6) -> list[tuple[FaultMode, float, float]]:
    measured, asked, body = speeds(seed, ("FR",))
    measured["FR"] = measured["FR"] + noise * np.random.default_rng(seed).normal(size=noise.size)
    parts = assess_response(followers_of(measured, asked, body[:, :1]), geometry(("FR",)), None, Limits(), DT).parts
    return [(f.mode, f.start * DT, f.stop * DT) for f in parts["FR"][0].findings]


N = speeds(6)[2].shape[0]
AT = np.arange(N)


@pytest.mark.parametrize(("first", "last"), [(0.5, 1.0), (0.25, 0.7), (0.0, 0.5)])
def test_noise_of_half_a_mission_is_found(first: float, last: float) -> None:
    noise = np.where((first * N <= AT) & (last * N > AT), 0.15, 0.0)
    found = [(a, b) for mode, a, b in modes(noise) if mode is FaultMode.NOISY]
    assert found
    length = sum(min(b, last * N * DT) - max(a, first * N * DT) for a, b in found)
    assert length > 0.7 * (last - first) * N * DT


def test_rougher_ground_and_a_channel_that_is_noisy_all_along_are_no_fault() -> None:
    assert modes(np.where(0.4 * N < AT, 0.015, 0.0)) == []
    assert modes(np.full(N, 0.05)) == []


def of_four(noisy: tuple[str, ...], level: float, seed: int = 3) -> set[tuple[str, FaultMode]]:
    measured, asked, body = speeds(seed)
    n = body.shape[0]
    rng = np.random.default_rng(seed)
    for w in noisy:
        measured[w] = measured[w] + np.where(np.arange(n) < 0.3 * n, level, 0.0) * rng.normal(size=n)
    nothing = np.full(n, np.nan)
    data = {
        w: replace(d, commands=np.full_like(d.commands, np.nan), asked=nothing)
        for w, d in followers_of(measured, asked, body).items()
    }
    parts = assess_response(data, geometry(), None, Limits(), DT).parts
    return {(w, f.mode) for w, sides in parts.items() for a in sides for f in a.findings}


def test_noise_of_one_of_several_wheels_without_commands_is_found_and_ground_that_shakes_all_is_none() -> None:
    assert of_four(("RL",), 0.1) == {("RL", FaultMode.NOISY)}
    assert of_four(("FR", "FL", "RR", "RL"), 0.1) == set()
    assert of_four(("RL",), 0.005) == set()
