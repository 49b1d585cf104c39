"""What is said of wheels that make something else of their commands than the others: readings that are alike are not denied."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.response.machine import unlike

N = 4000


def judged(scale: float, weight: float, disabled: float) -> Any:
    """A wheel that reads `scale` of its command, but nothing in a last share of the mission, and the answer found for it."""
    t = np.arange(N) * 0.05
    asked = 0.5 * np.sin(0.3 * t)
    y = np.where(np.arange(N) < (1.0 - disabled) * N, scale * asked, 0.0)
    commands = asked[::10, None]
    response = SimpleNamespace(answered=True, left=lambda _: np.array([weight]))
    data = SimpleNamespace(y=y, asked=asked, fresh=np.ones(N, bool), commands=commands)
    return SimpleNamespace(data=data, response=response)


@pytest.mark.parametrize("disabled", [0.0, 0.5])
@pytest.mark.parametrize("scale", [0.6, 1.5])
def test_a_scaled_wheel_is_told_with_what_it_reads(scale: float, disabled: float) -> None:
    said = unlike({"R": judged(scale, scale, disabled), "L": judged(1.0, 1.0, disabled)})
    assert f"it reads {scale:.2f} × what the other {{wheels}} make" in said["R"].text
    assert "scaled or wrongly mapped" in said["R"].text


def test_wheels_that_read_the_same_are_not_said_to_read_shares_of_each_other() -> None:
    said = unlike({"R": judged(1.0, 0.16, 0.6), "L": judged(1.0, 0.2, 0.6)})
    for wheel in "RL":
        assert "it reads 1.00 × what the other {wheels} make" in said[wheel].text
        assert "did not follow its commands all the time" in said[wheel].text
        assert "scaled" not in said[wheel].text


def test_wheels_alike_are_not_told() -> None:
    assert unlike({"R": judged(1.0, 1.0, 0.0), "L": judged(0.97, 0.97, 0.0)}) == {}
