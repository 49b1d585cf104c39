"""The speed implied by a controller's effort, against a loop whose controller is written down."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.channels.noise import quiet_rms
from diagnosis.drives.identification import identify_controller
from diagnosis.drives.inputs import DriveRecord, stretches
from diagnosis.drives.inverse_controller import high_passed, implied_speed
from replay.errors import ConfigError
from replay.machine.drive_model import InverseController

Array = NDArray[np.float64]

DT = 0.02
KP, TI = 0.2, 0.8


def loop(seed: int, size: int = 1500, noise: float = 0.05) -> DriveRecord:
    """τ·v̇ = −v + 8·u with u = Kp·[(r − y) + ∫(r − y)/Ti] one step later, and a command that changes now and then."""
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(2.0, 5.0, 1 + size // 400), 400)[:size]
    y, u = np.empty(size), np.empty(size)
    v, integral, effort = command[0], command[0] / 8, command[0] / 8
    for k in range(size):
        v += DT / 0.3 * (-v + 8 * effort + rng.normal(0, 0.5))
        y[k] = v + rng.normal(0, noise)
        u[k] = effort
        integral += KP / TI * DT * (command[k] - y[k])
        effort = integral + KP * (command[k] - y[k])
    return DriveRecord(y, command, u, DT)


def test_a_controllers_gain_integral_time_and_delay_are_found() -> None:
    model = identify_controller([loop(1), loop(2)])
    assert model is not None
    best = int(np.argmin(model.gains))
    assert model.first + best == 1
    assert model.gains[best] == pytest.approx(-1 / KP, rel=0.05)
    assert model.memory_s == pytest.approx(TI, rel=0.3)
    assert model.setpoint == pytest.approx(0.0, abs=0.1)


def test_the_implied_speed_is_the_speed_that_the_controller_saw() -> None:
    model = InverseController((-1 / KP,), 1, TI, 0.0, 0.0, 0.01, 0.5, 0.01, DT)
    record = loop(3)
    assert np.nanmax(np.abs(implied_speed(model, record) - record.y)[50:-2]) < 0.03


def test_faults_in_a_part_of_the_mission_leave_the_model_alone() -> None:
    record = loop(4)
    y = record.y.copy()
    y[500:1000] = 0.7 * y[500:1000]
    clean, faulty = identify_controller([record]), identify_controller([DriveRecord(y, record.command, record.u, DT)])
    assert clean is not None
    assert faulty is not None
    assert min(faulty.gains) == pytest.approx(min(clean.gains), rel=0.05)
    rest = y - implied_speed(faulty, DriveRecord(y, record.command, record.u, DT))
    assert abs(np.mean(rest[100:480])) < 0.05
    assert np.mean(rest[520:980] / record.y[520:980]) == pytest.approx(-0.3, abs=0.02)


def test_an_effort_that_answers_to_nothing_gives_no_model() -> None:
    record = loop(5)
    rng = np.random.default_rng(0)
    assert identify_controller([DriveRecord(record.y, record.command, rng.normal(size=record.u.size), DT)]) is None
    assert identify_controller([DriveRecord(record.y, record.command, np.ones(record.u.size), DT)]) is None
    assert identify_controller([DriveRecord(record.y, record.command, np.full(record.u.size, np.nan), DT)]) is None
    assert identify_controller([]) is None


def test_a_gap_starts_the_controller_anew() -> None:
    model = InverseController((-1 / KP,), 1, TI, 0.0, 0.0, 0.01, 0.5, 0.01, DT)
    record = loop(6)
    u = record.u.copy()
    u[600:700] = np.nan
    x = implied_speed(model, DriveRecord(record.y, record.command, u, DT))
    assert np.isnan(x[600:700]).all()
    assert np.nanmax(np.abs(x - record.y)[760:-2]) < 0.1


def test_a_high_pass_forgets_with_its_time() -> None:
    x = np.r_[0.0, np.ones(400)]
    out = high_passed(x, 1.0, 0.01)
    assert out[1] == pytest.approx(1 / 1.01)
    assert out[101] == pytest.approx(out[1] * 1.01**-100)


def test_stretches_leave_out_what_is_too_short() -> None:
    valid = np.array([1, 1, 0, 1, 1, 1, 0, 1], dtype=bool)
    assert stretches(valid, 2) == [slice(0, 2), slice(3, 6)]


def test_quiet_rms_ignores_loud_windows() -> None:
    x = np.ones(1000)
    x[600:] = 50.0
    assert quiet_rms(x, DT) == pytest.approx(1.0)
    assert np.isnan(quiet_rms(np.full(1000, np.nan), DT))


def test_a_model_without_gains_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"drive\.gains is empty"):
        InverseController((), 1, TI, 0.0, 0.0, 0.01, 0.5, 0.01, DT)
