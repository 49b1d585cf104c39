"""The search for cycles: seldom while modules are loaded, and nothing that a program without it does is changed."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from cli.terminal.collecting import all_loaded, collect_little


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    before = gc.get_threshold()
    yield
    gc.unfreeze()
    gc.set_threshold(*before)


def test_what_was_loaded_is_not_searched_again_and_only_once() -> None:
    collect_little()
    seldom = gc.get_threshold()[0]
    all_loaded()
    kept = gc.get_freeze_count()
    assert kept > 0
    assert gc.get_threshold()[0] < seldom
    more = [[i] for i in range(1000)]
    all_loaded()
    assert gc.get_freeze_count() < kept + len(more)


def test_a_program_that_uses_this_as_a_library_keeps_its_own_habits() -> None:
    gc.set_threshold(700, 10, 10)
    frozen = gc.get_freeze_count()
    all_loaded()
    assert gc.get_freeze_count() == frozen
    assert gc.get_threshold() == (700, 10, 10)
