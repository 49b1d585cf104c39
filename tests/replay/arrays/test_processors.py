"""Parts of a mission on several processors: what comes out is what one after the other would give."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from replay.arrays import processors
from replay.arrays.processors import beside, each


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


@pytest.mark.usefixtures("two")
def test_work_beside_other_work_is_done_meanwhile() -> None:
    barrier = threading.Barrier(2)
    with beside(lambda: _meets(barrier, 4), rows=10) as found:
        assert _meets(barrier, 2) == 20
        assert found() == 40
    assert threading.active_count() == 1 or not [t for t in threading.enumerate() if t.name.startswith("ThreadPool")]


@pytest.mark.parametrize(("count", "rows"), [(1, 10), (2, 10_000_000)])
def test_work_without_a_processor_or_memory_for_it_is_done_where_its_result_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, count: int, rows: int
) -> None:
    monkeypatch.setattr(processors, "processors", lambda: count)
    monkeypatch.setattr(processors, "_alone", False)
    order: list[str] = []
    with beside(lambda: order.append(threading.current_thread().name), rows) as found:
        order.append("before")
        found()
    assert order == ["before", threading.current_thread().name]


@pytest.mark.usefixtures("two")
def test_no_more_threads_work_than_there_are_processors_and_one_that_waits_leaves_its_place() -> None:
    at_work, most, lock = [0], [0], threading.Lock()

    def work(_: int) -> int:
        with lock:
            at_work[0] += 1
            most[0] = max(most[0], at_work[0])
        threading.Event().wait(0.01)
        with lock:
            at_work[0] -= 1
        return threading.get_ident()

    with beside(lambda: each(work, range(8), rows=10), rows=10) as found:
        mine = each(work, range(2), rows=10)  # the second processor is taken: one after the other
        assert set(mine) == {threading.get_ident()}
        assert len(found()) == 8
        barrier = threading.Barrier(2)
        assert each(lambda i: _meets(barrier, i), [1, 2], rows=10) == [10, 20]  # it is free again
    assert most[0] == 2
    with beside(lambda: each(work, range(8), rows=10), rows=10) as found:
        threads = found()  # waits, and leaves its place to what it waits for
    assert threading.get_ident() not in threads
    assert processors._places._taken == 0


@pytest.mark.usefixtures("two")
def test_errors_come_in_the_order_of_one_processor_and_every_place_is_free_again() -> None:
    def fails(name: str) -> None:
        raise ValueError(name)

    with pytest.raises(ValueError, match="beside"), beside(lambda: fails("beside"), rows=10) as found:
        found()
    with pytest.raises(ValueError, match="body"), beside(lambda: fails("beside"), rows=10):
        fails("body")

    def begun(item: int) -> None:
        if item == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        each(lambda item: item, [1, 2, 3], rows=10, begun=begun)
    assert processors._places._taken == 0


@pytest.mark.usefixtures("two")
def test_after_an_interrupt_nothing_more_is_begun() -> None:
    done: list[int] = []
    here = threading.get_ident()

    def work(item: int) -> None:
        if threading.get_ident() == here:
            raise KeyboardInterrupt
        threading.Event().wait(0.01)
        done.append(item)

    with pytest.raises(KeyboardInterrupt):
        each(work, range(200), rows=10)
    assert len(done) < 20
