"""What is said of speed sensors without their drives: never a clean bill beside what speaks against a sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.decision.caveats import Reservations
from diagnosis.decision.intervals import intervals_of
from diagnosis.decision.sensors_alone import TITLES, sensors_alone
from diagnosis.results.assessment import CODE, Finding
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import FaultMode, Side, State
from tests.diagnosis.decision.findings import AXLES, MACHINE, STEP, WHEELS, assessed, finding, machine

_SHORT = tuple((w, "actuator") for w in WHEELS)


def said(
    found: Sequence[Finding] = (),
    part: str = "front_sensor",
    checks: Sequence[Checked] = (),
    without: Sequence[str] = (),
) -> tuple[str, str]:
    parts = machine(**{part: assessed(*found)}) if found else machine()
    parts = {p: replace(a, tier=Tier.NONE if p[0] in without else Tier.RESPONSE) for p, a in parts.items()}
    for p, a in parts.items():
        if p[0] in without:
            states = np.full_like(a.states, CODE[State.NOT_ASSESSED])
            parts[p] = replace(a, states=states, reasons={State.NOT_ASSESSED: "no command is in the log"})
    intervals = intervals_of(parts, MACHINE, HYDRAULIC, 0, STEP)
    got = sensors_alone(
        parts,
        dict.fromkeys(parts, 20.0),
        AXLES,
        Reservations(short=_SHORT, words=HYDRAULIC, open=tuple(checks)),
        intervals,
    )
    assert got is not None
    return got


def test_the_title_says_which_sensors() -> None:
    title, text = said()
    assert title == "No speed sensor fault seen, drives not judged"
    assert text.startswith("No fault was seen in the speed sensors over at least 20 s")


def test_many_drives_that_are_all_of_the_machine_are_not_named_one_by_one_and_have_one_reason() -> None:
    wheels = [f"W{k}" for k in range(6)]
    why = "a controller that holds the speed hides a weak drive, and the effort of a healthy one is not known"
    one = replace(assessed(), tier=Tier.RESPONSE, reasons={State.NOT_ASSESSED: why})
    parts = {(w, side): one for w in wheels for side in ("sensor", "actuator")}
    against = Reservations(short=tuple((w, "actuator") for w in wheels), words=HYDRAULIC)
    got = sensors_alone(parts, dict.fromkeys(parts, 20.0), (), against, ())
    assert got is not None
    assert got[1].endswith("; all 6 drives were not judged, for a controller that holds the speed hides a weak drive.")


def test_a_steering_that_nothing_judged_has_its_own_words() -> None:
    title, text = said(without=AXLES)
    assert title == "No speed sensor fault seen, drives and steering not judged"
    assert title in TITLES
    assert "; the steering was not judged, for no command is in the log." in text


def test_a_steering_sensor_that_may_be_stuck_is_named_first() -> None:
    title, text = said([finding(Side.SENSOR, FaultMode.STUCK, p=0.4)])
    assert title == "A sensor is in doubt, drives not judged"
    assert text.startswith("The front steering sensor may have been stuck for ")
    assert "no fault was seen in the speed sensors" in text


def test_a_speed_sensor_in_doubt_has_no_clean_bill() -> None:
    title, text = said([finding(Side.SENSOR, FaultMode.STUCK, p=0.4)], f"{WHEELS[0]}_sensor")
    assert title == "A sensor is in doubt, drives not judged"
    assert "No fault was seen" not in text


def test_an_open_check_of_an_angle_speaks_against_its_sensor_but_one_that_shows_nothing_does_not() -> None:
    off = Checked(Kind.STEER, "front", Side.SENSOR_OR_ACTUATOR, Check.LASTING_YAW, 0.15, 0.04)
    assert said(checks=[off])[0] == "A sensor is in doubt, drives not judged"
    assert said(checks=[replace(off, worst=None)])[0] == "No speed sensor fault seen, drives not judged"


def test_an_open_check_of_a_speed_is_said_with_what_was_seen() -> None:
    rough = Checked(Kind.WHEEL, WHEELS[0], Side.SENSOR, Check.ROUGHNESS, 0.3, 0.15)
    title, text = said(checks=[rough])
    assert title == "No speed sensor fault seen, but a check is open; drives not judged"
    assert text.startswith("No fault was seen in the speed sensors over at least 20 s of driving, but ")
    assert "other checks" not in text
    title, text = said(checks=[rough, replace(rough, component=WHEELS[1])])
    assert title == "No speed sensor fault seen, but checks are open; drives not judged"
    assert title in TITLES
    assert "other checks" in text


def test_a_steering_rate_that_is_open_doubts_no_sensor() -> None:
    rate = Checked(Kind.STEER, "front", Side.SENSOR_OR_ACTUATOR, Check.LASTING_RATE, 0.5, 0.2)
    assert said(checks=[rate])[0] == "No speed sensor fault seen, but a check is open; drives not judged"
    angle = Checked(Kind.STEER, "front", Side.SENSOR_OR_ACTUATOR, Check.LASTING_YAW, 0.15, 0.04)
    assert said(checks=[rate, angle])[0] == "A sensor is in doubt, drives not judged"
