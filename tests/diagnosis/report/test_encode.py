"""The encoder against a plain decoder written from the format's description."""

from __future__ import annotations

import base64
import zlib

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from diagnosis.report.encode import Channel, Segment, encode, levels_of, step_of, windows_of


def decoded(channel: Channel, segment: Segment) -> list[NDArray[np.float64]]:
    """Values of a segment sample by sample: [all], or [minima, maxima]."""
    raw = zlib.decompress(base64.b64decode(segment.text))
    parts = []
    for part in range(1 if segment.stride == 1 else 2):
        at = part * segment.count * segment.planes
        level, values = 0, []
        for i in range(segment.count):
            z = sum(raw[at + p * segment.count + i] << (8 * p) for p in range(segment.planes))
            level += (z >> 1) ^ -(z & 1)
            values.append((channel.base + level) * channel.step if level else np.nan)
        parts.append(np.array(values))
    return parts


def test_values_on_the_sensors_grid_come_back_exactly() -> None:
    values = 0.0015 * np.array([0, 3, 3, -2, 240, 0, 1])
    (channel,) = encode({"v": values}, {"v": 0.0015}, [], 0.001, 10**6)
    np.testing.assert_allclose(decoded(channel, channel.segments[0])[0], values, atol=1e-12)


def test_gaps_stay_gaps() -> None:
    values = np.array([1.0, np.nan, np.inf, 2.0, np.nan])
    (channel,) = encode({"v": values}, {}, [], 0.001, 10**6)
    back = decoded(channel, channel.segments[0])[0]
    assert np.isnan(back).tolist() == [False, True, True, False, True]


def test_column_without_any_sample() -> None:
    (channel,) = encode({"v": np.full(5, np.nan)}, {}, [], 0.001, 10**6)
    assert np.isnan(decoded(channel, channel.segments[0])[0]).all()


def test_values_off_the_stated_grid_use_half_of_it() -> None:
    assert step_of(np.array([0.0, 0.4, 0.9, 1.3]), 1.0) == 0.5


def test_outlier_coarsens_the_step_instead_of_overflowing() -> None:
    values = np.array([0.0, 1e-3, 1e20])
    _, step, base = levels_of(values, 1e-3)
    assert step == pytest.approx(1e20 / 2**24)
    assert base == -1.0


@given(st.lists(st.floats(-1e6, 1e6) | st.just(np.nan), min_size=1, max_size=300))
@settings(max_examples=60, deadline=None)
@example([5e-324])
@example([1e29, -1e29, 0.0])
def test_every_value_comes_back_within_half_a_step(values: list[float]) -> None:
    column = np.array(values)
    (channel,) = encode({"v": column}, {}, [], 0.001, 10**7)
    back = decoded(channel, channel.segments[0])[0]
    assert (np.isnan(back) == np.isnan(column)).all()
    assert np.nanmax(np.append(np.abs(back - column), 0.0)) <= 0.501 * channel.step


def test_beyond_the_budget_extremes_stand_everywhere_and_samples_around_faults() -> None:
    rng = np.random.default_rng(1)
    values = {"v": rng.normal(size=200_000), "w": rng.normal(size=200_000)}
    channels = encode(values, {}, [(50.0, 51.0, frozenset({"v"}))], 0.001, 150_000)
    v, w = channels
    assert sum(c.size for c in channels) <= 150_000
    assert [s.stride > 1 for s in v.segments] == [True, False]
    assert [s.stride > 1 for s in w.segments] == [True]
    full = v.segments[1]
    assert full.start <= 50_000
    assert full.start + full.count >= 51_000
    low, high = decoded(v, v.segments[0])
    stride = v.segments[0].stride
    blocks = np.pad(values["v"], (0, -len(values["v"]) % stride), constant_values=np.nan).reshape(-1, stride)
    np.testing.assert_allclose(low, np.nanmin(blocks, axis=1), atol=v.step)
    np.testing.assert_allclose(high, np.nanmax(blocks, axis=1), atol=v.step)


def test_long_fault_has_windows_at_onset_and_end() -> None:
    windows = windows_of([(100.0, 200.0, frozenset({"v"}))], 2.0, 0.01, 100_000)
    assert [(w.start, w.stop) for w in windows] == [(9_800, 10_201), (19_800, 20_201)]


def test_same_input_gives_the_same_text() -> None:
    values = {f"c{i}": np.sin(np.arange(5000) / (i + 1)) for i in range(6)}
    assert encode(values, {}, [], 0.01, 10**6) == encode(values, {}, [], 0.01, 10**6)
