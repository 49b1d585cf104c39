"""What every speed sensor does near standstill is no fault of one; what one does more than the others, or at speed, is."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.low_speed import without_low_speed_habit
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

DT, SIZE = 0.01, 6000
WHEELS = ("FR", "FL", "RR", "RL")
Array = np.ndarray
SPEED = 0.5 * np.sin(2 * np.pi * np.arange(SIZE) * DT / 12.0)  # through 0 every 6 s
NEAR_REST = (1190, 1206)  # samples around the second standstill


def sensor(*, late: float = 1.0, wrong: float = 0.0) -> IdentifiedPair:
    """A sensor that reads 0 below 0.04 m/s, and `late` times that; `wrong` is added at speed."""
    x = SPEED
    y = np.where(np.abs(x) < 0.04 * late, 0.0, x) + np.where(np.abs(x) > 0.3, wrong, 0.0)
    samples = SimpleNamespace(x=x, y=y, status=np.full(SIZE, PAIR, dtype=np.int8))
    return cast(IdentifiedPair, SimpleNamespace(samples=samples, pair=SimpleNamespace(dt=DT)))


def assessment(start: int, stop: int) -> Assessment:
    """One fault of a sensor."""
    states = np.full(SIZE, CODE[State.HEALTHY])
    states[start:stop] = CODE[State.NO_SIGNAL]
    finding = Finding(start, stop, Side.SENSOR, FaultMode.NO_SIGNAL, 0.99, (), None, None, (), Tier.DIRECT)
    return Assessment(states, findings=(finding,), tier=Tier.DIRECT)


def test_what_all_sensors_do_is_left_open() -> None:
    pairs = {w: sensor() for w in WHEELS}
    told = without_low_speed_habit(pairs, {w: assessment(*NEAR_REST) for w in WHEELS})
    for a in told.values():
        assert a.findings == ()
        assert (a.states[slice(*NEAR_REST)] == CODE[State.NOT_ASSESSED]).all()


def test_what_one_does_much_more_stays_a_fault() -> None:
    pairs = {w: sensor(late=2.4 if w == "RR" else 1.0) for w in WHEELS}
    wide = NEAR_REST[0] - 26, NEAR_REST[1] + 30
    told = without_low_speed_habit(pairs, {w: assessment(*(wide if w == "RR" else NEAR_REST)) for w in WHEELS})
    assert [w for w, a in told.items() if a.findings] == ["RR"]


def test_a_fault_at_speed_stays() -> None:
    pairs = {w: sensor(wrong=0.02) for w in WHEELS}
    told = without_low_speed_habit(pairs, {w: assessment(200, 400) for w in WHEELS})
    assert all(a.findings for a in told.values())


def test_two_sensors_show_no_habit() -> None:
    pairs = {w: sensor() for w in WHEELS[:2]}
    told = without_low_speed_habit(pairs, {w: assessment(*NEAR_REST) for w in WHEELS[:2]})
    assert all(a.findings for a in told.values())


def slow_sensor(*, loses: float = 0.0, wanders: float = 0.0) -> IdentifiedPair:
    """A sensor of a machine that starts and stops, and creeps at a steady 0.06 m/s for 10 s, where it loses a share; slow, it is off by `wanders`."""
    t = np.arange(SIZE) * DT
    creeps = (t >= 24.5) & (t < 35.5)
    x = np.where(creeps, 0.06, SPEED)
    y = np.where(np.abs(x) < 0.03, 0.0, x)
    y = np.where(creeps, y * (1.0 - loses), y) - np.where(np.abs(x) < 0.1, wanders, 0.0)
    samples = SimpleNamespace(x=x, y=y, status=np.full(SIZE, PAIR, dtype=np.int8))
    return cast(IdentifiedPair, SimpleNamespace(samples=samples, pair=SimpleNamespace(dt=DT)))


def test_what_lasts_longer_than_a_passage_is_held_to_the_middle_of_passages() -> None:
    pairs = {w: slow_sensor(loses=0.45 if w == "RR" else 0.0) for w in WHEELS}
    told = without_low_speed_habit(pairs, {w: assessment(2500, 3500) for w in WHEELS if w == "RR"} | {
        w: Assessment(np.full(SIZE, CODE[State.HEALTHY]), tier=Tier.DIRECT) for w in WHEELS if w != "RR"
    })  # fmt: skip
    assert [w for w, a in told.items() if a.findings] == ["RR"]


def test_what_lasts_is_left_open_where_passages_are_off_by_as_much_all_along() -> None:
    pairs = {w: slow_sensor(wanders=0.012) for w in WHEELS}
    told = without_low_speed_habit(pairs, {w: assessment(2500, 3500) for w in WHEELS})
    assert not any(a.findings for a in told.values())
