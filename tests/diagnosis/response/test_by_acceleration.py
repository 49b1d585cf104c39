"""A lone speed beside an inertial unit: what the unit shows, and that nothing of its own is laid to the speed."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.by_acceleration import beside_the_acceleration
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.unit_note import unit_note
from diagnosis.response.vibration import Unit
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

DT, N = 0.05, 3000
PART = slice(1206, 1320)


def driven(seed: int) -> Array:
    """A speed with ramps, stops among them, and a steady drive about the time of the fault [m/s]."""
    rng = np.random.default_rng(seed)
    asked = np.repeat(rng.choice([0.0, 0.6, 1.2, 1.8], N // 100), 100)
    asked[1150:1500] = 1.5
    v = np.zeros(N)
    for k in range(1, N):
        v[k] = v[k - 1] + np.clip(asked[k] - v[k - 1], -0.06, 0.06)
    return v


def unit_of(v: Array, seed: int, gain: float = 1.0, noise: float = 0.25, rest: float = 1.0) -> Unit:
    """Acceleration of a body with this speed, on hills with kerbs; the unit shakes with `noise`, at rest with a share of it [m/s²]."""
    rng = np.random.default_rng(seed + 77)
    slope = np.repeat(rng.uniform(-0.06, 0.06, N // 150), 150)
    kerbs = np.where(rng.random(N) < 0.004, rng.normal(0.0, 3.0, N), 0.0) * (v > 0.2)
    a = (
        gain * np.gradient(v, DT)
        + 9.81 * np.sin(slope)
        + kerbs
        + rng.normal(0.0, 1.0, N) * noise * np.where(v > 0.02, 1.0, rest)
    )
    return Unit(np.asarray(a), np.ones(N, np.bool_))


def told(y: Array, unit: Unit | None, asked: Array | None = None) -> tuple[Finding, ...]:
    silent = np.full(N, np.nan) if asked is None else asked
    noisy = y + np.where(y == 0.0, 0.0, np.random.default_rng(5).normal(0.0, 0.01, N))
    data = FollowerData(noisy, np.isfinite(y), cells(silent, cell_of(DT))[:, None], silent, "wheel.D.v")
    return beside_the_acceleration(data, unit, DT)


def faulty(v: Array, left: float) -> Array:
    y = v.copy()
    y[PART] *= left
    return y


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("gain", [1.0, -1.0])
@pytest.mark.parametrize("left", [0.0, 0.5, 1.6])
def test_what_the_body_does_not_do_is_the_sensors(seed: int, gain: float, left: float) -> None:
    v = driven(seed)
    found = told(faulty(v, left), unit_of(v, seed, gain))
    mode = {0.0: FaultMode.NO_SIGNAL, 0.5: FaultMode.INEFFICIENT}.get(left, FaultMode.OUTSIDE_TABLE)
    assert [(f.side, f.mode) for f in found] == [(Side.SENSOR, mode)]
    assert abs(found[0].start - PART.start) <= 1
    assert abs(found[0].stop - PART.stop) <= 1
    assert "imu.acceleration" in found[0].evidence[0]


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("unit", ["right", "another axis", "dead", "quiet", "fierce"])
def test_a_healthy_speed_is_told_by_no_unit(seed: int, unit: str) -> None:
    v = driven(seed)
    made = {
        "right": unit_of(v, seed),
        "another axis": unit_of(driven(seed + 500), seed),
        "dead": Unit(np.zeros(N), np.ones(N, np.bool_)),
        "quiet": unit_of(v, seed, noise=0.02, rest=0.1),
        "fierce": unit_of(v, seed, noise=4.0),
    }[unit]
    assert told(v, made) == ()


@pytest.mark.parametrize("seed", range(6))
def test_a_machine_that_really_stops_at_once_is_not_told(seed: int) -> None:
    """An emergency stop, and a start as hard: the body does what its speed says."""
    v = faulty(driven(seed), 0.0)
    for unit in (unit_of(v, seed), unit_of(v, seed, noise=0.2, rest=0.05)):
        assert told(v, unit) == ()


@pytest.mark.parametrize("seed", range(4))
def test_wheels_that_spin_and_lock_at_every_start_and_stop_are_not_told(seed: int) -> None:
    """They reach their speed from one reading to the next, the body by its tyres' grip."""
    rng = np.random.default_rng(seed)
    y = np.repeat(rng.choice([0.0, 1.0, 1.6], N // 75), 75)
    v = np.zeros(N)
    for k in range(1, N):
        v[k] = v[k - 1] + np.clip(y[k] - v[k - 1], -0.1, 0.1)
    assert told(y, unit_of(v, seed)) == ()


@pytest.mark.parametrize("fails", ["dead", "frozen", "lost"])
@pytest.mark.parametrize("seed", range(3))
def test_a_unit_that_fails_while_the_machine_stops_accuses_nobody(seed: int, fails: str) -> None:
    v = faulty(driven(seed), 0.0)
    a = unit_of(v, seed).acceleration
    around = slice(PART.start - 40, PART.stop + 40)
    a[around] = {"dead": 0.0, "frozen": a[around.start], "lost": np.nan}[fails]
    assert told(v, Unit(a, np.isfinite(a))) == ()


@pytest.mark.parametrize("seed", range(3))
def test_a_speed_that_falls_for_good_is_dead_where_the_unit_shakes_on(seed: int) -> None:
    v = driven(seed)
    y = v.copy()
    y[PART.start :] = 0.0
    v[1500:] = np.maximum(v[1499] - 0.06 * np.arange(N - 1500), 0.0)
    (found,) = told(y, unit_of(v, seed, noise=0.2, rest=0.05))
    assert (found.side, found.mode, found.start) == (Side.SENSOR, FaultMode.NO_SIGNAL, PART.start)
    assert 1480 < found.stop < 1560
    assert "shakes on" in found.evidence[0]


@pytest.mark.parametrize("asked", ["to go", "to stand", "nothing known"])
def test_what_shakes_a_machine_at_rest_makes_no_dead_sensor(asked: str) -> None:
    """It stops and starts at once, and an arm works meanwhile. By shaking alone the sensor is dead where the machine was told to go."""
    v = driven(1)
    y = faulty(v, 0.0)
    a = np.random.default_rng(4).normal(0.0, 0.2, N) * np.where(v > 0.02, 1.0, 0.05)
    told_to = {"to go": v, "to stand": y, "nothing known": None}[asked]
    found = told(y, Unit(np.asarray(a), np.ones(N, np.bool_)), told_to)
    assert [f.mode for f in found] == ([FaultMode.NO_SIGNAL] if asked == "to go" else [])


def test_wheels_that_lock_and_slide_are_not_told() -> None:
    """The reading falls at once, the body in a second and a half, and is quiet then."""
    v = driven(1)
    y = v.copy()
    y[PART.start : 1500] = 0.0
    slide = np.maximum(v[PART.start] - 0.05 * np.arange(1500 - PART.start), 0.0)
    v[PART.start : 1500] = slide
    assert told(y, unit_of(v, 1, noise=0.2, rest=0.05)) == ()


def test_without_a_unit_nothing_is_told() -> None:
    assert told(faulty(driven(1), 0.0), None) == ()


@pytest.mark.parametrize(("unit", "says"), [("right", "would show"), ("another axis", "does not follow")])
def test_what_the_unit_could_have_shown_is_noted(unit: str, says: str) -> None:
    v = driven(2)
    made = unit_of(v if unit == "right" else driven(400), 2)
    silent = np.full(N, np.nan)
    data = FollowerData(v, np.ones(N, np.bool_), silent[:, None], silent, "wheel.D.v")
    assert says in unit_note(data, made, (), DT)
