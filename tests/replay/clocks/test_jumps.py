"""Clocks that jump, pauses of a recording, drift that changes, and files that hold the very same samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.clocks.align import estimate
from replay.clocks.source_clock import SourceClock
from replay.log.source_options import SignalSource
from replay.signals.signal import Signal
from tests.campaigns import campaign

Array = NDArray[np.float64]

T0 = 1_760_000_000_000_000_000
DURATION = 90.0
PLC = np.arange(0.0, DURATION, 0.002)
ROS = np.arange(2.0, DURATION - 2.0, 0.01)
WHEELS = ("FR", "FL", "RR")


def drive(t: Array, still: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Speed of a random drive [m/s]: ramps between levels, none from `still[0]` to `still[1]` seconds."""
    rng = np.random.default_rng(3)
    edges = np.cumsum(rng.uniform(1.0, 4.0, 60))
    levels = rng.uniform(-0.3, 0.3, edges.size)
    levels[(edges > still[0]) & (edges < still[1])] = 0.0
    knots = np.concatenate([edges, edges[1:] - 0.5])
    order = np.argsort(knots)
    return np.asarray(np.interp(t, knots[order], np.concatenate([levels, levels[:-1]])[order]), np.float64)


def recorded(
    t: Array, own: Array, seed: int, wheels: int, still: tuple[float, float] = (0.0, 0.0)
) -> dict[str, Signal]:
    """Signals of samples at true times that were stamped with `own` ones [s]."""
    rng = np.random.default_rng(seed)
    stamps = T0 + np.rint(own * 1e9).astype(np.int64)
    return {
        f"wheel.{w}.v": Signal(
            f"wheel.{w}.v",
            stamps,
            np.round(drive(t, still) + 0.003 * rng.standard_normal(t.size), 3),
            SignalSource(column=w),
            "",
            True,
        )
        for w in WHEELS[:wheels]
    }


def compared(own: Array, wheels: int = 1, still: tuple[float, float] = (0.0, 0.0)) -> tuple[SourceClock, float]:
    """What is stated of a ROS side with such stamps, and the largest error of its stamps [s]; NaN where it was refused."""
    ros = recorded(ROS, own, 2, wheels, still)
    clock, line, between = estimate(recorded(PLC, PLC, 1, wheels, still), ros)
    if line is None:
        return clock, np.nan
    stamps = ros["wheel.FR.v"].stamps
    moved = (stamps - T0 + between) * 1e-9 + line.lag((stamps - stamps[0]) * 1e-9)
    return clock, float(np.abs((moved if clock.method == "estimated" else own) - ROS).max())


@pytest.mark.turns("wheels")
@pytest.mark.parametrize("wheels", [1, 3])
@pytest.mark.parametrize("place", [0.1, 0.25, 0.5, 0.75, 0.9])
@pytest.mark.parametrize("step", [0.02, 0.1, 0.5, 2.0, 5.0])
def test_a_clock_that_jumps_is_refused_or_within_its_bound(step: float, place: float, wheels: int) -> None:
    own = ROS + 0.3 + 60e-6 * ROS + np.where(2.0 + place * (DURATION - 4.0) < ROS, step, 0.0)
    clock, error = compared(own, wheels)
    if clock.reason:
        assert clock.method == "as recorded"
    else:
        assert clock.uncertainty_s is not None
        assert error <= clock.uncertainty_s


@pytest.mark.parametrize("step", [0.2, 2.0])
def test_a_reference_that_jumps_is_refused(step: float) -> None:
    own = ROS + np.where(ROS > 40.0, step, 0.0)
    clock, line, _ = estimate(recorded(ROS, own, 2, 3), recorded(PLC, PLC, 1, 3))
    assert line is None
    assert f"{-step:+.3f} s" in clock.reason or "jump" in clock.reason


def test_place_and_size_of_a_jump_are_told() -> None:
    clock, _ = compared(ROS + np.where(ROS > 47.0, 2.0, 0.0), 3)
    assert "jumps by +2.000 s" in clock.reason
    assert "45 s after its start" in clock.reason or "46 s after its start" in clock.reason


