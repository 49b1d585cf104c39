"""Columns that outgrow memory are the same numbers as those that do not."""

from __future__ import annotations

import errno
import gc
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from replay.arrays import column_store
from replay.arrays.blocks import blocks, release
from replay.arrays.column_store import ColumnStore
from replay.errors import LogError


@pytest.fixture
def tiny() -> ColumnStore:
    """Everything beyond a few numbers goes to a file."""
    return ColumnStore(block=7, always=64, room=0, flush=32)


def in_file(array: np.ndarray) -> bool:
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    return base is not None


@pytest.mark.parametrize("dtype", [np.bool_, np.int8, np.int64, np.float32, np.float64])
def test_blocks_become_one_column(tiny: ColumnStore, dtype: Any) -> None:
    numbers = (np.arange(100) % 5).astype(dtype)
    column = tiny.column(dtype)
    for part in tiny.blocks(100):
        column.append(numbers[part])
    whole = column.finish()
    assert whole.dtype == dtype
    assert in_file(whole) == (numbers.nbytes > 64)
    assert_array_equal(whole, numbers)


def test_rows_of_several_numbers_stay_together(tiny: ColumnStore) -> None:
    rows = np.arange(60.0).reshape(20, 3)
    column = tiny.column(np.float64, (3,))
    for part in tiny.blocks(20):
        column.append(rows[part])
    assert_array_equal(column.finish(), rows)


def test_short_column_stays_in_memory_and_is_not_copied() -> None:
    column, block = ColumnStore().column(np.float64), np.arange(5.0)
    column.append(block)
    assert column.finish() is block
    assert ColumnStore().column(np.int8, (2,)).finish().shape == (0, 2)


def test_released_columns_keep_what_was_written(tiny: ColumnStore) -> None:
    whole = tiny.keep(np.arange(10_000.0))
    whole[17] = -1.0
    release(whole, whole[3:5], None, np.arange(3))
    assert whole[17] == -1.0
    assert_array_equal(whole[18:], np.arange(18.0, 10_000.0))


def test_end_of_a_stage_leaves_all_columns_as_they_were(tiny: ColumnStore) -> None:
    first, second = tiny.keep(np.arange(1000.0)), tiny.keep(np.arange(1000.0) ** 2)
    tiny.end_stage()
    assert_array_equal(first, np.arange(1000.0))
    assert_array_equal(second, np.arange(1000.0) ** 2)


def test_all_that_ask_for_ones_get_the_same_ones(tiny: ColumnStore) -> None:
    assert_array_equal(tiny.ones(1000), np.ones(1000))
    assert tiny.ones(1000) is tiny.ones(1000)
    assert tiny.ones(10).size == 10


def test_function_of_rows_in_blocks(tiny: ColumnStore) -> None:
    a, b = np.arange(50.0), np.arange(50.0)[::-1]
    assert_array_equal(tiny.map(np.subtract, a, b), a - b)
    assert_array_equal(tiny.beside([a, b, a]), np.stack([a, b, a], axis=1))


def summed(before: float, x: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], float]:
    total = before + np.cumsum(x)
    return (total, total > 100.0), float(total[-1])


@pytest.mark.parametrize("size", [1, 7, 8, 50])
def test_recursion_in_blocks_carries_its_state(tiny: ColumnStore, size: int) -> None:
    x = np.arange(1.0, size + 1.0)
    (total, large), last = tiny.scan(summed, 1.0, x, multiple=3)
    assert_array_equal(total, 1.0 + np.cumsum(x))
    assert_array_equal(large, total > 100.0)
    assert last == total[-1]
    assert in_file(total) == (x.nbytes > 64)


def test_nothing_is_scanned_as_one_empty_block(tiny: ColumnStore) -> None:
    (total,), last = tiny.scan(lambda state, x: ((x * 2,), state), 3.0, np.empty(0))
    assert (len(total), last) == (0, 3.0)


def test_room_is_shared_by_the_columns_of_a_store_and_free_again_after_them() -> None:
    store = ColumnStore(block=50, always=64, room=1000)
    first, second = store.keep(np.zeros(100)), store.keep(np.zeros(100))
    assert (in_file(first), in_file(second), store.used) == (False, True, 800)
    assert not in_file(ColumnStore(block=50, always=64, room=1000).keep(np.zeros(100)))
    del first
    gc.collect()
    assert store.used == 0
    store.release()
    assert_array_equal(second, np.zeros(100))


def test_zeros_are_zero_and_writable(tiny: ColumnStore) -> None:
    area = tiny.zeros((40, 3), np.float64)
    assert in_file(area)
    assert not area.any()
    area[:] = 1.0
    release(area)
    assert area.sum() == 120.0


def test_blocks_are_whole_multiples_but_for_the_last(tiny: ColumnStore) -> None:
    cuts = list(tiny.blocks(23, 3))
    assert [c.stop - c.start for c in cuts] == [6, 6, 6, 5]
    assert [c.stop - c.start for c in tiny.blocks(23, 10)] == [10, 10, 3]
    assert list(blocks(0)) == []
    assert [c.stop for c in blocks(23, 3, rows=10)] == [9, 18, 23]


def test_temporary_file_has_no_name_and_goes_with_its_column(
    tiny: ColumnStore, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    whole = tiny.keep(np.arange(1000.0))
    assert in_file(whole)
    assert list(tmp_path.iterdir()) == []
    del whole
    gc.collect()


def test_full_temporary_folder_is_said(tiny: ColumnStore, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    with pytest.raises(LogError, match=r"No space left on device; set TMPDIR"):
        tiny.keep(np.arange(1000.0))
    with pytest.raises(LogError, match=r"set TMPDIR"):
        tiny.zeros((1000,), np.float64)


def test_columns_are_made_by_one_thread_while_another_lets_go_of_them(
    tiny: ColumnStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = sys.getswitchinterval()
    monkeypatch.setattr(column_store, "unload", lambda mapped: None)
    kept: list[NDArray[Any]] = []
    making = threading.Thread(target=lambda: kept.extend(tiny.zeros((4096,), np.float64) for _ in range(400)))
    sys.setswitchinterval(1e-6)
    try:
        making.start()
        while making.is_alive():
            tiny.release()
    finally:
        sys.setswitchinterval(usual)
        making.join()
    assert len(kept) == 400
