"""Faults that two axles share: left open, unless both lose their signal."""

from __future__ import annotations

import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.findings import SideFindings
from diagnosis.steering.together import not_together
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
