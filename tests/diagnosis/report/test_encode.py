"""The encoder against a plain decoder written from the format's description."""

from __future__ import annotations

import base64
import zlib

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from diagnosis.report.budget import Encodable, encode, spans_of
from diagnosis.report.encode import Channel, Segment, _extremes, levels_of, step_of
from diagnosis.results.result import Closeups


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
    (channel,) = encode(Encodable({"v": values}, {"v": 0.0015}, [], 0.001), 10**6)
    np.testing.assert_allclose(decoded(channel, channel.segments[0])[0], values, atol=1e-12)


def test_gaps_stay_gaps() -> None:
    values = np.array([1.0, np.nan, np.inf, 2.0, np.nan])
    (channel,) = encode(Encodable({"v": values}, {}, [], 0.001), 10**6)
    back = decoded(channel, channel.segments[0])[0]
    assert np.isnan(back).tolist() == [False, True, True, False, True]


def test_column_without_any_sample() -> None:
    (channel,) = encode(Encodable({"v": np.full(5, np.nan)}, {}, [], 0.001), 10**6)
    assert np.isnan(decoded(channel, channel.segments[0])[0]).all()


def test_values_off_the_stated_grid_use_half_of_it() -> None:
    assert step_of(np.array([0.0, 0.4, 0.9, 1.3]), 1.0) == 0.5


@pytest.mark.parametrize("rows", [1, 6, 64])
@pytest.mark.parametrize("size", [1, 63, 64, 65, 200, 1001])
def test_extremes_are_those_of_every_block(size: int, rows: int) -> None:
    values = np.random.default_rng(size).normal(size=size).astype(np.float32)
    values[::3], values[-2:] = np.nan, [np.nan, 7.0][-min(size, 2) :]
    cut = [values[i : i + rows] for i in range(0, size, rows)]
    low, high = ([np.nan if np.isnan(x).all() else f(x) for x in cut] for f in (np.nanmin, np.nanmax))
    np.testing.assert_array_equal(_extremes(values, rows), np.array([*low, *high], np.float32))


def test_outlier_coarsens_the_step_instead_of_overflowing() -> None:
    values = np.array([0.0, 1e-3, 1e20])
    _, step, base = levels_of(values, 1e-3)
    assert step == pytest.approx(1e20 / 2**24)
    assert base == -1.0


@given(st.lists(st.floats(-1e6, 1e6) | st.just(np.nan), min_size=1, max_size=300))
@example([5e-324])
@example([1e29, -1e29, 0.0])
def test_every_value_comes_back_within_half_a_step(values: list[float]) -> None:
    column = np.array(values)
    (channel,) = encode(Encodable({"v": column}, {}, [], 0.001), 10**7)
    back = decoded(channel, channel.segments[0])[0]
    assert (np.isnan(back) == np.isnan(column)).all()
    assert np.nanmax(np.append(np.abs(back - column), 0.0)) <= 0.501 * channel.step


def test_beyond_the_budget_extremes_stand_everywhere_and_samples_around_faults() -> None:
    rng = np.random.default_rng(1)
    values = {"v": rng.normal(size=200_000), "w": rng.normal(size=200_000)}
    channels = encode(Encodable(values, {}, [(50.0, 51.0, frozenset({"v"}))], 0.001), 150_000)
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


def test_long_fault_has_stretches_at_onset_and_end_and_a_short_one_is_whole() -> None:
    assert spans_of([(100.0, 200.0)], 2.0, 4.0, 0.01, 100_000) == [(9_800, 10_202), (19_800, 20_202)]
    assert spans_of([(100.0, 104.0)], 1.0, 4.0, 0.01, 100_000) == [(9_790, 10_612)]
    assert spans_of([(100.0, 104.0), (105.0, 105.2)], 1.0, 4.0, 0.01, 100_000) == [(9_790, 10_632)]
    assert spans_of([(0.0, 1.0)], 1.0, 4.0, 0.01, 150) == [(0, 150)]


def long_mission() -> tuple[dict[str, NDArray[np.float64]], Encodable]:
    """Samples of two columns, and the same as extremes of 16 samples with every sample of two stretches."""
    rng = np.random.default_rng(2)
    samples = {name: np.round(rng.normal(size=160_000), 3) for name in ("v", "w")}
    samples["w"][90_000:90_400] = np.nan
    rows = {k: np.stack([v.reshape(-1, 16).min(1), v.reshape(-1, 16).max(1)], 1).ravel() for k, v in samples.items()}
    step = np.r_[48_000:54_000, 88_000:94_000]
    near = {k: v[step] for k, v in samples.items()}
    near["w"][:6_000] = np.nan
    faults = [(50.0, 51.0, frozenset({"v", "w"})), (90.0, 91.0, frozenset({"v", "w"}))]
    return samples, Encodable(rows, {"v": 0.001, "w": 0.001}, faults, 0.001, 16, Closeups(step, near))


def test_extremes_of_a_long_mission_keep_its_stretches_of_samples() -> None:
    samples, mission = long_mission()
    v, w = encode(mission, 10**6)
    assert [(s.start, s.stride) for s in v.segments] == [(0, 64), (48_000, 1), (88_000, 1)]
    assert [(s.start, s.count) for s in w.segments[1:]] == [(88_000, 5_101)]  # of the first stretch nothing was kept
    for full in v.segments[1:]:
        exact = samples["v"][full.start : full.start + full.count]
        np.testing.assert_allclose(decoded(v, full)[0], exact, atol=1e-9)
    assert np.isnan(decoded(w, w.segments[1])[0]).sum() == 400
    low, high = decoded(w, w.segments[0])
    blocks = np.pad(samples["w"], (0, -160_000 % 64)).reshape(-1, 64)
    empty = np.isnan(low)
    assert empty.sum() > 0
    np.testing.assert_allclose(low[~empty], np.nanmin(blocks[~empty], axis=1), atol=1e-9)
    np.testing.assert_allclose(high[~empty], np.nanmax(blocks[~empty], axis=1), atol=1e-9)


def test_columns_with_the_same_numbers_share_their_text() -> None:
    one = np.sin(np.arange(9000) / 100)
    a, b, c = encode(Encodable({"a": one, "b": one.copy(), "c": -one}, {}, [], 0.001), 10**6)
    assert a.segments[0] is b.segments[0]
    assert (a.name, b.name) == ("a", "b")
    assert c.segments[0] is not a.segments[0]


def test_recorded_columns_keep_every_sample_where_only_some_can() -> None:
    rng = np.random.default_rng(3)
    columns = {f"{part}.{i}": rng.normal(size=200_000) for part in ("evidence.A", "wheel.A") for i in range(3)}
    found = {c.name: c.segments[0].stride for c in encode(Encodable(columns, {}, [], 0.001), 1_400_000)}
    assert {k for k, stride in found.items() if stride == 1} == {"wheel.A.0", "wheel.A.1", "wheel.A.2"}


def test_same_input_gives_the_same_text() -> None:
    values = {f"c{i}": np.sin(np.arange(5000) / (i + 1)) for i in range(6)}
    assert encode(Encodable(values, {}, [], 0.01), 10**6) == encode(Encodable(values, {}, [], 0.01), 10**6)
