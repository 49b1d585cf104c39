"""What healthy channels beside a second measurement do, and looks like a fault; and a fault that hid beside one."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.direct.assess import assess_pair
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.inputs import Pair
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode, Side
from replay.machine.config import Limits, Noise

DT, SECONDS = 0.01, 60.0
N = round(SECONDS / DT)
T = np.arange(N) * DT
Array = np.ndarray
LIMITS = Limits()


def found(side: Side, y: Array, x: Array) -> list[Finding]:
    sensor = side is Side.SENSOR
    quiet = np.zeros(N, np.bool_)
    pair = Pair(
        side=side,
        y=y,
        x=x,
        fresh=np.isfinite(y),
        alive=np.ones(N, np.bool_),
        quiet=quiet,
        dt=DT,
        unit="m/s" if sensor else "of full opening",
        span=1.5 if sensor else 1.0,
        y_name="y",
        x_name="x",
        known_noise=Noise(),
    )
    return assess_pair(pair, LIMITS).findings  # type: ignore[return-value]


def noise(sigma: float, seed: int = 1) -> Array:
    return np.random.default_rng(seed).normal(0.0, sigma, N)


def command() -> Array:
    """Moves for two seconds in six, and holds between."""
    return 0.6 * np.clip(3.0 * np.sin(2 * np.pi * T / 12.0), -1.0, 1.0)


def test_a_precise_sensor_at_a_steady_speed_is_not_stuck_beside_a_noisy_one() -> None:
    speed = command()
    assert not found(Side.SENSOR, speed + noise(5e-4), speed + noise(0.006, 2))


def test_a_reading_that_is_off_by_a_hundredth_is_not_stuck() -> None:
    speed = command()
    y = np.where((T > 20.0) & (T < 21.0), 1.012 * speed, speed)
    y[(T > 20.2) & (T < 20.8)] = y[round(20.2 / DT)]
    assert not [f for f in found(Side.SENSOR, y + noise(2e-4), speed + noise(2e-4, 2)) if f.mode is FaultMode.STUCK]


@pytest.mark.parametrize("near_rest", [True, False])
def test_wild_readings_count_unless_the_wheel_starts(*, near_rest: bool) -> None:
    speed = 0.6 * (T % 10.0 > 3.0)
    speed = np.convolve(speed, np.ones(50) / 50, mode="same")
    y = speed + noise(0.002)
    at = round((43.2 if near_rest else 47.0) / DT)
    y[at : at + 6] += np.array([0.2, -0.25, 0.22, -0.2, 0.25, -0.2])
    assert bool(found(Side.SENSOR, y, speed + noise(0.002, 2))) is not near_rest


def test_zeros_a_hundredth_apart_are_no_loss() -> None:
    opening = 0.05 * np.sign(np.sin(2 * np.pi * T / 9.0)) * (T % 9.0 < 8.0)
    assert not found(Side.ACTUATOR, opening + 0.006 + noise(0.001), opening)


def test_an_opening_within_a_dead_band_of_its_command_is_not_stuck() -> None:
    opening = command()
    part = (T > 30.0) & (T < 32.0)
    x = np.where(part, 0.025 * (np.floor(T / 0.04) % 2), opening)
    y = np.where(part, 0.012, opening)
    assert not [f for f in found(Side.ACTUATOR, y + noise(0.001), x) if f.mode.total]


def test_a_valve_that_fades_between_harmless_gains_is_told() -> None:
    """Its path is disturbed while it fades, and of a gain of 1.01 before and behind it."""
    opening = command()
    fades = np.zeros(N)
    for start in (11.0, 23.0, 35.0):
        part = (start <= T) & (start + 3.0 > T)
        fades[part] = 0.6 * (T[part] - start) / 3.0
    y = opening * np.where(fades > 0.0, 1.0 - fades, 1.012)
    told = found(Side.ACTUATOR, y + noise(0.002), opening)
    assert len(told) >= 3
    assert all(any(f.start * DT < s + 2.5 and f.stop * DT > s + 0.5 for f in told) for s in (11.0, 23.0, 35.0))


def test_a_burst_of_noise_is_less_probable_than_a_lasting_one() -> None:
    opening = command()
    probability = []
    for stop in (31.0, 40.0):
        y = opening + noise(0.003)
        part = (T > 30.2) & (stop > T)
        y[part] += np.random.default_rng(4).normal(0.0, 0.05, np.count_nonzero(part))
        probability.append(max((f.probability for f in found(Side.ACTUATOR, y, opening)), default=0.0))
    assert probability[0] < 0.8 < 0.95 < probability[1]


def test_that_a_burst_is_brief_makes_no_other_row_more_probable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(IdentifiedPair, "coarse", property(lambda _: True))
    opening = command()
    y = opening + noise(0.003)
    part = (T > 30.2) & (T < 30.9)
    y[part] += np.random.default_rng(4).normal(0.0, 0.04, np.count_nonzero(part))
    told = [f for f in found(Side.ACTUATOR, y, opening) if f.start * DT > 30.0]
    assert told
    for f in told:
        assert f.probability >= max(h.p for h in f.hypotheses if h.mode != "healthy") - 1e-9


def _stands_still_at(place: float) -> list[Finding]:
    """A valve that stays at `place` for twelve seconds, while its command crosses the middle once and then keeps near it."""
    t = np.clip(T - 30.0, 0.0, None)
    near_middle = np.where(t < 2.0, -0.02 + 0.07 * np.sin(np.pi * t), -0.02 + 0.006 * np.sin(2.0 * t))
    part = (T > 30.0) & (T < 42.0)
    x = np.where(part, near_middle, command())
    return found(Side.ACTUATOR, np.where(part, place, x) + noise(0.003), x)


def test_a_valve_that_stands_still_near_its_middle_is_stuck_once_its_command_leaves_it() -> None:
    (told,) = _stands_still_at(-0.042)
    assert told.mode is FaultMode.STUCK
    assert 11.5 < (told.stop - told.start) * DT < 12.5


def test_about_its_middle_a_dead_band_holds_a_valve() -> None:
    assert not [f for f in _stands_still_at(0.0) if f.mode.total and f.probability > 0.5]


def test_a_loss_beside_a_command_that_hardly_changes_goes_on() -> None:
    """What a fifth of the motion leaves is within the noise, so that it looks stuck meanwhile."""
    t = T - 30.0
    opening = command()
    x = np.where((t > 6.0) & (t < 16.0), 0.9 + 0.01 * np.sin(t), np.where(t > 0.0, 0.75 * opening, opening))
    (told,) = found(Side.ACTUATOR, np.where(t > 0.0, 0.2 * x, x) + noise(0.002), x)
    assert told.mode is FaultMode.INEFFICIENT
    assert told.start * DT < 30.5
    assert told.stop * DT > 58.0
    assert told.epsilon is not None
    assert told.epsilon.low < 0.8 < told.epsilon.high


def test_a_reading_that_changes_all_the_time_is_not_stuck_however_little() -> None:
    """A gain that fades while the wheel speeds up leaves the reading nearly where it is."""
    t = T - 30.0
    part = (t > 0.0) & (t < 3.0)
    speed = np.where(part, 0.3 / (1.0 - 0.2 * np.clip(t, 0.0, 3.0)), command())
    y = np.where(part, 0.3 + 0.02 * np.sin(2.0 * t), speed)
    told = found(Side.SENSOR, y + noise(0.004), speed + noise(0.002, 2))
    assert told
    assert not [f for f in told if f.mode.total and f.probability > 0.5]


def test_how_a_valve_opens_as_the_log_begins_is_no_noise() -> None:
    x = 0.5 * np.cos(2 * np.pi * T / 5.0)
    y, rate = np.zeros(N), 0.0
    for k in range(1, N):  # of second order, closed before the log begins
        rate += ((x[k - 1] - y[k - 1]) / 0.03**2 - 1.4 * rate / 0.03) * DT
        y[k] = y[k - 1] + rate * DT
    assert not found(Side.ACTUATOR, y + noise(2e-3), x)


@pytest.mark.parametrize(("off", "counts"), [(0.027, False), (0.06, True)])
def test_what_a_valve_is_off_by_beside_a_command_that_rests_counts_as_a_constant(off: float, *, counts: bool) -> None:
    x = command()
    x[(T > 20.0) & (T < 24.0)] = 0.12
    y = np.where((T > 21.0) & (T < 23.0), x - off, x)
    assert bool(found(Side.ACTUATOR, y + noise(1e-3), x)) is counts


@pytest.mark.parametrize(
    ("place", "sure"), [(0.99, False), (0.8, True), (-0.99, True)], ids=["at its end", "before it", "at the other end"]
)
def test_a_valve_that_stands_at_its_end_while_less_is_asked_for_may_open_too_far(place: float, sure: bool) -> None:
    asked = np.where((T > 20.0) & (T < 40.0), 0.7 + 0.1 * np.sin(T), command())
    y = np.where((T > 20.0) & (T < 40.0), place, asked) + noise(0.002)
    (finding,) = [f for f in found(Side.ACTUATOR, y, asked) if f.stop * DT > 25.0]
    p = {h.mode: h.p for h in finding.hypotheses}
    assert finding.mode is FaultMode.STUCK
    assert (p["stuck"] > 0.9) is sure
    assert p.get("outside_table", 0.0) == pytest.approx(0.0 if sure else 0.4, abs=0.02)
    assert finding.start * DT == pytest.approx(20.0, abs=0.1)
    assert any("at its end" in line for line in finding.evidence) is not sure
