"""Frames to segments: averaged probabilities, short pieces, edges of the Kalman models, both sides at once."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from diagnosis.wheels import tracks
from diagnosis.wheels.models import A_GAIN, HEALTHY, S_STUCK
from diagnosis.wheels.runs import Runs
from diagnosis.wheels.tracks import MODES, Segment, Track, runs_between, segments_of
from replay.faults import FaultMode, Side

DT, HOP, FRAMES = 0.01, 20, 50
N = HOP * FRAMES
NOTHING = Runs(*(np.array([x]) for x in (0, N, HEALTHY, 0)))


def track(rows: dict[Side, list[tuple[int, int, int, float]]]) -> Track:
    """Frames [first, last) of a class with a probability; the rest is healthy with .99."""
    probability = {}
    for side in (Side.SENSOR, Side.ACTUATOR):
        p = np.full((FRAMES, 5), 0.0025)
        p[:, 0] = 0.99
        for first, last, k, value in rows.get(side, []):
            p[first:last] = (1 - value) / 4
            p[first:last, k] = value
        probability[side] = p
    return Track(HOP, probability)


def test_a_fault_is_a_segment() -> None:
    found = track({Side.ACTUATOR: [(10, 20, 3, 0.9)]})
    (segment,) = segments_of(found, Side.ACTUATOR, N, NOTHING, DT)
    assert (segment.start, segment.stop, segment.mode) == (200, 400, FaultMode.INEFFICIENT)
    assert segment.pooled[Side.ACTUATOR, FaultMode.INEFFICIENT] == pytest.approx(0.9)
    assert sum(segment.pooled.values()) == pytest.approx(1.0)
    assert segment.pooled[None] == pytest.approx(0.025 * 0.99)
    assert segment.model == A_GAIN
    assert segments_of(found, Side.SENSOR, N, NOTHING, DT) == []


def test_one_frame_of_another_row_belongs_to_the_fault() -> None:
    found = track({Side.SENSOR: [(10, 20, 1, 0.9), (14, 15, 4, 0.9)]})
    (segment,) = segments_of(found, Side.SENSOR, N, NOTHING, DT)
    assert (segment.start, segment.stop, segment.mode) == (200, 400, FaultMode.STUCK)


def test_rows_that_follow_each_other_are_two_faults() -> None:
    found = track({Side.SENSOR: [(10, 20, 1, 0.9), (20, 30, 4, 0.9)]})
    assert [(s.start, s.stop, s.mode) for s in segments_of(found, Side.SENSOR, N, NOTHING, DT)] == [
        (200, 400, FaultMode.STUCK),
        (400, 600, FaultMode.NOISY),
    ]


@given(st.integers(0, 10_000), st.integers(1, 5))
def test_rows_within_a_fault_are_the_best_of_all_paths(seed: int, frames: int) -> None:
    p = np.random.default_rng(seed).dirichlet(np.full(5, 0.3), frames + 2)
    step = 1.5
    gain = step * np.log(np.maximum(p[1:-1, 1:], 1e-6))

    def worth(path: tuple[int, ...]) -> float:
        changes = sum(a != b for a, b in pairwise(path))
        return float(sum(gain[k, row] for k, row in enumerate(path)) - tracks._CHANGE * changes)

    pieces = tracks._rows_between(p, 1, 1 + frames, step)
    assert [a for a, _, _ in pieces] == [1, *(b for _, b, _ in pieces[:-1])]
    assert pieces[-1][1] == 1 + frames
    got = tuple(row for a, b, row in pieces for _ in range(b - a))
    assert worth(got) == pytest.approx(max(map(worth, product(range(4), repeat=frames))))


@pytest.mark.parametrize(("edges", "want"), [([], 50), ([44, 57], 44), ([43, 57], 50), ([45, 55], 45)])
def test_the_closest_edge_within_reach(edges: list[int], want: int) -> None:
    assert tracks._closest(np.array(edges, np.int64), 50, 6) == want


def test_an_edge_of_the_path_of_the_same_side_is_the_better_one() -> None:
    start = np.array([0, 212, 371])
    runs = Runs(start, np.array([212, 371, N]), np.array([HEALTHY, S_STUCK, HEALTHY]), start)
    found = track({Side.SENSOR: [(10, 20, 1, 0.9)], Side.ACTUATOR: [(10, 20, 1, 0.9)]})
    (sensor,) = segments_of(found, Side.SENSOR, N, runs, DT)
    (valve,) = segments_of(found, Side.ACTUATOR, N, runs, DT)
    assert (sensor.start, sensor.stop) == (212, 371)
    assert (valve.start, valve.stop) == (200, 400)


def test_blocks_have_the_probability_of_their_frame() -> None:
    healthy = track({Side.SENSOR: [(10, 20, 1, 0.9)]}).healthy(Side.SENSOR, N + 7)
    assert healthy.shape == (N + 7,)
    assert_allclose(healthy[[199, 200, 399, 400, -1]], [0.99, 0.025, 0.025, 0.99, 0.99])


def test_averages_are_geometric_and_sharpened() -> None:
    said = np.log(np.random.default_rng(1).dirichlet(np.ones(5), 30))
    got = tracks._averaged(said, 2)
    k = 11
    want = np.exp(tracks._SHARPER * said[k - 2 : k + 3].mean(axis=0))
    assert_allclose(got[k], want / want.sum())
    assert_allclose(got.sum(axis=1), 1.0)
    assert_allclose(
        tracks._averaged(said, 0)[3], np.exp(tracks._SHARPER * said[3]) / np.exp(tracks._SHARPER * said[3]).sum()
    )


def test_runs_between_segments_leave_no_gap() -> None:
    pooled = {None: 1.0}
    segments = [Segment(0, 10, Side.SENSOR, MODES[0], pooled), Segment(10, 30, Side.ACTUATOR, MODES[2], pooled)]
    runs, places = runs_between(segments, 50)
    assert runs.start.tolist() == [0, 10, 30]
    assert runs.stop.tolist() == [10, 30, 50]
    assert runs.model.tolist() == [S_STUCK, A_GAIN, HEALTHY]
    assert places == [0, 1]
    alone, none = runs_between([], 50)
    assert (alone.start.tolist(), alone.stop.tolist(), none) == ([0], [50], [])
