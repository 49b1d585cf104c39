"""What comes again and again is one fault, as severe as the worst of it."""

from __future__ import annotations

from diagnosis.results.recurring import Seen, counted


def seen(n: int, mode: str = "noisy", part: str = "FR", **rows: float) -> list[Seen]:
    return [Seen(part, "actuator", mode, tuple((rows or {mode: 0.9, "healthy": 0.1}).items()))] * n


def test_few_are_as_many() -> None:
    assert counted([seen(1), seen(1)]) == [1, 1]


def test_many_are_one_in_the_list_of_the_worst() -> None:
    assert counted([seen(3), seen(2)]) == [1, 0]
    assert counted([[], seen(7)]) == [0, 1]
    assert counted([seen(1, part="RR"), seen(7)]) == [1, 1]


def test_one_that_may_be_of_the_same_row_is_one_of_them() -> None:
    other = seen(1, "inefficient", inefficient=0.55, noisy=0.38)
    assert counted([[], [*seen(2), *other]]) == [0, 1]
    assert counted([[], [*seen(2), *seen(1, "inefficient", inefficient=0.95, noisy=0.05)]]) == [0, 3]
