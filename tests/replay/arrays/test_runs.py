"""Runs of flags."""

from __future__ import annotations

import numpy as np
import pytest

from replay.arrays.runs import runs_of, united


@pytest.mark.parametrize(
    ("flags", "runs"),
    [
        ("", []),
        ("...", []),
        ("###", [(0, 3)]),
        ("#..##.#", [(0, 1), (3, 5), (6, 7)]),
        (".##.", [(1, 3)]),
    ],
)
def test_runs_begin_at_their_first_flag_and_end_behind_their_last(flags: str, runs: list[tuple[int, int]]) -> None:
    assert runs_of(np.array([f == "#" for f in flags], np.bool_)) == runs


def test_runs_hold_every_flag_once() -> None:
    flags = np.random.default_rng(3).random(500) < 0.4
    again = np.zeros(flags.size, np.bool_)
    for start, stop in runs_of(flags):
        assert not again[max(0, start - 1) : stop + 1].any()
        again[start:stop] = True
    assert np.array_equal(again, flags)


def test_spans_that_touch_or_overlap_are_one() -> None:
    assert united([(5.0, 6.0), (1.0, 2.0), (1.5, 3.0), (3.0, 4.0)]) == [(1.0, 4.0), (5.0, 6.0)]
    assert united(iter([(0, 9), (2, 3)])) == [(0, 9)]
