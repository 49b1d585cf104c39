"""Columns that outgrow memory are the same numbers as those that do not."""

from __future__ import annotations

import errno
import gc
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from replay.arrays import spill
from replay.arrays.spill import Column, beside, blocks, in_blocks, keep, release, scratch
from replay.errors import LogError


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """Everything beyond a few numbers is spilled."""
    monkeypatch.setattr(spill, "SPILL_BYTES", 64)
    monkeypatch.setattr(spill, "ROOM", 0)
    monkeypatch.setattr(spill, "FLUSH_BYTES", 32)
    monkeypatch.setattr(spill, "BLOCK", 7)


def spilled(array: np.ndarray) -> bool:
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    return base is not None


@pytest.mark.parametrize("dtype", [np.bool_, np.int8, np.int64, np.float32, np.float64])
def test_blocks_become_one_column(tiny: None, dtype: Any) -> None:
    numbers = (np.arange(100) % 5).astype(dtype)
    column = Column(dtype)
    for part in blocks(100):
        column.append(numbers[part])
    whole = column.finish()
    assert whole.dtype == dtype
    assert spilled(whole) == (numbers.nbytes > 64)
    assert_array_equal(whole, numbers)


def test_rows_of_several_numbers_stay_together(tiny: None) -> None:
    rows = np.arange(60.0).reshape(20, 3)
    column = Column(np.float64, (3,))
    for part in blocks(20):
        column.append(rows[part])
    assert_array_equal(column.finish(), rows)


def test_short_column_stays_in_memory_and_is_not_copied() -> None:
    column, block = Column(np.float64), np.arange(5.0)
    column.append(block)
    assert column.finish() is block
    assert Column(np.int8, (2,)).finish().shape == (0, 2)


def test_released_columns_keep_what_was_written(tiny: None) -> None:
    whole = keep(np.arange(10_000.0))
    whole[17] = -1.0
    release(whole, whole[3:5], None, np.arange(3))
    assert whole[17] == -1.0
    assert_array_equal(whole[18:], np.arange(18.0, 10_000.0))


def test_function_of_rows_in_blocks(tiny: None) -> None:
    a, b = np.arange(50.0), np.arange(50.0)[::-1]
    assert_array_equal(in_blocks(np.subtract, a, b), a - b)
    assert_array_equal(beside([a, b, a]), np.stack([a, b, a], axis=1))


def test_scratch_is_zero_and_writable(tiny: None) -> None:
    area = scratch((40, 3), np.float64)
    assert spilled(area)
    assert not area.any()
    area[:] = 1.0
    release(area)
    assert area.sum() == 120.0


def test_blocks_are_whole_multiples_but_for_the_last(tiny: None) -> None:
    cuts = list(blocks(23, 3))
    assert [c.stop - c.start for c in cuts] == [6, 6, 6, 5]
    assert [c.stop - c.start for c in blocks(23, 10)] == [10, 10, 3]
    assert list(blocks(0)) == []


def test_temporary_file_has_no_name_and_goes_with_its_column(tiny: None, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    whole = keep(np.arange(1000.0))
    assert spilled(whole)
    assert list(tmp_path.iterdir()) == []
    del whole
    gc.collect()


def test_full_temporary_folder_is_said(tiny: None, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    with pytest.raises(LogError, match=r"No space left on device; set TMPDIR"):
        keep(np.arange(1000.0))
    with pytest.raises(LogError, match=r"set TMPDIR"):
        scratch((1000,), np.float64)
