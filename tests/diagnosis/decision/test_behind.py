"""An all-clear says how little of what lies behind measured drives it has seen."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.decision.behind import behind_drives
from diagnosis.results.assessment import Assessment
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_words import HYDRAULIC, MachineWords
from diagnosis.results.vocabulary import Kind, Tier
from diagnosis.results.wheel_model import WheelModelFit
from replay.faults import Side
from replay.machine.config import WheelPlant

STATES = np.zeros(10, np.int8)


def said(
    grips: tuple[float | None, ...] | None,
    tier: Tier = Tier.DIRECT,
    asked: tuple[str, ...] = ("FR", "RL"),
    words: MachineWords = HYDRAULIC,
) -> tuple[str, ...]:
    parts = {(w, side): Assessment(STATES, tier=tier) for w in ("FR", "RL") for side in ("sensor", "actuator")}
    checks = [
        Checked(Kind.WHEEL, w, Side.SENSOR_OR_ACTUATOR, Check.LASTING_RESPONSE, 0.01, -np.log(0.7)) for w in asked
    ]
    plants = tuple(None if g is None else WheelPlant(1.0, 0.2, grip=g) for g in grips or ())
    model = None if grips is None else WheelModelFit(plants, 0.0, 20, True, "")
    return behind_drives({**parts, ("front", "sensor"): parts["FR", "sensor"]}, ("front",), checks, model, words)


@pytest.mark.parametrize(
    ("grips", "asked", "words"),
    [
        (
            (0.0, 0.0),
            ("FR", "RL"),
            "shows from 30 % on; one that all wheels share, only where they fall behind their commands.",
        ),
        (
            (0.0, 1.0),
            ("FR", "RL"),
            "shows from 60 % on; one that all wheels share, only where they fall behind their commands.",
        ),
        (
            (0.0, 9.0),
            ("FR", "RL"),
            "shows from 30 % on, at RL none; one that all wheels share, only where they fall behind their commands.",
        ),
        (
            (0.0, 0.0),
            ("FR",),
            "shows from 30 % on, at RL none; one that all wheels share, only where they fall behind their commands.",
        ),
        ((9.0, 9.0), ("FR", "RL"), "a loss may not show in the speeds, least of all one that all wheels share."),
        ((None, None), ("FR", "RL"), "a loss may not show in the speeds, least of all one that all wheels share."),
        (None, ("FR", "RL"), "a loss may not show in the speeds, least of all one that all wheels share."),
    ],
    ids=["free", "half carried", "one carried", "one not asked", "carried", "no plants", "no model"],
)
def test_what_the_ground_carries_shows_less(
    grips: tuple[float | None, ...] | None, asked: tuple[str, ...], words: str
) -> None:
    (text,) = said(grips, asked=asked)
    assert text.startswith("Behind valves that do as they are told (motor, gear, brake) ")
    assert text.endswith(words)


def test_one_wheel_shares_nothing_with_others() -> None:
    parts = {("FR", side): Assessment(STATES, tier=Tier.DIRECT) for side in ("sensor", "actuator")}
    assert behind_drives(parts, (), (), None, HYDRAULIC) == (
        "Behind a valve that does as it is told (motor, gear, brake) a loss may not show in the speed.",
    )


def test_drives_that_were_not_measured_are_judged_by_speed_anyway() -> None:
    assert said((0.0, 0.0), Tier.MODEL) == ()


def test_behind_a_motor_lie_gear_and_brake() -> None:
    (text,) = said((0.0, 0.0), words=MachineWords(drive="motor"))
    assert text.startswith("Behind motors that do as they are told (gear, brake) ")
