"""A sensor that falls silent is told, also where a model puts that down to something else."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.channels.silence import silences, with_silence, with_silent_sensors
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

SIZE, DT = 5000, 0.01


def told(first: int, last: int, findings: tuple[Finding, ...] = (), goes_on: bool = True) -> Assessment:
    """A sensor that is silent at some samples; its source delivers every fifth step."""
    y = np.ones(SIZE)
    y[first:last] = np.nan
    delivers = np.arange(SIZE) % 5 == 0
    if not goes_on:
        delivers[first:last] = False
    states = np.full(SIZE, CODE[State.HEALTHY])
    assessment = Assessment(states, findings=findings, tier=Tier.MODEL)
    return with_silence(assessment, silences(y, delivers, DT), "steer.front.phi", DT)


def test_a_sensor_that_ends_has_no_signal() -> None:
    a = told(3000, SIZE)
    (found,) = a.findings
    assert (found.start, found.stop, found.mode, found.side) == (3000, 5000, FaultMode.NO_SIGNAL, Side.SENSOR)
    assert "delivered nothing for {20.0 s}" in found.evidence[0]
    assert (a.states[3000:] == CODE[State.NO_SIGNAL]).all()


@pytest.mark.parametrize(("first", "last"), [(0, 0), (600, 650), (0, 900), (0, SIZE)])
def test_a_lost_message_and_what_has_not_begun_are_no_fault(first: int, last: int) -> None:
    assert told(first, last).findings == ()


def test_a_log_that_ends_is_no_fault() -> None:
    assert told(3000, SIZE, goes_on=False).findings == ()


def test_what_is_told_already_is_not_told_twice() -> None:
    one = Finding(2990, 5000, Side.SENSOR, FaultMode.NO_SIGNAL, 0.96, (), None, None, (), Tier.MODEL)
    assert told(3000, SIZE, (one,)).findings == (one,)


def test_an_unsure_finding_gives_way() -> None:
    one = Finding(2990, 5000, Side.SENSOR, FaultMode.NO_SIGNAL, 0.45, (), None, None, (), Tier.MODEL)
    (found,) = told(3000, SIZE, (one,)).findings
    assert found.probability == pytest.approx(0.95)


@pytest.mark.parametrize(
    ("silent", "blamed"), [(("FR",), {"FR"}), (("FR", "FL"), set()), (("FR", "FL", "RR", "RL"), set())]
)
def test_what_several_sensors_lack_at_once_is_no_fault_of_each(silent: tuple[str, ...], blamed: set[str]) -> None:
    wheels = ("FR", "FL", "RR", "RL")
    columns = {f"wheel.{w}.v": np.ones(SIZE) for w in wheels} | {"wheel.FR.u": np.ones(SIZE)}
    for w in silent:
        columns[f"wheel.{w}.v"][3000:4000] = np.nan
    fresh = {n: np.isfinite(x) for n, x in columns.items()}
    timeline: Any = SimpleNamespace(
        dt=DT,
        size=SIZE,
        fresh=fresh,
        get=columns.get,
        groups=dict.fromkeys(columns, "one"),
        sources=dict.fromkeys(columns, "file"),
    )
    states = np.full(SIZE, CODE[State.HEALTHY])
    told = with_silent_sensors({(w, "sensor"): Assessment(states, tier=Tier.MODEL) for w in wheels}, timeline)
    assert {w for (w, _), a in told.items() if a.findings} == blamed
