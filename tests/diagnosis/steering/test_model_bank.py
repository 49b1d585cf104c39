"""The bank has every row of either table, and no model twice."""

from __future__ import annotations

from diagnosis.results.fault_rows import FAULT_ROWS
from diagnosis.steering.model_bank import (
    ACTIVE,
    ACTUATOR,
    COLOURED,
    FIRST_HIDDEN,
    FREE,
    HEALTHY,
    MODELS,
    MODES,
    SENSOR,
    STUCK,
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


def test_a_stuck_sensor_frees_its_constant_alone() -> None:
    m = [(s, a) for s, a in zip(SENSOR, ACTUATOR, strict=True)].index((STUCK, HEALTHY))
    assert ACTIVE[m, : FREE[m]].tolist() == [0, 1, 3, 5]
