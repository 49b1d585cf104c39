"""An axle that stays while its command goes elsewhere is found without any valve command."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.results.assessment import CODE
from diagnosis.steering.followed import assessed, stays
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
DT, N = 0.05, 4000


def asked(seed: int = 3, size: float = 0.25) -> Array:
    rng = np.random.default_rng(seed)
    levels = size * rng.choice([-1.0, -0.5, 0.0, 0.4, 1.0], N // 160)
    slow = np.repeat(levels, 160)
    return np.convolve(np.r_[np.full(20, slow[0]), slow], np.ones(21) / 21, mode="valid")


def angle(command: Array, lag_s: float = 0.4, noise: float = 0.002) -> Array:
    late = round(lag_s / DT)
    rng = np.random.default_rng(1)
    return np.r_[np.full(late, command[0]), command[:-late]] + rng.normal(0.0, noise, command.size)


def found(phi: Array, command: Array, speed: Array | float = 1.0) -> Any:
    signals = {"steer.front.phi": phi, "steer.front.phi_ref": command, "wheel.RR.v": np.broadcast_to(speed, phi.shape)}
    timeline: Any = SimpleNamespace(get=signals.get, dt=DT, fresh={n: np.ones(N, np.bool_) for n in signals})
    machine: Any = SimpleNamespace(wheels=("RR",), limits=SimpleNamespace(driving_speed=0.1))
    return stays(timeline, machine, "front")


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_one_that_answers_is_not_named_however_its_angle_is_scaled_or_shifted(seed: int) -> None:
    command = asked(seed)
    assert found(angle(command), command) is None
    assert found(0.6 * angle(command, 1.5), command) is None
    assert found(angle(command) + 0.1, command) is None


def test_one_that_stays_has_a_drive_without_signal_where_its_readings_tremble() -> None:
    command = asked()
    phi = angle(command)
    part = slice(N // 2, N)
    phi[part] = phi[N // 2] + np.random.default_rng(2).normal(0.0, 0.002, N - N // 2)
    one = found(phi, command)
    assert (one.side, one.mode) == (Side.ACTUATOR, FaultMode.NO_SIGNAL)
    assert one.probability > 0.85
    assert abs(one.start - N // 2) < 200
    assert one.stop == N
    drive, sensor = (assessed(one, phi, s) for s in (Side.ACTUATOR, Side.SENSOR))
    assert drive.findings
    assert not sensor.findings
    assert np.all(drive.states[one.start : one.stop] == CODE[State.NO_SIGNAL])
    assert not np.any(sensor.states == CODE[State.HEALTHY])
    phi[part] = phi[N // 2]
    hangs = found(phi, command)
    assert (hangs.side, hangs.mode) == (Side.SENSOR_OR_ACTUATOR, FaultMode.STUCK)


def test_readings_of_nothing_are_no_signal_and_an_axle_at_its_end_is_stuck_there() -> None:
    command, noise = asked(), np.random.default_rng(2).normal(0.0, 0.002, N)
    silent, at_end = found(np.zeros(N), command), found(0.4 + noise, command)
    assert (silent.side, silent.mode) == (Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL)
    assert (at_end.side, at_end.mode) == (Side.ACTUATOR, FaultMode.STUCK)
    straight = found(noise, np.abs(command))
    assert (straight.side, straight.mode) == (Side.ACTUATOR, FaultMode.NO_SIGNAL)


def test_what_moves_again_or_never_moved_is_less_sure() -> None:
    command = asked()
    phi = angle(command)
    lasting, brief, never = phi.copy(), phi.copy(), phi.copy()
    noise = np.random.default_rng(2).normal(0.0, 0.002, N)
    lasting[1500:] = phi[1500] + noise[1500:]
    brief[1500:3000] = phi[1500] + noise[1500:3000]
    never[:] = noise
    sure, less, least = (found(x, command).probability for x in (lasting, brief, never))
    assert sure > 0.85 > less > least


def test_a_machine_that_stands_or_steering_at_its_stop_is_not_named() -> None:
    command = asked()
    phi = angle(command)
    phi[N // 2 :] = phi[N // 2] + np.random.default_rng(2).normal(0.0, 0.002, N - N // 2)
    driven = np.where(np.arange(N) < N // 2, 1.0, 0.0)
    assert found(phi, command, driven) is None
    more = np.abs(asked()) + 0.3
    more[: N // 2] = asked()[: N // 2]
    assert found(np.minimum(angle(more), 0.25), more) is None
