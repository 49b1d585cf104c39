"""Noise that a model alone claims: a sensor's must shake its reading, a valve's is uncertain where nobody measures its opening."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.blocks import SteeringBlocks, blocks_of
from diagnosis.steering.denied import not_denied
from diagnosis.steering.side_findings import SideFindings
from replay.faults import FaultMode, Side

DT, SIZE = 0.01, 4000
MOST = 0.785  # rad
ALWAYS = np.ones(SIZE, np.bool_)
NOTHING = SideFindings((), ())


def axle(shaken: slice | None) -> SteeringBlocks:
    rng = np.random.default_rng(4)
    t = np.arange(SIZE) * DT
    angle = 0.2 * np.sin(0.5 * t) + rng.normal(0.0, 5e-4, SIZE)
    if shaken is not None:
        angle[shaken] += rng.normal(0.0, 0.01, SIZE)[shaken]
    return blocks_of(angle, np.cos(0.5 * t), ALWAYS, ALWAYS, DT)


def noise(side: Side, start: int = 1000, stop: int = 2000) -> SideFindings:
    found = Finding(
        start=start,
        stop=stop,
        side=side,
        mode=FaultMode.NOISY,
        probability=0.99,
        hypotheses=(Hypothesis(side.value, "noisy", 0.99),),
        epsilon=None,
        sat=None,
        evidence=(),
        tier=Tier.MODEL,
    )
    return SideFindings((found,), ())


def inputs(
    *, angle: bool = False, valve: bool = False, reading: np.ndarray | None = None, command: np.ndarray | None = None
) -> Any:
    return SimpleNamespace(
        angle_redundant=angle,
        valve_redundant=valve,
        timeline=SimpleNamespace(dt=DT, fresh={"u": ALWAYS, "u_applied": ALWAYS}),
        channel=lambda leaf: leaf,
        angle=reading,
        fresh=ALWAYS,
        logged=frozenset({"u"} if command is not None else ()),
        values=lambda leaf: np.full(SIZE, np.nan) if command is None else command,
    )


def test_noise_of_a_sensor_shakes_its_reading() -> None:
    claimed = {Side.SENSOR: noise(Side.SENSOR), Side.ACTUATOR: NOTHING}
    smooth = not_denied(claimed, inputs(), axle(None), MOST)[Side.SENSOR]
    assert not smooth.findings
    assert smooth.unexplained == ((1000, 2000),)
    assert not_denied(claimed, inputs(), axle(slice(1000, 2000)), MOST)[Side.SENSOR].findings


def test_noise_of_a_valve_is_uncertain_unless_its_opening_is_measured() -> None:
    claimed = {Side.SENSOR: NOTHING, Side.ACTUATOR: noise(Side.ACTUATOR)}
    (unseen,) = not_denied(claimed, inputs(), axle(None), MOST)[Side.ACTUATOR].findings
    assert unseen.probability == pytest.approx(0.4, abs=0.01)
    assert sum(h.p for h in unseen.hypotheses) == pytest.approx(1.0)
    (seen,) = not_denied(claimed, inputs(valve=True), axle(None), MOST)[Side.ACTUATOR].findings
    assert seen.probability > 0.98


def test_a_burst_is_less_probable_than_lasting_noise() -> None:
    claimed = {Side.SENSOR: NOTHING, Side.ACTUATOR: noise(Side.ACTUATOR, 1000, 1060)}
    (brief,) = not_denied(claimed, inputs(valve=True), axle(None), MOST)[Side.ACTUATOR].findings
    assert brief.probability == pytest.approx(0.495)


@pytest.mark.parametrize("trembles", [True, False])
def test_a_sensor_whose_last_digit_changes_is_not_stuck(trembles: bool) -> None:
    reading = np.round(np.random.default_rng(5).normal(0.01, 4e-4 if trembles else 0.0, SIZE), 4)
    (claimed,) = noise(Side.SENSOR).findings
    stuck = SideFindings((replace(claimed, mode=FaultMode.STUCK),), ())
    out = not_denied({Side.SENSOR: stuck, Side.ACTUATOR: NOTHING}, inputs(reading=reading), axle(None), MOST)[
        Side.SENSOR
    ]
    assert bool(out.findings) is not trembles


@pytest.mark.parametrize("obeys", [True, False])
def test_a_valve_that_moves_its_axle_as_it_is_told_is_not_stuck(obeys: bool) -> None:
    t = np.arange(SIZE) * DT
    command = 0.2 * np.cos(0.5 * t)
    rate = 0.6 * command if obeys else np.full(SIZE, 0.02)
    angle = np.cumsum(rate) * DT + np.random.default_rng(7).normal(0.0, 3e-4, SIZE)
    of = blocks_of(angle, command, ALWAYS, ALWAYS, DT)
    (claimed,) = noise(Side.ACTUATOR).findings
    stuck = SideFindings((replace(claimed, mode=FaultMode.STUCK),), ())
    out = not_denied({Side.SENSOR: NOTHING, Side.ACTUATOR: stuck}, inputs(), of, MOST)[Side.ACTUATOR]
    assert bool(out.findings) is not obeys
    assert bool(out.unexplained) is obeys


@pytest.mark.parametrize(("level", "command", "stops"), [(0.5, 0.1, True), (0.5, -0.1, False), (0.2, 0.1, False)])
def test_a_valve_that_pushes_its_axle_against_the_stop_is_not_dead(level: float, command: float, stops: bool) -> None:
    """Told to go back, or nowhere near the end of its travel, an axle that stands still has no stop."""
    t = np.arange(SIZE) * DT
    angle = level * np.clip(1.4 * np.sin(0.3 * t - 1.5), -1.0, 1.0)
    here = slice(*np.flatnonzero((angle >= level - 1e-9) & (t < 20.0))[[0, -1]])
    u = 0.1 * np.cos(0.3 * t - 1.5)
    u[here] = command
    (claimed,) = noise(Side.ACTUATOR, here.start, here.stop).findings
    dead = SideFindings((replace(claimed, mode=FaultMode.NO_SIGNAL),), ())
    of = blocks_of(angle + np.random.default_rng(7).normal(0.0, 3e-4, SIZE), u, ALWAYS, ALWAYS, DT)
    out = not_denied({Side.SENSOR: NOTHING, Side.ACTUATOR: dead}, inputs(), of, MOST)[Side.ACTUATOR]
    assert bool(out.findings) is not stops


@pytest.mark.parametrize(("size", "kept"), [(0.03, 0), (0.1, 1)])
def test_a_valve_that_rests_about_its_middle_as_it_is_told_has_no_fault(size: float, kept: int) -> None:
    stuck = replace(noise(Side.ACTUATOR).findings[0], mode=FaultMode.STUCK)
    command = size * np.sin(np.arange(SIZE) * DT)
    found = {Side.SENSOR: NOTHING, Side.ACTUATOR: SideFindings((stuck,), ())}
    out = not_denied(found, inputs(valve=True, command=command), axle(None), MOST)[Side.ACTUATOR]
    assert len(out.findings) == kept
    assert len(out.unexplained) == 1 - kept


def test_a_tremor_is_no_noise() -> None:
    found = {Side.SENSOR: noise(Side.SENSOR, 0, SIZE), Side.ACTUATOR: NOTHING}
    assert not_denied(found, inputs(), axle(None), MOST)[Side.SENSOR].findings == ()


def test_many_brief_pauses_of_a_reading_are_its_habit() -> None:
    one = replace(noise(Side.SENSOR).findings[0], mode=FaultMode.STUCK, probability=0.8)
    few = tuple(replace(one, start=k, stop=k + 30) for k in range(500, 2000, 500))
    many = tuple(replace(one, start=k, stop=k + 30) for k in range(500, 3500, 500))
    for pauses, most in ((few, 0.8), (many, 0.4)):
        out = not_denied(
            {Side.SENSOR: SideFindings(pauses, ()), Side.ACTUATOR: NOTHING},
            inputs(reading=np.zeros(SIZE)),
            axle(None),
            MOST,
        )
        assert all(f.probability <= most for f in out[Side.SENSOR].findings)
        assert len(out[Side.SENSOR].findings) == len(pauses)


@pytest.mark.parametrize(("runs", "largest", "kept"), [(True, 0.5, 0.4), (False, 0.5, 0.99), (True, 0.7, 0.99)])
def test_an_angle_that_runs_to_the_largest_of_the_mission_may_be_at_its_end_stop(
    runs: bool, largest: float, kept: float
) -> None:
    """One that is held where it was, or elsewhere, is stuck."""
    reading = np.full(SIZE, 0.1)
    reading[900:1000] = np.linspace(0.1, 0.5, 100) if runs else 0.5
    reading[1000:2000] = 0.5
    reading[3000:3100] = largest
    reading[2000:] = np.where(reading[2000:] == largest, largest, 0.0)
    if not runs:
        reading[900:1000] = 0.45 + 0.05 * np.sin(np.arange(100))
    stuck = replace(
        noise(Side.SENSOR).findings[0], mode=FaultMode.STUCK, hypotheses=(Hypothesis("sensor", "stuck", 0.99),)
    )
    claimed = {Side.SENSOR: SideFindings((stuck,), ()), Side.ACTUATOR: NOTHING}
    (told,) = not_denied(claimed, inputs(reading=reading), axle(None), MOST)[Side.SENSOR].findings
    assert told.probability == pytest.approx(kept)
