"""Words of the paper's rows, by side."""

from __future__ import annotations

from diagnosis.results.fault_rows import FAULT_ROWS, LOOKS, ROWS, mode_words, prior, row_of, state_label
from replay.faults import TABLE_MODES, FaultMode, Side, State


def test_words_of_the_paper() -> None:
    assert mode_words("actuator", "noisy") == "disturbed"
    assert mode_words("sensor", "noisy") == "noisy"
    assert mode_words("actuator", "no_signal") == "without control signal"
    for side in Side:
        for mode in FaultMode:
            assert mode_words(side, mode)


def test_every_state_has_a_label() -> None:
    assert set(LOOKS) == set(State)
    assert all(state_label(state) for state in State)


def test_codes_and_priors_are_those_of_the_rows() -> None:
    assert [row.code for row in FAULT_ROWS] == [ROWS.index(State(row.mode)) for row in FAULT_ROWS]
    assert all(row_of(side, mode) is not None for side in Side for mode in TABLE_MODES)
    assert row_of(Side.SENSOR, FaultMode.OUTSIDE_TABLE) is None
    assert abs(sum(prior(code) for code in range(len(ROWS))) - 1.0) < 1e-12
