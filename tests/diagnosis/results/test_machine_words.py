"""Words that fit the machine: made from its file and the log's signals, and read back from a saved result."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis.results.machine_words import HYDRAULIC, MachineWords, machine_words, part_token, words_of
from diagnosis.results.sizes import amount, times_as_probable
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import Side
from replay.log.source_options import SignalSource
from replay.machine.config import Machine, haulotte

_ROBOT = Machine("robot", "", ("R", "L"), None)


def _named(topic: str, field: str) -> Machine:
    return replace(_ROBOT, signals={"wheel.R.u": SignalSource(topic=topic, field=field, unit="1")})


_ARM = Machine("arm", "", ("m1", "m2"), None, part="joint", speed_unit="rad/s")


@pytest.mark.parametrize(
    ("machine", "logged", "drive"),
    [
        (_ROBOT, ("cmd.v", "wheel.R.v"), "drive"),
        (_ROBOT, ("wheel.R.v", "wheel.R.effort"), "motor"),
        (_ROBOT, ("wheel.R.v", "wheel.R.u"), "valve"),
        (_ROBOT, ("steer.front.u_applied",), "valve"),
        (_ROBOT, ("wheel.R.pressure_a",), "valve"),
        (_ROBOT, ("wheel.R.effort", "steer.front.u"), "drive"),  # motors at the wheels, a valve at the axle
        (_ROBOT, ("wheel.R.effort", "wheel.R.u", "steer.front.u"), "valve"),
        (_named("/motor_duty/command", "data[0]"), ("wheel.R.effort", "wheel.R.u"), "motor"),
        (_named("/motor_duty/command", "data[0]"), ("wheel.R.u", "steer.front.u"), "drive"),
        (_named("/hydromotor/valve_cmd", "data[0]"), ("wheel.R.u",), "valve"),
        (_named("/pump_duty", "data[0]"), ("wheel.R.u",), "valve"),
        (replace(_ROBOT, drive="motor"), ("wheel.R.u",), "motor"),
        (replace(_ROBOT, drive="valve"), ("wheel.R.effort",), "valve"),
        (haulotte(), (), "drive"),
    ],
)
def test_what_moves_a_machine_follows_from_its_file_then_from_its_signals(
    machine: Machine, logged: tuple[str, ...], drive: str
) -> None:
    assert machine_words(machine, logged).drive == drive


@pytest.mark.parametrize(
    ("words", "sensor", "actuator", "either"),
    [
        (HYDRAULIC, "speed sensor", "drive valve", "speed sensor or drive valve"),
        (MachineWords("motor"), "speed sensor", "drive motor", "speed sensor or drive motor"),
        (MachineWords("drive"), "speed sensor", "drive", "speed sensor or drive"),
        (MachineWords("motor", "joint"), "joint sensor", "joint motor", "joint sensor or motor"),
        (MachineWords("drive", "joint"), "joint sensor", "joint drive", "joint sensor or drive"),
    ],
)
def test_one_name_for_each_part(words: MachineWords, sensor: str, actuator: str, either: str) -> None:
    found = [words.part_name(Kind.WHEEL, side) for side in (Side.SENSOR, Side.ACTUATOR, Side.SENSOR_OR_ACTUATOR)]
    assert found == [sensor, actuator, either]
    assert words.part_name(Kind.STEER, Side.ACTUATOR) == f"steering {words.drive}"
    assert words.part_words("crane", "boom", "hook_side") == "boom hook side"


def test_sentences_of_families_take_the_words_of_the_machine() -> None:
    arm = machine_words(_ARM, ("wheel.m1.v", "wheel.m1.v_ref"))
    text = f"The {part_token(Kind.WHEEL, Side.ACTUATOR)} of a {{wheel}} gave {amount(0.5, 'm/s')}, other {{wheels}} did not."
    assert arm.fill(text) == "The joint drive of a joint gave 0.5 rad/s, other joints did not."
    assert HYDRAULIC.fill(text) == "The drive valve of a wheel gave 0.5 m/s, other wheels did not."
    assert arm.evidence(Tier.MODEL, Kind.WHEEL) == "joint model"
    assert "other joints" in arm.decided(Tier.RESPONSE, Kind.WHEEL, Side.SENSOR)
    assert HYDRAULIC.fill("a name with {braces} stays") == "a name with {braces} stays"


def test_commands_are_said_in_percent() -> None:
    assert HYDRAULIC.fill(amount(0.021, "of full opening")) == "2.1 % of opening"
    assert HYDRAULIC.amount(0.021, "of full opening") == "2.1 % of opening"
    assert MachineWords("motor").amount(0.5, "of full opening") == "50 % of full command"
    assert MachineWords(speed_unit="deg/s", part="joint").amount(0.5) == "0.5 deg/s"


def test_signals_have_the_unit_of_the_machine() -> None:
    arm = machine_words(_ARM)
    assert [arm.unit_of(n) for n in ("wheel.m1.v", "cmd.v", "wheel.m1.u", "steer.a.phi", "no.signal")] == [
        "rad/s",
        "m/s",
        "of full command",
        "rad",
        "",
    ]


def test_log_evidence_is_said_in_words() -> None:
    assert times_as_probable(214866.0) == "more than a million times as probable"
    assert times_as_probable(8.0) == "about 3\u202f000 times as probable"
    assert times_as_probable(1.0) == "2.7 times as probable"
    assert times_as_probable(0.0) == "about as probable"
    assert times_as_probable(-4.0) == "less probable"


def test_parts_with_the_same_sides_are_listed_once() -> None:
    parts = [("FR", "sensor"), ("FR", "actuator"), ("FL", "sensor"), ("FL", "actuator"), ("RR", "sensor")]
    assert HYDRAULIC.listed("wheel", parts) == "FR and FL speed sensor and drive valve; RR speed sensor"


def test_a_saved_result_keeps_its_words_and_an_older_one_speaks_of_valves() -> None:
    arm = machine_words(_ARM)
    assert words_of({"words": arm.row()}) == arm
    assert words_of({}) == HYDRAULIC
