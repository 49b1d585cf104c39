"""Speeds that come late are told with their delay; clocks that are late for all wheels blame none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.answering import wheels_of
from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.late import late_of, left_open
from diagnosis.results.assessment import Finding
from diagnosis.results.detectability import Deviation
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.campaigns import campaign
from tests.diagnosis.response.robot import DT, TRACK, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
FAULT = slice(round(50 / DT), round(75 / DT))


def judged(measured: dict[str, Array], asked: dict[str, Array], body: Array) -> Judgement:
    return assess_response(followers_of(measured, asked, body), geometry(tuple(measured)), None, LIMITS, DT)


def findings(j: Judgement) -> list[tuple[str, Finding]]:
    found = [(w, f) for w, sides in j.parts.items() for a in sides for f in a.findings]
    return list({(w, f.start, f.mode): (w, f) for w, f in found}.values())


def late(y: Array, delay: float) -> Array:
    out = y.copy()
    back = round(delay / DT)
    out[FAULT] = y[FAULT.start - back : FAULT.stop - back]
    return out


@pytest.mark.parametrize("delay", campaign([0.8, 0.9]))
@pytest.mark.parametrize("seed", campaign([31, 32, 33]))
def test_a_late_speed_is_named_with_its_delay_and_blames_no_other_wheel(seed: int, delay: float) -> None:
    measured, asked, body = speeds(seed)
    measured["RL"] = late(measured["RL"], delay)
    told = findings(judged(measured, asked, body))
    assert {w for w, _ in told} == {"RL"}
    for _, f in told:
        assert f.mode is FaultMode.OUTSIDE_TABLE
        assert f.side is Side.SENSOR_OR_ACTUATOR  # no other view of this wheel tells readings from drive
        assert "late" in f.evidence[0]
        assert min(f.stop, FAULT.stop) - max(f.start, FAULT.start) > 0.5 * (f.stop - f.start)


def test_a_delay_that_all_wheels_have_is_no_wheels_fault() -> None:
    measured, asked, body = speeds(34)
    measured = {w: late(y, 0.8) for w, y in measured.items()}
    assert not any("late" in f.evidence[0] for _, f in findings(judged(measured, asked, body)))


def test_the_smallest_delay_is_stated_or_said_not_to_be_assessed() -> None:
    measured, asked, body = speeds(35)
    j = judged(measured, asked, body)
    for sensor, _ in j.parts.values():
        assert sensor.powers is not None
        rows = [p for p in sensor.powers.rows if p.deviation is Deviation.DELAY]
        assert len(rows) == 1
        assert any("delay of" in n for n in sensor.notes)


def test_a_speed_that_never_changes_says_nothing_of_delays() -> None:
    measured, asked, body = speeds(36)
    for group in (measured, asked):
        for w in group:
            group[w] = np.full_like(group[w], 0.5)
    rng = np.random.default_rng(0)
    measured = {w: y + rng.normal(0, 0.004, y.size) for w, y in measured.items()}
    j = judged(measured, asked, np.full_like(body, 0.5))
    assert findings(j) == []
    for sensor, _ in j.parts.values():
        assert sensor.powers is not None
        assert [p.size for p in sensor.powers.rows if p.deviation is Deviation.DELAY] == [None]


def test_a_wheel_beside_one_with_a_noisy_sensor_is_not_called_late() -> None:
    """While the other wheel is evidently wrong its readings tell no delay; straight on nothing ends what they would begin."""
    n = round(40 / DT)
    v, turn = np.full(n, 0.1), 0.05 * np.exp(-np.arange(n) * DT / 4.0)
    asked = {w: v + s * turn for w, s in (("R", 0.5), ("L", -0.5))}
    rng = np.random.default_rng(5)
    measured = {w: np.r_[np.zeros(2), a[:-2]] + rng.normal(0, 1e-4, n) for w, a in asked.items()}
    part = slice(round(12 / DT), round(22 / DT))
    measured["L"][part] += rng.uniform(-0.05, 0.05, part.stop - part.start)
    assert {w for w, _ in findings(judged(measured, asked, np.column_stack([v, turn / TRACK])))} == {"L"}


def test_a_delay_is_told_only_where_it_explains_the_other_view_as_well() -> None:
    measured, asked, body = speeds(31)
    measured["RL"] = late(measured["RL"], 0.8)
    width = round(0.25 / DT)
    hidden = {w: np.zeros(y.size, np.bool_) for w, y in measured.items()}
    found = wheels_of(followers_of(measured, asked, body), hidden, geometry(tuple(measured)), (1, width), LIMITS, DT)
    one = found["RL"]._replace(speed=found["FL"].wheel.blocks.mean)
    told = late_of(one, width * DT)
    assert len(told) == 1
    assert left_open({"RL": told}, {"RL": one}) == {"RL": []}
    start, stop = round(55 / DT), round(61 / DT)
    wrong = np.array(one.speed)
    wrong[start // width : stop // width] *= 3.0  # a neighbour that reads too much is no delay of this wheel
    part = [replace(told[0], start=start, stop=stop)]
    assert left_open({"RL": part}, {"RL": one._replace(speed=wrong)}) == {"RL": part}


def test_where_commands_cease_before_the_speed_no_wheel_is_late() -> None:
    """All wheels go on at one speed, as far as the log goes, while the command has fallen to nothing."""
    for seed in (41, 42, 43):
        measured, asked, body = speeds(seed)
        last = round(4.0 / DT)
        for w in measured:
            measured[w][-last:] = 0.5 + np.random.default_rng(seed).normal(0.0, 0.01, last)
            asked[w][-last:] = 0.5
            asked[w][-round(1.5 / DT) :] = 0.0
        body[-last:] = 0.5, 0.0
        body[-round(1.5 / DT) :] = 0.0
        assert not any("late" in f.evidence[0] for _, f in findings(judged(measured, asked, body)))