@pytest.mark.parametrize("step", [-0.5, -2.0])
def test_a_clock_that_was_set_back_and_repaired(step: float) -> None:
    """No stamp pauses: samples of the doubled time are gone."""
    own = ROS + np.where(ROS > 45.0, step, 0.0)
    kept = (ROS <= 45.0) | (45.0 - step < ROS)
    ros = {n: replace(s, stamps=s.stamps[kept], values=s.values[kept]) for n, s in recorded(ROS, own, 2, 3).items()}
    clock, line, _ = estimate(recorded(PLC, PLC, 1, 3), ros)
    assert line is None
    assert clock.reason


@pytest.mark.parametrize("wheels", [1, 3])
def test_a_pause_of_the_recording_is_no_jump(wheels: int) -> None:
    kept = (ROS < 30.0) | (ROS > 34.0)
    ros = {
        n: replace(s, stamps=s.stamps[kept], values=s.values[kept])
        for n, s in recorded(ROS, ROS + 0.3, 2, wheels).items()
    }
    clock, line, _ = estimate(recorded(PLC, PLC, 1, wheels), ros)
    assert line is not None, clock.reason
    assert clock.offset_s == pytest.approx(-0.3, abs=2e-3)


@pytest.mark.parametrize("wheels", campaign([1, 3]))
def test_a_recording_that_often_loses_samples_is_aligned(wheels: int) -> None:
    kept = np.abs(ROS % 5.0 - 2.5) > 0.03
    ros = {
        n: replace(s, stamps=s.stamps[kept], values=s.values[kept])
        for n, s in recorded(ROS, ROS + 0.3, 2, wheels, (70.0, 100.0)).items()
    }
    clock, line, _ = estimate(recorded(PLC, PLC, 1, wheels, (70.0, 100.0)), ros)
    assert line is not None, clock.reason
    assert clock.offset_s == pytest.approx(-0.3, abs=5e-3)


def test_a_pause_after_which_nothing_moves_stays_open() -> None:
    own = ROS + 0.3 + np.where(ROS > 80.0, 1.0, 0.0)
    clock, _ = compared(own, 1, still=(70.0, 100.0))
    assert "clock that was set" in clock.reason


@pytest.mark.turns("change")
@pytest.mark.parametrize("change", [30e-6, -30e-6])
@pytest.mark.parametrize("place", [20.0, 45.0, 70.0])
def test_a_drift_that_changes_stays_within_the_bound(change: float, place: float) -> None:
    clock, error = compared(ROS + 0.3 + 20e-6 * ROS + change * np.maximum(ROS - place, 0.0), 3)
    assert clock.uncertainty_s is not None
    assert error <= clock.uncertainty_s < 4e-3


@pytest.mark.parametrize("rate", [100.0, 200.0, 1000.0])
def test_copies_of_all_samples_give_the_offset_exactly(rate: float) -> None:
    t = np.arange(0.0, DURATION, 1.0 / rate)
    one = recorded(t, t, 1, 2)
    own = T0 + np.rint((t + 0.3 + 60e-6 * t) * 1e9).astype(np.int64)
    clock, line, _ = estimate(one, {n: replace(s, stamps=own) for n, s in one.items()})
    assert line is not None, clock.reason
    assert clock.offset_s == pytest.approx(-0.3, abs=0.01 / rate)
    assert clock.drift_ppm == pytest.approx(-60.0, abs=0.5)
    assert clock.uncertainty_s is not None
    assert clock.uncertainty_s < 0.3 / rate


def test_newest_samples_at_an_equal_rate_are_not_taken_for_copies() -> None:
    """A recorder of its own pace repeats what was newest: a sample is up to a period old."""
    t = np.arange(0.0, DURATION, 0.005)
    one = recorded(t, t, 1, 2)
    sent = t[200:-200] * (1 + 40e-6) + 0.001 + np.random.default_rng(5).uniform(0.0, 0.002, t.size - 400)
    newest = np.searchsorted(t, sent, side="right") - 1
    own = T0 + np.rint((sent + 0.3) * 1e9).astype(np.int64)
    clock, line, between = estimate(one, {n: replace(s, stamps=own, values=s.values[newest]) for n, s in one.items()})
    assert line is not None
    error = (own - T0 + between) * 1e-9 + line.lag((own - own[0]) * 1e-9) - sent
    assert clock.uncertainty_s is not None
    assert np.abs(error).max() < clock.uncertainty_s
