"""What a mission of a single drive would have shown: against faults of that very size, laid into noise and looked for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.drives.findings import find_rows, thinnest
from diagnosis.drives.load import track_steps
from diagnosis.drives.load_findings import load_stretches
from diagnosis.drives.path import SpeedSamples
from diagnosis.drives.power import added_noise, load_powers, noncentrality, sensor_powers
from diagnosis.drives.speed_pair import SpeedPair
from diagnosis.results.detectability import Deviation
from replay.machine.config import Limits
from replay.machine.drive_model import EffortMap

Array = NDArray[np.float64]
Fault = Callable[[Array, np.random.Generator], Array]

LIMITS = Limits(min_epsilon=1e-3, min_sat=1e-3, driving_speed=0.1)
DT, NOISE, SPEED = 0.01, 0.2, 2.0
LENGTH = round(2.0 / DT)
MISSIONS = 40


def pair(seed: int, kept: float = 0.0, fault: Fault | None = None) -> SpeedPair:
    """Six seconds at one speed, a fault in the middle two; errors keep the share `kept` from sample to sample."""
    rng, n = np.random.default_rng(seed), 3 * LENGTH
    error = np.zeros(n + 100)
    for k in range(1, error.size):
        error[k] = kept * error[k - 1] + np.sqrt(1 - kept**2) * rng.normal(0, NOISE)
    y = SPEED + error[100:]
    if fault is not None:
        y[LENGTH : 2 * LENGTH] = fault(y[LENGTH : 2 * LENGTH], rng)
    status = np.full(n, PAIR, dtype=np.int8)
    samples = SpeedSamples(y, np.full(n, SPEED), np.zeros(n), status, np.zeros(n, dtype=np.bool_))
    return SpeedPair(samples, 0, NOISE, NOISE, 0.9, 1e-6, 10.0, DT, "v")


def found(fault: Fault, kept: float) -> float:
    """Share of the missions in which something is found where the fault is."""
    hits = 0
    for seed in range(MISSIONS):
        findings, _, _ = find_rows(pair(seed, kept, fault), LIMITS)
        hits += any(f.start < 2 * LENGTH and f.stop > LENGTH for f in findings)
    return hits / MISSIONS


def stated(deviation: Deviation) -> float:
    rows = {(p.deviation, p.for_s): p.size for p in sensor_powers(pair(0), LIMITS).rows}
    size = rows[deviation, 2.0]
    assert size is not None
    return size


@pytest.mark.parametrize("kept", [0.0, 0.6])
def test_a_loss_of_the_stated_size_is_found_in_95_of_100(kept: float) -> None:
    """Errors that keep .6 have (1 + .6)/(1 − .6) = 4 samples that count as one, as the statement assumes."""
    size = stated(Deviation.INEFFICIENT)
    assert found(lambda y, rng: (1 - size) * y, kept) >= 0.9


@pytest.mark.parametrize("kept", [0.0, 0.6])
def test_noise_of_the_stated_size_is_found_in_95_of_100(kept: float) -> None:
    size = stated(Deviation.NOISY)
    assert found(lambda y, rng: y + rng.normal(0, size, y.size), kept) >= 0.9


def test_noise_that_lasts_all_through_is_taken_for_the_drives_own() -> None:
    rows = sensor_powers(pair(0), LIMITS).rows
    assert [p.size for p in rows if p.deviation is Deviation.NOISY and p.for_s is None] == [None]


def test_half_the_stated_loss_is_not_found_as_often() -> None:
    size = stated(Deviation.INEFFICIENT)
    assert found(lambda y, rng: (1 - 0.5 * size) * y, 0.6) < 0.7


def test_the_size_follows_from_threshold_and_noncentrality() -> None:
    needed = thinnest(float(np.log(60 / DT * 8)), ends=True)
    d = noncentrality(needed)
    assert d**2 / 2 - 1.645 * d == pytest.approx(needed)
    assert stated(Deviation.INEFFICIENT) == pytest.approx(d * NOISE / SPEED / np.sqrt(LENGTH / 4))
    assert stated(Deviation.NOISY) == pytest.approx(NOISE * added_noise(np.array([LENGTH / 4]), needed)[0])


def test_added_noise_is_never_below_the_weakest_state() -> None:
    sizes = added_noise(np.array([3.0, 30.0, 300.0, 3e6]), 21.6)
    assert (np.diff(sizes) <= 0).all()
    assert sizes[-1] == 0.5
    assert np.isinf(added_noise(np.array([0.5]), 21.6)[0])


@pytest.mark.parametrize("seconds", [2.0, 10.0, None])
@pytest.mark.parametrize(
    "effort", [EffortMap(0.1, 0.05, 0.01, 0.001, 0.004, 1.0, 5.0), EffortMap(0.1, 0.05, 0.02, 0.001, 0.01, 1.0, 5.0)]
)
def test_a_load_of_the_stated_size_is_found_in_95_of_100(effort: EffortMap, seconds: float | None) -> None:
    needed, limits, steps = np.full(120, 0.25), Limits(), 120
    part = slice(0, steps) if seconds is None else slice(40, 40 + round(seconds))
    stated = load_powers(track_steps(needed, needed, effort, 1), effort, limits).rows
    (share,) = [p.size for p in stated if p.for_s == seconds]
    assert share is not None
    load, hits = 0.25 * share / (1 - share), 0
    for seed in range(MISSIONS):
        rng = np.random.default_rng(seed)
        used = needed + rng.normal(0, effort.between) + np.cumsum(rng.normal(0, effort.drift, steps))
        used += rng.normal(0, effort.noise, steps)
        used[part] += load
        found = load_stretches(track_steps(needed, used, effort, 1), effort.between, limits, 1.0)
        hits += any(s.start < part.stop and s.stop > part.start for s in found)
    assert hits >= 0.9 * MISSIONS
