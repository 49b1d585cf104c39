"""What pictures of long missions keep of every bucket of steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_array_equal

from replay.arrays import envelope as module
from replay.arrays.column_store import ColumnStore
from replay.arrays.envelope import bucket_of, envelope, in_buckets, rows_of, shown, step_of

NUMBERS = st.floats(-1e6, 1e6) | st.just(float("nan"))


def test_short_missions_keep_every_step() -> None:
    assert bucket_of(1 << 20) == 1
    values = np.arange(5.0)
    assert envelope(values, 1) is values
    assert shown(values) is values
    assert (rows_of(7, 1), step_of(1)) == (7, 1.0)


@pytest.mark.parametrize("hours", [1, 10, 100])
def test_long_missions_have_a_bounded_number_of_rows(hours: int) -> None:
    size = hours * 3_600_000
    bucket = bucket_of(size)
    assert bucket & (bucket - 1) == 0
    assert 1 << 18 < rows_of(size, bucket) <= 1 << 20


def test_a_spike_of_one_step_is_kept_in_the_order_of_time() -> None:
    values = np.zeros(16)
    values[5], values[6], values[9] = 7.0, -2.0, -3.0
    assert_array_equal(envelope(values, 8), [7.0, -2.0, 0.0, -3.0])


@given(arrays(np.float64, st.integers(1, 40), elements=NUMBERS), st.sampled_from([2, 4, 8]))
def test_extremes_of_every_bucket(values: np.ndarray, bucket: int) -> None:
    rows = envelope(values, bucket)
    assert len(rows) == rows_of(len(values), bucket)
    for k, pair in enumerate(rows.reshape(-1, 2)):
        known = values[k * bucket : (k + 1) * bucket]
        known = known[np.isfinite(known)]
        if known.size:
            assert sorted(pair) == [known.min(), known.max()]
        else:
            assert np.isnan(pair).all()


def test_columns_side_by_side_and_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(size=(100, 3))
    whole = envelope(values, 4)
    monkeypatch.setattr("replay.arrays.blocks.BLOCK", 8)
    assert_array_equal(envelope(values, 4), whole)
    assert_array_equal(
        in_buckets(lambda a, b: a - b, 4, ColumnStore(block=8), values, values * 2), envelope(-values, 4)
    )
    for j in range(3):
        assert_array_equal(whole[:, j], envelope(values[:, j], 4))


def test_columns_of_long_missions_are_narrow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FULL_STEPS", 10)
    monkeypatch.setattr(module, "_BUCKETS", 5)
    out = shown(np.arange(20.0))
    assert out.dtype == np.float32
    assert_array_equal(out, [0, 3, 4, 7, 8, 11, 12, 15, 16, 19])
