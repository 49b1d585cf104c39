"""Words and codes of the paper's rows, by side."""

from __future__ import annotations

from string import Formatter

import pytest

from diagnosis.results.fault_rows import (
    FAULT_ROWS,
    LOOKS,
    ROWS,
    codes,
    codes_of,
    mode_words,
    prior,
    row_of,
    state_label,
)
from replay.faults import DECIDED, TABLE_MODES, TABLE_ROWS, FaultMode, Side, State


def test_words_of_the_paper() -> None:
    assert mode_words("actuator", "noisy") == "disturbed"
    assert mode_words("sensor", "noisy") == "noisy"
    assert mode_words("actuator", "no_signal") == "without signal"
    for side in Side:
        for mode in FaultMode:
            assert mode_words(side, mode)


def test_every_state_has_a_label_and_every_judgement_its_look() -> None:
    assert set(LOOKS) == set(State)
    assert all(state_label(state) for state in State)
    for state in DECIDED:
        look = LOOKS[state]
        assert look.sign
        assert look.light
        assert look.dark
        assert look.glyph
        assert look.dash in {"solid", "dash", "dot"}


def test_rows_are_those_that_can_be_written_into_a_log() -> None:
    assert {(row.side, row.mode) for row in FAULT_ROWS} == {(row.side, row.mode) for row in TABLE_ROWS}
    assert all(row_of(side, mode) is not None for side in Side for mode in TABLE_MODES)
    assert row_of(Side.SENSOR, FaultMode.OUTSIDE_TABLE) is None


def test_codes_are_places_among_the_rows() -> None:
    assert ROWS[0] is State.HEALTHY
    assert codes(lambda mode: mode.total) == (ROWS.index(State.STUCK), ROWS.index(State.NO_SIGNAL))
    assert codes(lambda mode: mode.varying, Side.ACTUATOR) == (ROWS.index(State.NOISY),)
    assert codes_of(Side.SENSOR) == tuple(range(len(ROWS)))


@pytest.mark.parametrize("side", [Side.SENSOR, Side.ACTUATOR])
def test_priors_of_a_side_add_up(side: Side) -> None:
    assert abs(sum(prior(code, side) for code in range(len(ROWS))) - 1.0) < 1e-12
    assert prior(len(ROWS), side) == 0.0


def test_titles_ask_for_sizes_that_there_are() -> None:
    for row in FAULT_ROWS:
        assert {name for _, name, _, _ in Formatter().parse(row.title) if name} <= {"part", "mean", "rms", "lost"}
