"""Names that state another unit than the machine file."""

from __future__ import annotations

import pytest

from replay.log.source_options import SignalSource
from replay.signals.unit_conflicts import unit_conflict


@pytest.mark.parametrize(
    ("label", "unit", "gain", "conflict"),
    [
        ("Speed FR [m/s]", "km/h", 1.0, True),
        ("Angle (deg)", "rad", 1.0, True),
        ("Speed FR [m/s]", "m/s", 1.0, False),
        ("Speed FR [m/s]", "km/h", 3.6, False),
        ("Speed FR [m/s]", "rpm", 1.0, False),
        ("Spool FR [%]", "fraction", 1.0, True),
        ("Spool FR [2]", "fraction", 1.0, False),
        ("Speed FR", "km/h", 1.0, False),
    ],
)
def test_another_unit_of_the_same_quantity_is_told(label: str, unit: str, gain: float, *, conflict: bool) -> None:
    text = unit_conflict({"wheel.FR.v": SignalSource(column=label, unit=unit, gain=gain)})
    assert bool(text) is conflict
    assert not conflict or (label in text and unit in text)


def test_few_of_many_are_named() -> None:
    text = unit_conflict({f"wheel.{w}.v": SignalSource(column=f"{w} [m/s]", unit="km/h") for w in "ABCD"})
    assert text.endswith("and 2 more channels likewise, while their names say m/s")
