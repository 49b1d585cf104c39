from __future__ import annotations

import mmap
import os

import pytest

from diagnosis.audit.isolation import limits
from diagnosis.audit.isolation.limits import Limits, held_mb, usual_memory_mb


@pytest.mark.parametrize("changes", [{"memory_mb": 0}, {"wall_s": -1.0}, {"cpu_s": float("nan")}])
def test_limits_are_positive_numbers(changes: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(changes))):
        Limits(**changes)


@pytest.mark.skipif(not limits.LINUX, reason="the system tells of no other process")
def test_held_memory_grows_with_what_is_held() -> None:
    before = held_mb(os.getpid())
    with mmap.mmap(-1, 64 << 20, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS) as held:  # fresh, whatever lies free
        held[:] = bytes(64 << 20)
        assert 60 < held_mb(os.getpid()) - before < 140


def test_nothing_is_known_of_a_process_that_is_not_there() -> None:
    assert held_mb(2**30) == 0.0


def test_more_jobs_have_no_more_memory_each() -> None:
    assert 256 <= usual_memory_mb(1000) <= usual_memory_mb(1) <= 4096
