"""Numbers of a machine file that scale all wheels alike, against odometry, the command and the wheels' own speeds."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.geometry import Geometry, WheelGeometry
from replay.setup.body_scale import scale_doubts
from replay.signals.signal import Signal
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

DT = 0.05


def doubts(wheels: float, body: str = "odom.v", unit: str = "rad/s", max_speed: float = 2.0) -> tuple[str, ...]:
    """Of two wheels that run `wheels` times as fast as the body."""
    t = np.arange(0.0, 60.0, DT)
    v = 1.2 * np.sin(0.2 * t) + 0.5
    signals = {"wheel.L.v": wheels * v, "wheel.R.v": wheels * v, body: v}
    line = Timeline(0, round(DT * 1e9), t.size, signals, {}, dict.fromkeys(signals, "log"), {})
    places = {"L": WheelGeometry(0.0, 0.3, 0.0, "fixed"), "R": WheelGeometry(0.0, -0.3, 0.0, "fixed")}
    machine = Machine("m", "", ("L", "R"), Geometry(places, 0.165), max_speed=max_speed)
    stamps = np.round(t * 1e9).astype(np.int64)
    recorded = {
        f"wheel.{w}.v": Signal(f"wheel.{w}.v", stamps, wheels * v, SignalSource(unit=unit), "log", False) for w in "LR"
    }
    return scale_doubts(line, machine, recorded)


def test_a_right_machine_raises_no_doubt() -> None:
    assert doubts(1.0) == doubts(1.1) == doubts(1.0, "cmd.v") == doubts(0.7, "cmd.v") == ()


def test_a_radius_for_a_diameter() -> None:
    (doubt,) = doubts(0.5)
    assert doubt == (
        "by odometry the machine is 2 times as fast as by its wheels throughout: is wheel_diameter = 0.165 (is it the radius?), "
        "gear_ratio = 1 or the unit of wheel.*.v right? A wheel of 0.33 m would fit"
    )
    (doubt,) = doubts(0.5, "cmd.v")
    assert doubt.startswith("by the command the machine is 2 times as fast as by its wheels throughout")


@pytest.mark.parametrize(("factor", "words"), [(2 * np.pi / 60, "rad/s read as rpm"), (3.6, "km/h read as m/s")])
def test_units(factor: float, words: str) -> None:
    doubt = doubts(factor, max_speed=2.0 * max(factor, 1.0))[0]
    assert doubt.endswith(f"is the unit of wheel.*.v right ({words}?)")


def test_speeds_of_the_rim_have_no_diameter() -> None:
    (doubt,) = doubts(0.5, unit="m/s")
    assert doubt.endswith("is the unit or gain of wheel.*.v right?")


def test_a_top_speed_that_is_not_that_of_the_wheels() -> None:
    (slow,) = doubts(1.0, max_speed=1.2)
    assert slow == "max_speed = 1.2 m/s is that of the rim of a wheel, and one reaches 1.7 m/s: write max_speed = 1.7"
    (fast,) = doubts(1.0, max_speed=6.0)
    assert (
        fast == "max_speed = 6 m/s, and no wheel is faster than 1.7 m/s: is it in km/h? That would be max_speed = 1.67"
    )
