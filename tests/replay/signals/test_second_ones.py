"""A number behind a quantity tells the second measurement of one part from the first; valves and pumps may be told by other names."""

from __future__ import annotations

import numpy as np
import pytest

from replay.log.raw_log import Channel, LogSummary, RawLog
from replay.machine.config import Machine, haulotte
from replay.machine.geometry import Geometry, WheelGeometry
from replay.signals.mapping import map_signals
from replay.signals.second_ones import number_of
from replay.signals.unsure_names import unsure
from replay.signals.unsure_openings import unsure_opening

STAMPS = np.arange(400, dtype=np.int64) * 10**7


def machine() -> Machine:
    places = {
        w: WheelGeometry(x, y, 0.0, f"{w}_steer")
        for w, x, y in (("FR", 1.0, -1.0), ("FL", 1.0, 1.0), ("RR", -1.0, -1.0), ("RL", -1.0, 1.0))
    }
    return Machine("crab", "", tuple(places), Geometry(places, 1.0))


def topics(**fields: int) -> dict[str, Channel]:
    """Channels of topics, ``topic__field``, with as many samples as given."""
    out = {}
    for name, count in fields.items():
        topic, field = "/" + name.replace("__", ".").replace("_at_", "/").split(".")[0], name.split("__")[1]
        values = 0.8 * np.sin(np.arange(count) * 0.1)
        out[f"{topic}.{field}"] = Channel(f"{topic}.{field}", topic, field, STAMPS[:count], values, None, "own/msg/Own")
    return out


def log(channels: dict[str, Channel]) -> RawLog:
    return RawLog("run.mcap", "mcap", "header", channels, LogSummary("run.mcap", "mcap", 0, int(STAMPS[-1]), ()))


@pytest.mark.parametrize(
    ("label", "number"),
    [
        ("/wheel_FL/speed.speed", 0),
        ("/wheel_FL/speed2.speed", 2),
        ("/steer_FR/angle2.angle", 2),
        ("FL_HubSpeedAct2", 2),
        ("wheel_2.speed", 0),
        ("w1_speed", 0),
        ("/steer_FL/angle_redundant.angle", 2),
    ],
)
def test_the_number_of_a_measurement_follows_its_quantity(label: str, number: int) -> None:
    assert number_of(label) == number


@pytest.mark.parametrize("more", ["first", "second"])
def test_the_second_of_two_topics_is_never_the_first_however_many_samples_it_has(more: str) -> None:
    one, two = (400, 390) if more == "first" else (390, 400)
    channels = topics(
        wheel_FL_at_speed__speed=one,
        wheel_FL_at_speed2__speed=two,
        steer_FL_at_state__angle=one,
        steer_FL_at_angle2__angle=two,
    )
    found = map_signals([log(channels)], machine())
    assert found.items["wheel.FL.v"].origin.topic == "/wheel_FL/speed"
    assert found.items["steer.FL_steer.phi"].origin.topic == "/steer_FL/state"
    assert "may be a second sensor beside" in found.missing["steer.FL_steer.phi_true"]
    asked = {u.signal: u.origin.topic for u in unsure(channels, machine())}
    assert asked["wheel.FL.v_true"] == "/wheel_FL/speed2"
    assert asked["steer.FL_steer.phi_true"] == "/steer_FL/angle2"


def test_valves_and_pumps_by_other_names_are_asked_for() -> None:
    channels = topics(
        wheel_FL_at_command__pump_cmd=400,
        wheel_FL_at_swash__position=400,
        steer_FL_at_spool__position=400,
        steer_FL_at_arm__position=400,
    )
    assert {u.signal: u.origin.topic for u in unsure(channels, machine())} == {
        "wheel.FL.u": "/wheel_FL/command",
        "wheel.FL.u_applied": "/wheel_FL/swash",
        "steer.FL_steer.u_applied": "/steer_FL/spool",
    }


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "1"), (100.0, "%"), (600.0, None), (0.0, None)])
def test_an_opening_reaches_no_more_than_full(scale: float, unit: str | None) -> None:
    values = scale * 0.9 * np.sin(np.arange(400) * 0.1)
    channel = Channel("FL_swash_position", "", "FL_swash_position", STAMPS, values, None, "table")
    told = unsure_opening(channel, haulotte())
    assert told == (None if unit is None else ("wheel.FL.u_applied", unit))
