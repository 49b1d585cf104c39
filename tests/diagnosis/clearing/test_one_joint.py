"""A joint in the middle of a machine, given as both of its axles, is no witness of itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.results.clearing import Check
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import LENGTH, checks, simulated


def articulated(share: float = 1.0) -> SimulatedMission:
    """A mission whose rear axle is the front one's mirror; their one sensor reads a share for the second half."""
    one = simulated(seed=5)
    t = (one.stamps - one.stamps[0]) * 1e-9
    reads = np.where(t > LENGTH / 2, share, 1.0)
    columns = dict(one.columns)
    columns["steer.front.phi"] = columns["steer.front.phi"] * reads
    for leaf in ("phi", "u", "phi_ref", "u_applied", "phi_true"):
        if f"steer.front.{leaf}" in columns:
            columns[f"steer.rear.{leaf}"] = -columns[f"steer.front.{leaf}"]
    return replace(one, columns=columns)


def test_two_axles_that_are_one_are_held_to_their_plant_and_not_to_each_other() -> None:
    found = {check for *_, check in checks(articulated(), base=True)}
    assert Check.LASTING_RATE not in found
    assert Check.PLANT_RATE in found
    assert Check.LASTING_RATE in {check for *_, check in checks(simulated(seed=5), base=True)}


@pytest.mark.parametrize(("share", "passes"), [(1.0, True), (0.6, False)])
def test_what_changes_of_both_is_the_joints(share: float, *, passes: bool) -> None:
    found = checks(articulated(share), base=True)
    rates = [c for (axle, _, check), c in found.items() if check is Check.RATE and axle == "front"]
    assert [c.passed for c in rates] == [passes]
