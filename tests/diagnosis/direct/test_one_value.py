"""A speed that repeats one value while all others tremble is stuck, though the second sensor reads nearly the same."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.one_value import with_frozen_readings
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
DT, SIZE, STEP = 0.05, 1_500, 0.002
WHEELS = ("FR", "FL", "RR", "RL")
CHANNEL = {Side.SENSOR: ("v", "m/s"), Side.ACTUATOR: ("u_applied", "of full opening")}
TRUE = np.where(np.arange(SIZE) < 1_000, -0.88, 1.3)


def speeds(noise: float = 0.005, step: float = STEP) -> dict[str, Array]:
    rng = np.random.default_rng(3)
    return {w: np.asarray(np.round((TRUE + noise * rng.standard_normal(SIZE)) / step) * step) for w in WHEELS}


def told(
    y: dict[str, Array], *findings: Finding, second: Array = TRUE, side: Side = Side.SENSOR
) -> dict[str, Assessment]:
    fresh = np.ones(SIZE, np.bool_)
    pairs = {
        w: SimpleNamespace(
            pair=SimpleNamespace(
                y=v,
                fresh=fresh,
                dt=DT,
                span=5.0,
                side=side,
                y_name=f"wheel.{w}.{CHANNEL[side][0]}",
                unit=CHANNEL[side][1],
            ),
            samples=SimpleNamespace(x=second),
        )
        for w, v in y.items()
    }
    healthy = np.full(SIZE, CODE[State.HEALTHY])
    before = {w: Assessment(healthy, findings=findings if w == "RR" else (), tier=Tier.DIRECT) for w in y}
    return with_frozen_readings(cast(dict[str, IdentifiedPair], pairs), before)


def held(y: dict[str, Array], start: int = 400, stop: int = 640) -> dict[str, Array]:
    out = y["RR"].copy()
    out[start:stop] = -0.874
    return {**y, "RR": out}


def test_one_value_among_trembling_ones_is_stuck() -> None:
    after = told(held(speeds()))
    (f,) = after["RR"].findings
    assert (f.side, f.mode, f.probability) == (Side.SENSOR, FaultMode.STUCK, 0.96)
    assert f.start == pytest.approx(400, abs=1)
    assert f.stop == pytest.approx(640, abs=1)
    assert np.count_nonzero(after["RR"].states == CODE[State.STUCK]) == f.stop - f.start
    assert all(not after[w].findings for w in ("FR", "FL", "RL"))


def test_a_valve_position_of_one_value_is_a_stuck_valve_or_its_sensor() -> None:
    (f,) = told(held(speeds()), side=Side.ACTUATOR)["RR"].findings
    assert (f.side, f.mode, f.probability) == (Side.ACTUATOR, FaultMode.STUCK, 0.7)
    assert [(h.mode, h.p) for h in f.hypotheses[1:]] == [
        ("outside_table", pytest.approx(0.26)),
        ("healthy", pytest.approx(0.04)),
    ]
    assert "its sensor alone" in f.evidence[0]
    assert not told(held(speeds()), second=0.0 * TRUE, side=Side.ACTUATOR)["RR"].findings


def test_where_readings_are_coarse_one_value_is_how_they_look_at_one_speed() -> None:
    assert not told(held(speeds(noise=0.0005, step=0.05)))["RR"].findings


def test_two_sensors_show_no_habit() -> None:
    y = held(speeds())
    assert not told({w: y[w] for w in ("FR", "RR")})["RR"].findings


def test_what_is_told_already_is_not_told_twice() -> None:
    known = Finding(405, 635, Side.SENSOR, FaultMode.STUCK, 0.9, (), None, None, (), Tier.DIRECT)
    assert told(held(speeds()), known)["RR"].findings == (known,)


def test_two_that_freeze_together_are_both_stuck_beside_two_that_tremble() -> None:
    y = held(speeds())
    y["FR"][420:630] = -0.878
    after = told(y)
    assert [bool(after[w].findings) for w in WHEELS] == [True, False, True, False]
    y["FL"][400:640] = -0.88
    assert not any(a.findings for a in told(y).values())  # most of them: their log holds them


def test_a_second_sensor_that_goes_on_leaves_a_frozen_one_behind() -> None:
    moving = TRUE + 0.4 * np.sin(np.arange(SIZE) / 60.0)
    y = {w: np.asarray(np.round(moving / STEP) * STEP) for w in WHEELS}
    for w in ("RR", "FR"):
        y[w][400:560] = y[w][400]
    after = told(y, second=moving)
    (f,) = after["RR"].findings
    assert (f.start, f.stop) == (pytest.approx(400, abs=3), pytest.approx(560, abs=3))
    assert "its second sensor reads" in f.evidence[0]
    assert not after["RL"].findings
    for w in ("RL", "FL"):
        y[w][400:560] = y[w][400]
    assert not any(a.findings for a in told(y, second=moving).values())  # all of them: their log holds them
