"""A wheel that does a share of what it is told, or as another that is told the same, keeps no speed of its own."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.response.as_told import in_share, with_another
from diagnosis.response.assess import assess_response
from replay.faults import FaultMode
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, WHEELS, followers_of, geometry, speeds


def _one(y: np.ndarray, asked: np.ndarray) -> Any:
    blocks = SimpleNamespace(start=np.arange(y.size) * 5, mean=y)
    return SimpleNamespace(wheel=SimpleNamespace(blocks=blocks), data=SimpleNamespace(asked=np.repeat(asked, 5)))


def test_what_another_wheel_does_that_is_told_the_same_is_what_it_should_do() -> None:
    asked = np.full(8, 1.2)
    one, other = _one(np.full(8, 1.31), asked), _one(np.full(8, 1.3), asked)
    off = np.full(8, 0.1)
    assert with_another(one, [other], off, 1.3).all()
    assert not with_another(one, [_one(np.full(8, 1.3), asked - 0.5)], off, 1.3).any()
    assert not with_another(_one(np.full(8, 0.7), asked), [other], np.full(8, 0.5), 1.3).any()


def test_a_share_explains_what_changes_with_the_command() -> None:
    asked = np.repeat([0.4, 0.5, 0.3], 10)
    assert in_share(0.6 * asked, asked, 0.6)
    assert not in_share(np.full(30, 0.3), asked, 0.72)


@pytest.mark.parametrize("seed", [61, 62, 63, 64])
def test_a_wheel_with_a_share_of_its_command_is_nowhere_stuck(seed: int) -> None:
    measured, asked, body = speeds(seed)
    measured["FL"] = np.round(0.6 * measured["FL"], 3)
    parts = assess_response(followers_of(measured, asked, body), geometry(WHEELS), None, Limits(), DT).parts
    found = [(w, f.mode) for w, sides in parts.items() for a in sides for f in a.findings]
    assert {w for w, _ in found} <= {"FL"}
    assert FaultMode.STUCK not in {mode for _, mode in found}


@pytest.mark.parametrize("seed", [71, 72])
def test_beside_a_wheel_that_reads_a_share_all_the_time_no_other_is_named(seed: int) -> None:
    measured, asked, body = speeds(seed)
    measured["RR"] = np.round(0.65 * measured["RR"], 3)
    parts = assess_response(followers_of(measured, asked, body), geometry(WHEELS), None, Limits(), DT).parts
    assert {w for w, sides in parts.items() for a in sides for _ in a.findings} <= {"RR"}
