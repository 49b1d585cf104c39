"""A speed behind a loose contact: readings of 0 between readings of a wheel that drives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.clearing.drop_outs import fault_of_drop_outs
from replay.faults import FaultMode, Side
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import in_cells, simulated


def loose(*names: str, share: float = 0.35) -> SimulatedMission:
    """A mission in which the same readings of these signals are 0 from 20 s to 45 s."""
    mission = simulated()
    drops = np.random.default_rng(4).random(mission.columns["wheel.FR.v"].size) < share
    drops[:2000] = drops[4500:] = False
    return replace(
        mission, columns={n: np.where(drops, 0.0, x) if n in names else x for n, x in mission.columns.items()}
    )


def test_readings_that_drop_to_0_and_back_are_noise_of_the_sensor() -> None:
    for base in (True, False):
        found = fault_of_drop_outs("FR", in_cells(loose("wheel.FR.v"), base=base))
        assert found is not None
        assert (found.mode, found.side) == (FaultMode.NOISY, Side.SENSOR)
        assert 19.0 < found.start / 100.0 < 24.0
        assert 40.0 < found.stop / 100.0 < 46.0
        assert "loose contact" in found.evidence[0]


def test_few_of_them_and_those_that_a_second_speed_shares_are_none() -> None:
    assert fault_of_drop_outs("FR", in_cells(simulated(), base=True)) is None
    assert fault_of_drop_outs("FR", in_cells(loose("wheel.FR.v", share=0.002), base=True)) is None
    assert fault_of_drop_outs("FR", in_cells(loose("wheel.FR.v", "wheel.FR.v_true"), base=False)) is None
