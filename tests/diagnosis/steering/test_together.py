"""Faults that two axles share: left open, unless both lose their signal."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.side_findings import SideFindings
from diagnosis.steering.together import less_sure_all_along, not_shaken_together, not_starved, not_together
from replay.faults import FaultMode, Side

DT, LENGTH = 0.01, 2


def sides(mode: FaultMode, start: int, stop: int) -> dict[Side, SideFindings]:
    found = Finding(
        start=start,
        stop=stop,
        side=Side.ACTUATOR,
        mode=mode,
        probability=0.95,
        hypotheses=(),
        epsilon=None,
        sat=None,
        evidence=(),
        tier=Tier.MODEL,
    )
    return {Side.ACTUATOR: SideFindings((found,), ())}


@pytest.mark.parametrize(
    ("mode", "start", "kept"),
    [
        (FaultMode.STUCK, 1050, False),
        (FaultMode.NOISY, 1000, False),
        (FaultMode.STUCK, 1100, False),  # they end together, and are one for nearly all of their time
        (FaultMode.STUCK, 1300, True),
        (FaultMode.NO_SIGNAL, 1000, True),
    ],
)
def test_what_both_axles_do_at_once_is_a_fault_of_neither(mode: FaultMode, start: int, *, kept: bool) -> None:
    out = not_together({"front": sides(mode, 1000, 1600), "rear": sides(mode, start, 1640)}, LENGTH, DT)
    for axle, begin, end in (("front", 1000, 1600), ("rear", start, 1640)):
        side = out[axle][Side.ACTUATOR]
        assert bool(side.findings) is kept
        assert side.unexplained == (() if kept else ((begin // LENGTH, end // LENGTH),))


@pytest.mark.parametrize(
    ("mode", "stop", "kept"),
    [
        (FaultMode.NOISY, 1110, False),
        (FaultMode.OUTSIDE_TABLE, 1150, False),
        (FaultMode.INEFFICIENT, 1150, False),
        (FaultMode.NOISY, 1900, True),
        (FaultMode.OUTSIDE_TABLE, 1900, True),
        (FaultMode.STUCK, 1110, True),
    ],
)
def test_brief_surges_of_both_valves_are_the_supplys_though_their_openings_are_measured(
    mode: FaultMode, stop: int, *, kept: bool
) -> None:
    out = not_shaken_together({"front": sides(mode, 1000, stop), "rear": sides(mode, 1010, stop)}, LENGTH, DT)
    for axle, begin in (("front", 1000), ("rear", 1010)):
        side = out[axle][Side.ACTUATOR]
        assert bool(side.findings) is kept
        assert side.unexplained == (() if kept else ((begin // LENGTH, stop // LENGTH),))


@pytest.mark.parametrize(
    ("mode", "stop", "sure"),
    [
        (FaultMode.NOISY, 1900, False),
        (FaultMode.INEFFICIENT, 1900, False),
        (FaultMode.STUCK, 1900, True),
        (FaultMode.NOISY, 1300, True),
    ],
    ids=["disturbed", "loses", "stuck", "for a while"],
)
def test_partial_faults_of_two_axles_all_along_are_no_claims(mode: FaultMode, stop: int, *, sure: bool) -> None:
    """Of a mission of 3000 samples the other axle's is noisy for two thirds."""
    out = less_sure_all_along({"front": sides(FaultMode.NOISY, 0, 2000), "rear": sides(mode, 300, stop)}, 3000)
    (found,) = out["rear"][Side.ACTUATOR].findings
    assert found.probability == (0.95 if sure else 0.6)


def axle(made: float, span: slice) -> Any:
    """An axle that its plant turns at 0.2 rad/s to either side, and that makes so much of it in a span of blocks."""
    given = np.where(np.arange(2000) % 400 < 200, 0.2, -0.2)
    rate = given.copy()
    rate[span] *= made
    blocks = SimpleNamespace(
        length=LENGTH, dt=LENGTH * DT, mean=np.cumsum(rate) * LENGTH * DT, count=np.ones(2000, dtype=np.int64)
    )
    return SimpleNamespace(blocks=blocks, driven=SimpleNamespace(command=given))


@pytest.mark.parametrize(("front", "kept"), [(0.65, False), (0.8, False), (0.95, True), (1.0, True)])
def test_a_loss_of_a_sensor_while_the_other_axle_lacks_motion_too_is_a_want_of_oil(front: float, *, kept: bool) -> None:
    found = sides(FaultMode.INEFFICIENT, 1000, 1600)[Side.ACTUATOR]
    lost = SideFindings(tuple(replace(f, side=Side.SENSOR) for f in found.findings), ())
    span = slice(1000 // LENGTH, 1600 // LENGTH)
    out = not_starved({"rear": {Side.SENSOR: lost}}, {"front": axle(front, span), "rear": axle(0.65, span)})
    sensor = out["rear"][Side.SENSOR]
    assert bool(sensor.findings) is kept
    assert sensor.unexplained == (() if kept else ((500, 800),))


@pytest.mark.parametrize(("start", "kept"), [(1000, False), (1400, True)])
def test_losses_of_two_sensors_at_once_are_no_fault_of_either_though_hardly_any_motion_is_asked_for(
    start: int, *, kept: bool
) -> None:
    """Where nothing is asked of an axle, what it lacks is not known."""
    one = sides(FaultMode.INEFFICIENT, 1000, 1600)[Side.ACTUATOR]
    other = sides(FaultMode.INEFFICIENT, start, 1600 + 2 * (start - 1000))[Side.ACTUATOR]
    found = {"front": {Side.SENSOR: one}, "rear": {Side.SENSOR: other}}
    still = {name: axle(0.0, 0) for name in found}
    out = not_starved(found, still)
    assert [bool(out[name][Side.SENSOR].findings) for name in found] == [kept, kept]
