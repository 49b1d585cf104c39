"""Commanded speeds of wheels without a unit that are as large as the measured turns are turns, and are asked for."""

from __future__ import annotations

import numpy as np
import pytest

from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.setup.draft_notes import Draft
from replay.setup.unit_of_speeds import unit_of_commanded_turns
from replay.signals.signal import Signal, Signals

WHEELS = ("L", "R")
STAMPS = np.arange(1000, dtype=np.int64) * 20_000_000
TURNS = 4.0 * np.sin(np.arange(1000) / 60.0)


def _asked(factor: float, stated: str = "", measured: str = "rad/s") -> tuple[str, list[str]]:
    """Unit that the commanded speeds get, and the questions; `factor` is what is recorded of them per measured rad/s."""
    items, origins = {}, {}
    for w in WHEELS:
        for leaf, values, unit in (("v", TURNS, measured), ("v_ref", factor * TURNS, stated)):
            name = f"wheel.{w}.{leaf}"
            origins[name] = SignalSource(topic=f"/{w}", field=leaf, unit=unit)
            items[name] = Signal(name, STAMPS, values, origins[name], "log", guessed=True)
    draft = Draft(haulotte())
    unit_of_commanded_turns(draft, WHEELS, Signals(items, {}), origins)
    units = {origins[f"wheel.{w}.v_ref"].unit for w in WHEELS}
    assert len(units) == 1
    return units.pop() or "", draft.questions


@pytest.mark.parametrize(("factor", "unit"), [(1.0, "rad/s"), (60.0 / (2.0 * np.pi), "rpm"), (180.0 / np.pi, "deg/s")])
def test_what_is_as_large_as_the_measured_turns_has_their_unit(factor: float, unit: str) -> None:
    got, questions = _asked(factor)
    assert got == unit
    assert len(questions) == 1
    assert f"in {unit}? None is stated" in questions[0]


@pytest.mark.parametrize(
    ("factor", "stated", "measured"), [(0.4, "", "rad/s"), (1.0, "m/s", "rad/s"), (1.0, "", "m/s")]
)
def test_other_sizes_stated_units_and_speeds_of_the_rim_are_left(factor: float, stated: str, measured: str) -> None:
    assert _asked(factor, stated, measured) == (stated, [])
