"""Plants of simulated wheels: map with dead band, lag, hysteresis and grip are found, also from missions full of faults."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.wheels import plant_identification
from diagnosis.wheels.plant_constants import PlantFit
from diagnosis.wheels.plant_identification import identify_plants
from diagnosis.wheels.plant_windows import Drive
from replay.machine.config import WheelPlant
from tests.campaigns import campaign, campaign_of_rows

DT, SECONDS, SPAN, FINE = 0.01, 120.0, 0.36, 5
WHEELS = 4
DEAD, REVERSE, PLAY = 0.03, 0.8, 0.02
Array = np.ndarray


def true_map(x: Array) -> Array:
    """Speed over opening: dead band of 3 %, a smaller gain in reverse."""
    return np.asarray(np.sign(x) * 2.4 * np.maximum(np.abs(x) - DEAD, 0.0) * np.where(x < 0, REVERSE, 1.0))


@cache
def driven(grip: float, tau: float, play: float, seed: int = 1) -> Drive:
    """Block means of four wheels in random motion of a joystick, each on a course of its own around the others'.

    τ ν̇ = −ν + map(spool) + grip·(body − ν), at a fifth of a block; the body follows the mean of the wheels.
    """
    rng = np.random.default_rng(seed)
    n = round(SECONDS / DT)
    steps = rng.uniform(0.0, 0.17, size=n // 60 + 1) * rng.choice([-1.0, 1.0], size=n // 60 + 1)
    common = np.repeat(steps, 60)[:n]
    t = np.arange(n)[:, None] * DT
    own = 0.012 * np.sin(2 * np.pi * t * [0.31, 0.43, 0.57, 0.71] + np.arange(WHEELS))
    u = common[:, None] * [1.0, 1.1, 0.9, 1.05] + own
    h = DT / FINE
    v, spool, y = np.zeros(WHEELS), u[0].copy(), np.empty((n, WHEELS))
    body, bodies = 0.0, np.empty(n)
    keep = np.exp(-h * (1 + grip) / tau)
    for k in range(n):
        spool = np.clip(spool, u[k] - play / 2, u[k] + play / 2)
        aim = (true_map(spool) + grip * body) / (1 + grip)
        total, of_body = np.zeros(WHEELS), 0.0
        for _ in range(FINE):
            total, of_body = total + v, of_body + body
            v = aim + keep * (v - aim)
            body += h / 0.05 * (float(v.mean()) - body)
            aim = (true_map(spool) + grip * body) / (1 + grip)
        y[k], bodies[k] = total / FINE, of_body / FINE
    y += 0.0015 * rng.normal(size=y.shape)
    held = np.repeat(bodies[:, None], WHEELS, axis=1) + 0.001 * rng.normal(size=y.shape)
    return Drive(y=y, u=u, body=held, moving=np.abs(u) > 0.005, dt=DT)


def faulty(drive: Drive, share: float, seed: int = 7) -> Drive:
    """The same with `share` of each wheel's time in sensors that are stuck, lose gain, or are noisy."""
    rng = np.random.default_rng(seed)
    y, length = drive.y.copy(), 500
    for i in range(WHEELS):
        pieces = rng.permutation(len(y) // length)[: round(share * (len(y) // length))]
        for p in pieces:
            part = slice(p * length, (p + 1) * length)
            kind = rng.integers(3)
            stuck = np.full(length, rng.uniform(-0.3, 0.3))
            y[part, i] = (rng.uniform(0.2, 0.7) * y[part, i], stuck, y[part, i] + 0.08 * rng.normal(size=length))[kind]
    return Drive(y, drive.u, drive.body, drive.moving, drive.dt)


def found(drive: Drive, **options: float) -> PlantFit:
    got = identify_plants([drive], SPAN, **options)  # type: ignore[arg-type]
    assert got is not None
    return got


def slopes(plant: WheelPlant, low: float, high: float) -> Array:
    """Speed per opening from one opening to another, forward and in reverse [m/s]."""
    at = np.interp([low, high, -low, -high], plant.openings, plant.speeds)
    return np.array([at[1] - at[0], at[2] - at[3]]) / (high - low)


def check_map(fit: PlantFit, rtol: float) -> None:
    """The map where the machine drove, within a share of the top speed."""
    for plant in fit.plants:
        assert isinstance(plant, WheelPlant)
        at = np.r_[-0.16:-0.045:0.01, 0.05:0.165:0.01]
        assert_allclose(np.interp(at, plant.openings, plant.speeds), true_map(at), atol=rtol * SPAN)
        # the ridge between neighbouring ramps smears a dead band of 3 %: it is seen as a bend, not as a plain
        middle, beyond = (slopes(plant, low, high) for low, high in ((0.0, 0.02), (0.07, 0.16)))
        assert (middle < 0.7 * beyond).all()
        assert beyond[1] == pytest.approx(REVERSE * beyond[0], rel=0.15)
        assert (np.diff(plant.speeds) >= 0).all()
        # beyond what was driven nobody knows: faster, in the direction of the opening
        unseen = np.interp([-1.0, -0.1, 0.1, 1.0], plant.openings, plant.unseen)
        assert unseen[0] < 0 < unseen[3]
        assert_allclose(unseen[1:3], 0.0)


@pytest.mark.parametrize(("tau", "play"), campaign_of_rows([(0.12, PLAY), (0.25, 0.0)]))
def test_wheels_off_the_ground_are_found_to_be_free(tau: float, play: float) -> None:
    fit = found(driven(0.0, tau, play))
    check_map(fit, 0.08)
    for plant in fit.plants:
        assert plant is not None
        assert plant.grip == 0.0
        assert plant.tau == pytest.approx(tau, rel=0.3)
        assert plant.hysteresis == pytest.approx(
            play, abs=0.0151
        )  # a play of 2 % trades off against lag and dead band in the air
    assert fit.misfit < 0.04
    assert fit.may_hold < 0.5


def test_wheels_that_fit_better_held_may_be_held(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plant_identification, "_FREE_ENOUGH", 100.0)
    fit = found(driven(2.5, 0.3, PLAY))
    assert all(p is not None and p.grip == 0.0 for p in fit.plants)
    assert fit.may_hold == pytest.approx(2.5 / 3.5, abs=0.1)


def test_wheels_on_the_ground_show_their_grip() -> None:
    fit = found(driven(2.5, 0.3, PLAY))
    check_map(fit, 0.1)
    for plant in fit.plants:
        assert plant is not None
        assert plant.grip == pytest.approx(2.5, rel=0.4)
        assert plant.tau == pytest.approx(0.3, rel=0.5)
        assert plant.hysteresis == pytest.approx(PLAY, abs=0.0101)


@pytest.mark.parametrize("grip", campaign([2.5, 0.0]))
def test_half_of_the_windows_may_be_faulty(grip: float) -> None:
    drive = driven(grip, 0.25, PLAY)
    fit = found(faulty(drive, 0.5))
    check_map(fit, 0.1)
    for plant in fit.plants:
        assert plant is not None
        assert plant.grip is not None
        assert (plant.grip > 0.5) == (grip > 0)
        assert plant.hysteresis == pytest.approx(PLAY, abs=0.0101)
    assert fit.typical > fit.misfit


def test_the_machine_file_may_say_that_wheels_are_free() -> None:
    fit = identify_plants([driven(2.5, 0.3, PLAY)], SPAN, coupling="free")
    assert fit is not None
    assert all(p is not None and p.grip == 0.0 for p in fit.plants)


def test_too_little_driving_shows_nothing() -> None:
    drive = driven(0.0, 0.25, 0.0)
    short = Drive(drive.y[:400], drive.u[:400], drive.body[:400], drive.moving[:400], DT)
    assert identify_plants([short], SPAN) is None
    still = Drive(0 * drive.y, 0 * drive.u, 0 * drive.body, np.zeros(drive.y.shape, dtype=np.bool_), DT)
    assert identify_plants([still], SPAN) is None


def test_a_wheel_without_channels_has_no_plant() -> None:
    drive = driven(0.0, 0.25, 0.0)
    u = drive.u.copy()
    u[:, 2] = np.nan
    fit = found(Drive(drive.y, u, np.full(drive.y.shape, np.nan), drive.moving, DT))
    assert [p is None for p in fit.plants] == [False, False, True, False]


@pytest.mark.parametrize("more", campaign(range(4)))
def test_missions_of_any_length_are_identified(more: int) -> None:
    """The last row of the last window may be of fewer blocks than the others."""
    whole = driven(2.5, 0.3, PLAY)
    n = 2400 + 97 + more
    part = Drive(whole.y[:n], whole.u[:n], whole.body[:n], whole.moving[:n], whole.dt)
    assert all(plant is not None for plant in found(part).plants)
