"""Lines that a first machine file offers for channels beside those that it uses."""

from __future__ import annotations

from dataclasses import replace

import pytest

from replay.log.source_options import SignalSource
from replay.machine.config import Machine, haulotte
from replay.setup.all_channels import ChannelRow
from replay.setup.offered import offered_line
from replay.signals.unit_doubts import per_minute

ASKED, READ = "/steer_commands", "/steer_states"


def machine() -> Machine:
    signals = {
        "steer.front.phi_ref": SignalSource(topic=ASKED, field="position[front_joint]", unit="rad"),
        "steer.front.phi": SignalSource(topic=READ, field="position[front_joint]", unit="rad"),
        "wheel.FR.u": SignalSource(topic="/motor_duty/command", field="data[0]", unit="1"),
    }
    return replace(haulotte(), signals=signals)


def row(topic: str, field: str, high: float = 0.9) -> ChannelRow:
    return ChannelRow(
        f"{topic}.{field}", topic, field, "", "log", 100, 50.0, -high, high, "", guessed=False, could_be=()
    )


@pytest.mark.parametrize(
    ("topic", "field", "name"),
    [
        (ASKED, "effort[front_joint]", "steer.front.u"),
        (READ, "effort[front_joint]", "steer.front.u_applied"),
        ("/motor_duty/measured", "data[0]", "wheel.FR.u_applied"),
        ("/motor_duty/measured", "data[1]", ""),
        ("/motor_duty/command", "data[0]", ""),
        ("/motor_temperature/measured", "data[0]", ""),
        (READ, "effort[rear_joint]", ""),
    ],
)
def test_what_stands_beside_a_used_signal_is_offered(topic: str, field: str, name: str) -> None:
    line = offered_line(machine(), row(topic, field))
    assert line.startswith(f'"{name}" = ') if name else not line


def test_a_torque_in_newton_metres_is_no_share() -> None:
    assert not offered_line(machine(), row(READ, "effort[front_joint]", high=14.0))


@pytest.mark.parametrize(
    ("name", "turns"), [("n_soll", True), ("n_ist_VL", True), ("nist", True), ("gain_set", False), ("main_act", False)]
)
def test_german_names_of_turns_per_minute(name: str, turns: bool) -> None:
    assert per_minute(name) is turns
