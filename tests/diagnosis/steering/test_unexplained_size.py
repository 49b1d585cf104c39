"""What no fault explains on an axle is said with its size and time, and the reason of what is not judged is the one that holds."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.channels.sample_status import PAIR
from diagnosis.results.assessment import CODE
from diagnosis.steering.side_findings import SideFindings
from diagnosis.steering.states import reasons_of, states_of
from diagnosis.steering.unexplained_size import size_words
from replay.faults import Side, State

SIZE, DT = 4000, 0.01
NOTHING = SideFindings((), ())


def axle(off: float = 0.0, *, blind: bool = False, resolved: bool = True) -> Any:
    angle = np.full(SIZE, 0.3)
    second = angle.copy()
    angle[1000:3000] += off
    blocks = SimpleNamespace(
        mean=angle,
        count=np.ones(SIZE),
        dt=DT,
        length=1,
        blind=np.full(SIZE, blind),
        status=np.full(SIZE, PAIR),
        redundancy=SimpleNamespace(
            angle=second, opening=second + 2 * off, command=second, known=np.zeros(SIZE, np.bool_)
        ),
    )
    noise = SimpleNamespace(white=1e-8, lsb=0.0, resolved=resolved)
    model = SimpleNamespace(noise=noise, rate_error=0.0, stop=0.6, opening_measured=False)
    return SimpleNamespace(blocks=blocks, model=model, driven=SimpleNamespace(command=np.zeros(SIZE)))


def inputs(*, twice: bool = True) -> Any:
    values = np.full(SIZE, 0.3)
    return SimpleNamespace(
        angle=values, command=values, angle_redundant=twice, valve_redundant=twice, timeline=SimpleNamespace(size=SIZE, dt=DT)
    )  # fmt: skip


def path(sensor: np.ndarray | None = None) -> Any:
    row = np.zeros(SIZE, np.int8) if sensor is None else sensor
    return SimpleNamespace(
        sensor=row, actuator=row, mean=np.full((SIZE, 2), 0.3), variance=np.full((SIZE, 2), 1e-9)
    )  # fmt: skip


def test_the_size_of_what_is_left_open_is_told_against_what_it_is_held_to() -> None:
    left = SideFindings((), ((1000, 2000), (2000, 3000)))
    said = size_words(Side.SENSOR, left, inputs(), axle(-0.035), path())
    assert said == "off its second measurement by up to −2° at 10.0–30.0 s"
    alone = size_words(Side.SENSOR, left, inputs(twice=False), axle(-0.035), path())
    assert alone == "off what its model expects by up to −2° at 10.0–30.0 s"
    assert size_words(Side.ACTUATOR, left, inputs(), axle(0.05), path()) == (
        "off its command by up to 10{percent} at 10.0–30.0 s"
    )


def test_what_is_brief_or_hardly_off_has_no_size() -> None:
    left = SideFindings((), ((1000, 2000),))
    assert size_words(Side.SENSOR, left, inputs(), axle(0.003), path()) == ""
    assert size_words(Side.SENSOR, SideFindings((), ((1000, 1050),)), inputs(), axle(0.1), path()) == ""
    assert size_words(Side.SENSOR, NOTHING, inputs(), axle(0.1), path()) == ""
    assert size_words(Side.ACTUATOR, left, inputs(twice=False), axle(0.1), path()) == ""


def test_a_sensor_whose_noise_shows_is_never_open_for_want_of_steering() -> None:
    row = np.zeros(SIZE, np.int8)
    row[1000:3000] = 4  # noisy by its model, and no finding says so
    states = states_of(Side.SENSOR, inputs(), axle(), path(row), NOTHING, (), judged=True)
    assert set(states[1000:3000]) == {CODE[State.NOT_ASSESSED]}
    assert set(states[:1000]) == {CODE[State.HEALTHY]}
    valve = states_of(Side.ACTUATOR, inputs(), axle(), path(row), NOTHING, (), judged=True)
    assert set(valve[1000:3000]) == {CODE[State.NOT_EXCITED]}  # it was not steered indeed


@pytest.mark.parametrize(
    ("side", "blind", "judged", "why"),
    [
        (Side.SENSOR, False, True, "something deviates there that no single fault explains well enough"),
        (
            Side.SENSOR,
            True,
            True,
            "there is no {valve} command to compare with, or something deviates there that no single fault explains well enough",
        ),
        (Side.ACTUATOR, True, True, "something deviates there that no single fault explains well enough"),
        (Side.ACTUATOR, False, False, "the steering model does not hold here"),
    ],
)
def test_no_reason_is_given_that_does_not_hold(side: Side, why: str, *, blind: bool, judged: bool) -> None:
    assert reasons_of(side, axle(blind=blind), judged=judged)[State.NOT_ASSESSED] == why


def test_a_command_that_is_not_in_the_log_is_named_as_the_reason() -> None:
    why = reasons_of(Side.ACTUATOR, axle(), judged=False, missing="steer.rear.u")[State.NOT_ASSESSED]
    assert why.startswith("steer.rear.u, the command of its {valve}, is not in the log")
    assert (
        "not in the log"
        not in reasons_of(Side.ACTUATOR, axle(), judged=True, missing="steer.rear.u")[State.NOT_ASSESSED]
    )
