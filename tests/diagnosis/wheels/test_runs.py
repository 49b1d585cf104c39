"""From a path to runs: pieces of one fault are joined, what edges leave behind goes, nothing is lost between runs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from diagnosis.channels.sample_status import PAIR, SILENT
from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    MODELS,
    ODD,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_STUCK,
    S_WHITE_8,
)
from diagnosis.wheels.runs import Runs, runs_of

DT = 0.01
Array = np.ndarray
Piece = tuple[int, int]


def path_of(*pieces: Piece) -> Array:
    return np.concatenate([np.full(n, m, dtype=np.uint8) for m, n in pieces])


def runs(
    *pieces: Piece, entered: tuple[int, ...] = (), quiet: tuple[int, int] = (0, 0), silent: tuple[int, int] = (0, 0)
) -> list[tuple[int, int, int]]:
    """Model, start and stop of every run of a path given by (model, blocks)."""
    path = path_of(*pieces)
    anew = np.zeros(path.size, dtype=np.bool_)
    anew[list(entered)] = True
    idle, status = np.zeros(path.size, dtype=np.bool_), np.full(path.size, PAIR, dtype=np.int8)
    idle[slice(*quiet)] = True
    status[slice(*silent)] = SILENT
    got = runs_of(path, anew, idle, status, DT)
    return list(zip(got.model.tolist(), got.start.tolist(), got.stop.tolist(), strict=True))


def test_a_healthy_path_is_one_run() -> None:
    assert runs((HEALTHY, 500)) == [(HEALTHY, 0, 500)]


def test_an_unusual_load_is_no_fault() -> None:
    assert runs((HEALTHY, 100), (ODD, 80), (HEALTHY, 50)) == [(HEALTHY, 0, 230)]
    assert runs((ODD, 100), (A_GAIN, 80), (ODD, 50)) == [(HEALTHY, 0, 100), (A_GAIN, 100, 180), (HEALTHY, 180, 230)]


@pytest.mark.parametrize("m", range(ODD + 1, MODELS))
def test_a_fault_is_a_run(m: int) -> None:
    assert runs((HEALTHY, 100), (m, 80), (HEALTHY, 50)) == [(HEALTHY, 0, 100), (m, 100, 180), (HEALTHY, 180, 230)]
    assert runs((m, 80), (HEALTHY, 50)) == [(m, 0, 80), (HEALTHY, 80, 130)]
    assert runs((HEALTHY, 50), (m, 80)) == [(HEALTHY, 0, 50), (m, 50, 130)]


def test_noise_of_several_strengths_is_one_row() -> None:
    assert runs((S_WHITE_8, 60), (S_OU_LARGE, 70), (HEALTHY, 50)) == [(S_OU_LARGE, 0, 130), (HEALTHY, 130, 180)]


def test_the_same_fault_may_begin_anew() -> None:
    """Another stuck value, another gain: two faults. Without unknowns there is nothing to begin anew."""
    for m, count in ((S_STUCK, 2), (S_GAIN, 2), (S_NONE, 1), (S_WHITE_8, 1)):
        got = runs((HEALTHY, 50), (m, 200), (HEALTHY, 50), entered=(50, 150))
        assert len(got) == 2 + count


def test_pieces_of_one_valve_fault_are_joined() -> None:
    # the same row again, whatever its length
    assert runs((A_GAIN, 100), (A_GAIN, 100), (HEALTHY, 50), entered=(100,)) == [(A_GAIN, 0, 200), (HEALTHY, 200, 250)]
    # another row for less than half a second, and a healthy moment between
    assert runs((A_STUCK, 40), (A_GAIN, 200)) == [(A_GAIN, 0, 240)]
    assert runs((A_STUCK, 100), (HEALTHY, 5), (A_BIAS, 40), (HEALTHY, 60)) == [(A_STUCK, 0, 145), (HEALTHY, 145, 205)]
    # two that last are two; so are pieces with a longer healthy stretch between
    assert runs((A_STUCK, 100), (A_GAIN, 200)) == [(A_STUCK, 0, 100), (A_GAIN, 100, 300)]
    assert len(runs((A_STUCK, 100), (HEALTHY, 15), (A_STUCK, 100))) == 3
    # sensors jump: what looks like two faults is two
    assert len(runs((S_STUCK, 40), (S_GAIN, 200))) == 2


def test_the_longer_piece_says_where_its_model_was_entered() -> None:
    path = path_of((HEALTHY, 50), (A_STUCK, 30), (A_NONE, 200))
    nothing = np.zeros(path.size, dtype=np.bool_)
    got = runs_of(path, nothing, nothing, np.full(path.size, PAIR, dtype=np.int8), DT)
    assert_array_equal(got.start, [0, 50])
    assert_array_equal(got.entry, [0, 80])
    assert_array_equal(got.model, [HEALTHY, A_NONE])


def test_what_an_edge_leaves_behind_belongs_to_the_fault() -> None:
    # a quarter of a second of another row at either end of a longer fault
    assert runs((HEALTHY, 100), (A_GAIN, 20), (S_STUCK, 100), (S_GAIN, 20), (HEALTHY, 100)) == [
        (HEALTHY, 0, 100),
        (S_STUCK, 100, 240),
        (HEALTHY, 240, 340),
    ]
    # healthy stretches keep what is beside them apart
    assert len(runs((S_STUCK, 100), (HEALTHY, 30), (A_GAIN, 20), (HEALTHY, 100))) == 4


def test_short_faults_that_stand_alone_are_none() -> None:
    assert runs((HEALTHY, 100), (S_GAIN, 4), (HEALTHY, 100)) == [(HEALTHY, 0, 204)]
    assert runs((HEALTHY, 100), (S_STUCK, 4), (HEALTHY, 100)) == [(HEALTHY, 0, 204)]
    assert runs((HEALTHY, 100), (S_STUCK, 5), (HEALTHY, 100))[1] == (S_STUCK, 100, 105)
    assert runs((HEALTHY, 100), (A_GAIN, 6), (HEALTHY, 100))[1] == (A_GAIN, 100, 106)


def test_ends_at_which_nothing_could_be_seen_are_not_the_faults() -> None:
    around = ((HEALTHY, 100), (A_GAIN, 200), (HEALTHY, 100))
    assert runs(*around, quiet=(50, 150)) == [(HEALTHY, 0, 150), (A_GAIN, 150, 300), (HEALTHY, 300, 400)]
    assert runs(*around, quiet=(250, 350)) == [(HEALTHY, 0, 100), (A_GAIN, 100, 250), (HEALTHY, 250, 400)]
    assert runs(*around, quiet=(180, 220)) == [(HEALTHY, 0, 100), (A_GAIN, 100, 300), (HEALTHY, 300, 400)]
    assert runs(*around, quiet=(50, 350)) == [(HEALTHY, 0, 400)]
    # a constant off zero and noise show at rest, and a channel that is silent is so at rest too
    for m in (S_STUCK, A_STUCK, S_WHITE_8):
        assert runs((HEALTHY, 100), (m, 200), (HEALTHY, 100), quiet=(50, 350))[1] == (m, 100, 300)
    assert runs((HEALTHY, 100), (S_NONE, 200), (HEALTHY, 100), quiet=(50, 350), silent=(100, 300))[1] == (
        S_NONE,
        100,
        300,
    )


@given(
    pieces=st.lists(st.tuples(st.integers(0, MODELS - 1), st.integers(1, 120)), min_size=1, max_size=12),
    seed=st.integers(0, 1000),
)
def test_runs_leave_no_gap(pieces: list[Piece], seed: int) -> None:
    path = path_of(*pieces)
    rng = np.random.default_rng(seed)
    quiet = np.repeat(rng.random(path.size // 25 + 1) < 0.3, 25)[: path.size]
    got: Runs = runs_of(path, rng.random(path.size) < 0.03, quiet, np.full(path.size, PAIR, dtype=np.int8), DT)
    assert got.start[0] == 0
    assert got.stop[-1] == path.size
    assert_array_equal(got.start[1:], got.stop[:-1])
    assert (got.stop > got.start).all()
    assert (got.entry >= got.start).all()
    assert (got.entry < got.stop).all()
    assert not ((got.model[1:] == HEALTHY) & (got.model[:-1] == HEALTHY)).any()
