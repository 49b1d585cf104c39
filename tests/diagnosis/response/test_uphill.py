"""A drive without a speed loop that is slower by a load is neither late nor at a share of its speed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.response.assess import assess_response
from diagnosis.response.spells import Spell
from diagnosis.response.uphill import lower_by_a_load, lower_of
from replay.faults import FaultMode
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, Array, followers_of, geometry, speeds

UPHILL = slice(1_200, 1_700)


def stated(change: Array) -> list[FaultMode]:
    measured, asked, body = speeds(5, ("FR",))
    y = measured["FR"]
    y[UPHILL] = change[UPHILL] * 1.0
    parts = assess_response(followers_of(measured, asked, body[:, :1]), geometry(("FR",)), None, Limits(), DT).parts
    return [f.mode for f in parts["FR"][0].findings]


def test_a_constant_that_is_missing_all_the_time_is_no_fault() -> None:
    assert stated(speeds(5, ("FR",))[0]["FR"] - 0.2) == []


@pytest.mark.parametrize(("share", "constant", "load"), [(1.0, -0.2, True), (0.6, 0.0, False), (0.7, -0.02, False)])
def test_a_share_is_no_load(*, share: float, constant: float, load: bool) -> None:
    told = np.repeat([0.4, 0.9, 0.6, 1.0], 6)
    blocks = SimpleNamespace(mean=share * told + constant, low=told - 0.01, high=told + 0.01)
    one: Any = SimpleNamespace(
        speed=None, response=SimpleNamespace(answered=True), wheel=SimpleNamespace(blocks=blocks)
    )
    assert lower_by_a_load(Spell(0, told.size, FaultMode.INEFFICIENT, 0.9), one) is load


def test_a_line_leaves_nothing_of_a_load_and_is_none_of_what_turns_the_other_way() -> None:
    asked = np.linspace(0.3, 1.0, 40)
    left = lower_of(0.9 * asked - 0.15, asked)
    assert left is not None
    assert np.abs(left).max() < 1e-9
    assert lower_of(-asked, asked) is None
    assert lower_of(asked[:4], asked[:4]) is None
