"""Cutting a path of rows into runs, merging and trimming them."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.estimation.fault_models import HEALTHY, INEFFICIENT, NO_SIGNAL, NOISY, STUCK
from diagnosis.estimation.segments import Run, absorb_short, merge_equal, runs_of, trim, with_leads
from diagnosis.estimation.viterbi import ModePath

# of the models, the first four stand for the first four rows
H, S, N, I = 0, 1, 2, 3  # noqa: E741
DRIFT, WHITE = 5, 9


def path(models: list[int], entered: list[int] | None = None) -> ModePath:
    model = np.array(models, dtype=np.uint8)
    marks = np.zeros(model.size, dtype=np.bool_)
    marks[1:] = model[1:] != model[:-1]
    marks[entered or []] = True
    return ModePath(model, marks, np.zeros((model.size, 5), dtype=np.float32))


def test_cut_where_the_row_changes() -> None:
    got = runs_of(path([H, H, S, S, S, H, N, N]))
    assert got == [Run(0, 2, HEALTHY), Run(2, 5, STUCK), Run(5, 6, HEALTHY), Run(6, 8, NO_SIGNAL)]
    assert [r.size for r in got] == [2, 3, 1, 2]


def test_models_of_one_row_are_one_run() -> None:
    assert runs_of(path([DRIFT, DRIFT, WHITE, WHITE])) == [Run(0, 4, NOISY)]


def test_another_value_or_gain_is_another_run() -> None:
    assert runs_of(path([S] * 6, entered=[3])) == [Run(0, 3, STUCK), Run(3, 6, STUCK)]
    assert runs_of(path([I] * 6, entered=[2])) == [Run(0, 2, INEFFICIENT), Run(2, 6, INEFFICIENT)]
    assert runs_of(path([N] * 6, entered=[3])) == [Run(0, 6, NO_SIGNAL)]


@given(st.lists(st.sampled_from([H, S, N, I, DRIFT, WHITE]), min_size=1, max_size=60))
def test_runs_cover_the_path_without_gaps(models: list[int]) -> None:
    got = runs_of(path(models))
    assert got[0].start == 0
    assert got[-1].stop == len(models)
    assert all(a.stop == b.start for a, b in itertools.pairwise(got))
    merged = absorb_short(got, 4)
    assert merged[0].start == 0
    assert merged[-1].stop == len(models)
    assert all(a.stop == b.start for a, b in itertools.pairwise(merged))


def test_short_faulty_runs_join_the_longer_faulty_neighbour() -> None:
    runs = [Run(0, 50, HEALTHY), Run(50, 52, STUCK), Run(52, 90, INEFFICIENT), Run(90, 99, HEALTHY)]
    assert absorb_short(runs, 5) == [Run(0, 50, HEALTHY), Run(50, 90, INEFFICIENT), Run(90, 99, HEALTHY)]
    between = [Run(0, 20, NOISY), Run(20, 22, STUCK), Run(22, 90, INEFFICIENT)]
    assert absorb_short(between, 5) == [Run(0, 20, NOISY), Run(20, 90, INEFFICIENT)]


def test_short_runs_alone_stay() -> None:
    runs = [Run(0, 50, HEALTHY), Run(50, 52, STUCK), Run(52, 90, HEALTHY)]
    assert absorb_short(runs, 5) == runs
    assert absorb_short([], 5) == []


def test_equal_runs_join_over_a_short_healthy_gap() -> None:
    runs = [Run(0, 10, NOISY), Run(10, 12, HEALTHY), Run(12, 30, NOISY), Run(30, 60, HEALTHY), Run(60, 70, NOISY)]
    assert merge_equal(runs, 5) == [Run(0, 30, NOISY), Run(30, 60, HEALTHY), Run(60, 70, NOISY)]
    touching = [Run(0, 5, NOISY), Run(5, 9, NOISY)]
    assert merge_equal(touching, 0) == [Run(0, 9, NOISY)]


def test_only_the_asked_rows_join() -> None:
    runs = [Run(0, 10, STUCK), Run(10, 12, HEALTHY), Run(12, 30, STUCK)]
    assert merge_equal(runs, 5) == runs
    assert merge_equal(runs, 5, (STUCK,)) == [Run(0, 30, STUCK)]
    mixed = [Run(0, 10, NOISY), Run(10, 12, HEALTHY), Run(12, 30, INEFFICIENT)]
    assert merge_equal(mixed, 5, (NOISY, INEFFICIENT)) == mixed


def test_ends_in_which_nothing_moves_are_cut() -> None:
    quiet = np.array([0, 1, 1, 0, 1, 0, 1, 1], dtype=bool)
    assert trim(Run(1, 8, NO_SIGNAL), quiet) == Run(3, 6, NO_SIGNAL)
    assert trim(Run(6, 8, NO_SIGNAL), quiet) is None
    assert trim(Run(0, 1, NO_SIGNAL), quiet) == Run(0, 1, NO_SIGNAL)


def test_what_grows_before_a_fault_is_its_beginning() -> None:
    runs = [Run(100, 180, NOISY), Run(180, 190, INEFFICIENT), Run(190, 400, STUCK), Run(402, 404, NOISY)]
    assert with_leads(runs, lead=20, tail=5, gap=3) == [(runs[2], 100, 404)]
    assert with_leads([], lead=20, tail=5, gap=3) == []


def test_a_fault_before_another_one_stays_its_own() -> None:
    runs = [Run(100, 180, INEFFICIENT), Run(180, 400, NO_SIGNAL), Run(450, 900, NOISY)]
    assert with_leads(runs, lead=20, tail=5, gap=3) == [(r, r.start, r.stop) for r in runs]
