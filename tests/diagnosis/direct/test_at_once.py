"""What two speed sensors do in the same moment of changing speed is how they measure; what lasts at steady speed is a fault."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.at_once import without_shared_moments
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
DT, SIZE = 0.01, 6000
WHEELS = ("FR", "FL", "RR", "RL")
T = np.arange(SIZE) * DT
SPEED = np.clip(2.0 * np.sin(2 * np.pi * T / 20.0), -1.0, 1.0)  # steady for most of the time, turns round every 10 s
TURN = (970, 1030)


def sensor(*, late_s: float = 0.0, offset: float = 0.0) -> IdentifiedPair:
    """A sensor that comes late and is off."""
    samples = SimpleNamespace(x=SPEED, y=np.interp(T - late_s, T, SPEED) + offset, status=np.full(SIZE, PAIR, np.int8))
    return cast(IdentifiedPair, SimpleNamespace(samples=samples, pair=SimpleNamespace(dt=DT)))


def assessment(start: int, stop: int, mode: FaultMode = FaultMode.NOISY) -> Assessment:
    """One fault of a sensor."""
    states = np.full(SIZE, CODE[State.HEALTHY])
    states[start:stop] = CODE[State(mode.value)]
    finding = Finding(start, stop, Side.SENSOR, mode, 0.99, (), None, None, (), Tier.DIRECT)
    return Assessment(states, findings=(finding,), tier=Tier.DIRECT)


def kept(pairs: dict[str, IdentifiedPair], span: tuple[int, int]) -> bool:
    told = without_shared_moments(pairs, {w: assessment(*span) for w in ("FR",)})
    return bool(told["FR"].findings)


def test_a_delay_that_another_sensor_has_as_well_is_left_open() -> None:
    pairs = {w: sensor(late_s=0.1 if w in ("FR", "RL") else 0.0) for w in WHEELS}
    told = without_shared_moments(pairs, {"FR": assessment(*TURN)})
    assert told["FR"].findings == ()
    assert (told["FR"].states[slice(*TURN)] == CODE[State.NOT_ASSESSED]).all()


def test_what_no_other_sensor_does_stays() -> None:
    assert kept({w: sensor(late_s=0.1 if w == "FR" else 0.0) for w in WHEELS}, TURN)


def test_what_is_off_at_steady_speed_stays_though_all_are() -> None:
    assert kept({w: sensor(offset=0.1) for w in WHEELS}, (200, 1200))


def test_two_sensors_show_no_habit() -> None:
    assert kept({w: sensor(late_s=0.1) for w in WHEELS[:2]}, TURN)


def test_a_fault_of_another_sensor_at_another_moment_is_no_habit() -> None:
    """Its largest deviation is as large, but not when this one's is."""
    pairs = {w: sensor(late_s=0.1 if w == "FR" else 0.0) for w in WHEELS}
    pairs["RL"].samples.y[1100:1150] += 0.5
    assert kept(pairs, (960, 1200))


def test_a_lasting_fault_of_one_other_sensor_is_no_habit() -> None:
    pairs = {w: sensor(late_s=0.1 if w == "FR" else 0.0) for w in WHEELS}
    pairs["RL"].samples.y[600:1400] *= 0.3
    told = without_shared_moments(pairs, {"FR": assessment(*TURN), "RL": assessment(600, 1400)})
    assert told["FR"].findings
    assert told["RL"].findings


def test_lasting_faults_of_two_other_sensors_are_no_habit_where_they_show_at_steady_speed() -> None:
    pairs = {w: sensor(late_s=0.1 if w == "FR" else 0.0) for w in WHEELS}
    pairs["RL"].samples.y[600:1400] *= 0.3
    pairs["RR"].samples.y[500:1300] += 0.4
    spans = {"FR": TURN, "RL": (600, 1400), "RR": (500, 1300)}
    told = without_shared_moments(pairs, {w: assessment(*span) for w, span in spans.items()})
    assert all(told[w].findings for w in spans)


def test_what_three_sensors_do_when_the_speed_changes_alone_is_a_habit_however_long() -> None:
    pairs = {w: sensor(late_s=0.1 if w != "FL" else 0.0) for w in WHEELS}
    told = without_shared_moments(pairs, {w: assessment(600, 1400) for w in ("FR", "RL", "RR")})
    assert not any(a.findings for a in told.values())


def test_what_all_sensors_read_while_the_machine_creeps_is_a_habit_however_total_and_long() -> None:
    """They read 0 below their least speed, for longer than any passage."""
    creeps = slice(2000, 2800)
    pairs = {w: sensor() for w in WHEELS}
    for pair in pairs.values():
        pair.samples.x = SPEED.copy()
        pair.samples.x[creeps] = 0.06
        pair.samples.y[creeps] = 0.0
    told = without_shared_moments(pairs, {w: assessment(2000, 2800, FaultMode.NO_SIGNAL) for w in WHEELS})
    assert not any(a.findings for a in told.values())


def test_such_a_sensor_is_healthy_at_steady_speed_where_it_reads_as_it_should() -> None:
    """What is left open are the moments themselves."""
    pairs = {w: sensor(late_s=0.1 if w in ("FR", "RL") else 0.0) for w in WHEELS}
    pairs["FR"].samples.y[400:415] -= 0.1
    told = without_shared_moments(pairs, {"FR": assessment(300, 1400)})["FR"]
    assert told.findings == ()
    healthy = told.states == CODE[State.HEALTHY]
    assert healthy[550:750].all()
    assert not healthy[405:410].any()
    assert not healthy[slice(*TURN)].any()
