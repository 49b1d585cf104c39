"""What is said of a plot whose most probable row is not the one that a fault is stated as."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from diagnosis.report.momentary import momentary_words
from replay.faults import FaultMode, Side

STEP = 0.01
FAULT: dict[str, Any] = {
    "component": "RR", "side": Side.ACTUATOR, "mode": FaultMode.INEFFICIENT, "start_s": 1.0, "stop_s": 2.0,
}  # fmt: skip


def columns(noisy: float, per: int = 1) -> dict[str, np.ndarray[Any, Any]]:
    """A valve that is most probably disturbed for such a share of the fault, then inefficient, and healthy outside of it."""
    top = np.full(300, "healthy", dtype=object)
    top[100:200] = "inefficient"
    top[100 : 100 + round(100 * noisy)] = "noisy"
    rows = {m: np.where(top == m, 0.9, 0.05) for m in ("healthy", "inefficient", "noisy")}
    return {f"evidence.RR.actuator.p_{m}": np.repeat(x, 2 if per > 1 else 1) for m, x in rows.items()}


@pytest.mark.parametrize("per", [1, 10])
def test_rows_that_take_turns_are_said(per: int) -> None:
    said = momentary_words(FAULT, columns(0.7, per), (0.0, STEP / (2 if per > 1 else 1)), per)  # type: ignore[arg-type]
    assert "disturbed is the most probable for 70 % of it, inefficient for 30 %, with 1 change from" in said


def test_a_plot_that_shows_what_is_stated_needs_no_word() -> None:
    assert momentary_words(FAULT, columns(0.05), (0.0, STEP)) == ""  # type: ignore[arg-type]


def test_rows_that_were_weighed_by_whole_faults_do_not_take_turns() -> None:
    """Of a model's evidence the probabilities are those of the fault, and not known outside of it."""
    whole = {name: np.where(np.arange(300) // 100 == 1, x[150], np.nan) for name, x in columns(1.0).items()}
    assert momentary_words(FAULT, whole, (0.0, STEP)) == ""  # type: ignore[arg-type]
