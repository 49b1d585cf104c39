"""Parts of a mission on several processors: what comes out is what one after the other would give."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from replay.arrays import processors
from replay.arrays.processors import each


@pytest.fixture
def two(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processors, "processors", lambda: 2)
    monkeypatch.setattr(processors, "_alone", False)


def _meets(barrier: threading.Barrier, item: int) -> int:
    barrier.wait(timeout=10)
    return 10 * item


@pytest.mark.usefixtures("two")
def test_two_parts_are_worked_on_at_once_and_stay_in_order() -> None:
    barrier = threading.Barrier(2)
    begun: list[int] = []
    assert each(lambda item: _meets(barrier, item), [3, 1, 2, 4], rows=10, begun=begun.append) == [30, 10, 20, 40]
    assert begun == [3, 1, 2, 4]


@pytest.mark.usefixtures("two")
@pytest.mark.parametrize("rows", [10, 10_000_000])
def test_each_part_is_told_of_by_the_caller_before_it_is_worked_on(rows: int) -> None:
    order: list[tuple[str, int]] = []
    here = threading.current_thread()

    def begun(item: int) -> None:
        assert threading.current_thread() is here
        order.append(("begun", item))

    each(lambda item: order.append(("done", item)), [1, 2, 3], rows, begun)
    assert all(order.index(("begun", i)) < order.index(("done", i)) for i in (1, 2, 3))


@pytest.mark.usefixtures("two")
def test_long_missions_are_worked_on_one_part_at_a_time() -> None:
    threads = each(lambda _: threading.current_thread(), [1, 2, 3], rows=10_000_000)
    assert set(threads) == {threading.current_thread()}


def test_a_process_among_others_uses_one_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processors, "processors", lambda: 2)
    monkeypatch.setattr(processors, "_alone", False)
    processors.use_one()
    assert set(each(lambda _: threading.current_thread(), [1, 2], rows=10)) == {threading.current_thread()}


@pytest.mark.usefixtures("two")
def test_after_an_error_nothing_more_is_begun() -> None:
    done: list[int] = []
    gate = threading.Event()

    def work(item: int) -> None:
        if item == 0:
            gate.wait(timeout=10)  # until the other processor's part has failed
            raise ValueError(item)
        if item == 1:
            gate.set()
            raise KeyError(item)
        threading.Event().wait(0.05)
        done.append(item)

    with pytest.raises(ValueError, match="0"):
        each(work, range(100), rows=10)
    assert len(done) < 90


@pytest.mark.usefixtures("two")
def test_the_first_error_is_raised_and_what_numpy_ignores_holds() -> None:
    def divided(by: float) -> float:
        if by < 0:
            raise ValueError("below 0")
        return float(np.float64(1.0) / np.float64(by))

    with np.errstate(divide="ignore"):
        assert each(divided, [0.0, 2.0], rows=10) == [np.inf, 0.5]
    with pytest.raises(ValueError, match="below 0"):
        each(divided, [1.0, -1.0], rows=10)
