"""The bank has every row of either table, and no model twice."""

from __future__ import annotations

from diagnosis.results.fault_rows import FAULT_ROWS
from diagnosis.steering.model_bank import (
    ACTUATOR,
    COLOURED,
    FIRST_HIDDEN,
    HEALTHY,
    MODELS,
    MODES,
    SENSOR,
)
from replay.faults import FaultMode, Side


def test_filters_stand_for_rows_of_their_side() -> None:
    assert {(side, mode) for (side, _), mode in MODES.items()} <= {(row.side, row.mode) for row in FAULT_ROWS}
    assert MODES[Side.SENSOR, COLOURED] is FaultMode.NOISY


def test_every_row_has_a_model_of_its_own() -> None:
    pairs = list(zip(SENSOR.tolist(), ACTUATOR.tolist(), strict=True))
    assert len(set(pairs)) == MODELS
    assert pairs[0] == (HEALTHY, HEALTHY)
    for side, row in MODES:
        assert ((row, HEALTHY) if side is Side.SENSOR else (HEALTHY, row)) in pairs[:FIRST_HIDDEN]
