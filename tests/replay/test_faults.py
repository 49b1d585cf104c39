"""L4 and L8, and the one vocabulary of faults."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from replay.faults import (
    FAULT_STATES,
    TABLE_MODES,
    TABLE_ROWS,
    FaultMode,
    Side,
    State,
    fault_affected,
    table_row,
)

ACCURATE = np.array([0.3, -0.2, 0.0, 0.36])


@pytest.mark.parametrize(
    ("epsilon", "saturation", "expected"),
    [
        (0.0, 0.7, [0.3, -0.2, 0.0, 0.36]),  # accurate, whatever the saturation term
        (1.0, 0.21, [0.21, 0.21, 0.21, 0.21]),  # stuck
        (1.0, 0.0, [0.0, 0.0, 0.0, 0.0]),  # no signal
        (0.4, 0.0, [0.18, -0.12, 0.0, 0.216]),  # inefficient
        (0.5, 0.1, [0.2, -0.05, 0.05, 0.23]),  # noise-affected
    ],
)
def test_rows_of_the_table(epsilon: float, saturation: float, expected: list[float]) -> None:
    got = fault_affected(ACCURATE, np.full(4, epsilon), np.full(4, saturation))
    assert_allclose(got, expected, atol=1e-15)


def test_fault_may_begin_and_end_within_a_signal() -> None:
    got = fault_affected(ACCURATE, np.array([0.0, 1.0, 1.0, 0.0]), np.full(4, 0.5))
    assert_array_equal(got, [0.3, 0.5, 0.5, 0.36])


@given(
    st.floats(-1, 1),
    st.floats(0, 1),
    st.floats(-1, 1),
)
def test_l5_gain_and_bias_form(v_a: float, epsilon: float, saturation: float) -> None:
    # v = δ v_a + δ̄, δ = 1 − ε_s, δ̄ = r ε_s ω_sat
    delta, delta_bar = 1 - epsilon, epsilon * saturation
    got = fault_affected(np.array([v_a]), np.array([epsilon]), np.array([saturation]))
    assert_allclose(got, [delta * v_a + delta_bar], atol=1e-15)
    low, high = sorted((v_a, saturation))
    assert low - 1e-12 <= got[0] <= high + 1e-12


def test_every_fault_mode_is_a_state() -> None:
    assert {s.value for s in FAULT_STATES} == {m.value for m in FaultMode}
    assert State.HEALTHY not in FAULT_STATES
    assert State("no_signal") is State.NO_SIGNAL


def test_a_mode_means_the_same_on_both_sides() -> None:
    for row in TABLE_ROWS:
        other = table_row(Side.SENSOR if row.side is Side.ACTUATOR else Side.ACTUATOR, row.mode)
        assert other is None or (row.total, row.saturation) == (other.total, other.saturation)
        assert row.total == (row.epsilon == 1.0)


def test_modes_by_what_they_leave_of_the_signal() -> None:
    assert TABLE_MODES == (FaultMode.STUCK, FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT, FaultMode.NOISY)
    assert [m for m in FaultMode if m.total] == [FaultMode.STUCK, FaultMode.NO_SIGNAL]
    assert [m for m in FaultMode if m.varying] == [FaultMode.NOISY]
    assert [m for m in FaultMode if m.scaled] == [FaultMode.INEFFICIENT]
    assert table_row(Side.SENSOR, FaultMode.OUTSIDE_TABLE) is None
    assert table_row(Side.SENSOR_OR_ACTUATOR, FaultMode.STUCK) is None
