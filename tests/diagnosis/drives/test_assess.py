"""A single drive judged by the speed that its effort implies and by its effort: faults in the loop and written into the log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.drives.assess import assess_drive
from diagnosis.drives.inputs import DriveData
from diagnosis.drives.load_findings import onset_of
from diagnosis.fitting.drives import identify_drive
from diagnosis.results.assessment import STATES, Assessment
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits
from replay.machine.drive_model import DriveModel

Array = NDArray[np.float64]
Fault = Callable[[float, np.random.Generator], float]

DT, SIZE = 0.02, 1500
START, STOP = 700, 1100
KP, TI = 0.2, 0.8
LIMITS = Limits(min_epsilon=0.03, min_sat=0.02, driving_speed=0.1)
ROWS: dict[FaultMode, Fault] = {
    FaultMode.STUCK: lambda y, rng: 3.0,
    FaultMode.NO_SIGNAL: lambda y, rng: 0.0,
    FaultMode.INEFFICIENT: lambda y, rng: 0.9 * y,
    FaultMode.NOISY: lambda y, rng: 0.9 * y + 0.1 * rng.normal(3.0, 4.0),
}


def mission(
    seed: int, *, inside: Fault | None = None, load: float = 0.0, speed: float = 3.0, model: DriveModel | None = None
) -> DriveData:
    """One drive in a speed loop: v̇ = (−v + 8·(u − u₀ − load))/τ; `inside` is what the sensor makes of the speed."""
    rng = np.random.default_rng(seed)
    command = speed + 0.5 * np.repeat(rng.uniform(-1, 1, 5), SIZE // 5)
    u0 = 0.2 + rng.normal(0, 0.005)
    y, u = np.empty(SIZE), np.empty(SIZE)
    v, integral, effort = command[0], command[0] / 8 + u0, command[0] / 8 + u0
    for k in range(SIZE):
        faulty = START <= k < STOP
        v += DT / 0.3 * (-v + 8 * (effort - u0 - load * faulty) + rng.normal(0, 0.4))
        y[k] = v + rng.normal(0, 0.03)
        if faulty and inside is not None:
            y[k] = inside(y[k], rng)
        u[k] = effort
        integral = np.clip(integral + KP / TI * DT * (command[k] - y[k]), -1.0, 1.0)
        effort = float(np.clip(integral + KP * (command[k] - y[k]), -1.0, 1.0))
    return drive(y, command, u, model)


def drive(y: Array, command: Array, u: Array, model: DriveModel | None, *, open_loop: bool = False) -> DriveData:
    every = np.ones(y.size, dtype=np.bool_)
    return DriveData(y, every, every, command, u, DT, model, 10.0, 1.0, None, ("speed", "command", "effort"), open_loop)


def written(data: DriveData, mode: FaultMode) -> DriveData:
    """The same log with a fault of its speed that the controller never met."""
    rng = np.random.default_rng(99)
    y = data.y.copy()
    y[START:STOP] = [ROWS[mode](v, rng) for v in y[START:STOP]]
    return drive(y, data.command, data.u, data.model, open_loop=True)


@pytest.fixture(scope="module")
def model() -> DriveModel:
    found = identify_drive([mission(i, speed=2.0 + 0.3 * i) for i in range(6)], 0.1)
    assert found.echo is not None
    assert found.effort is not None
    assert found.effort.slope == pytest.approx(1 / 8, rel=0.1)
    return found


def share(assessment: Assessment, state: State, part: slice = slice(None)) -> float:
    return float(np.mean(assessment.states[part] == STATES.index(state)))


def test_a_healthy_drive_is_healthy_on_both_sides(model: DriveModel) -> None:
    for seed in range(10, 14):
        sensor, actuator = assess_drive(mission(seed, model=model), LIMITS)
        assert sensor.findings == actuator.findings == ()
        assert share(sensor, State.HEALTHY) > 0.95
        assert share(actuator, State.HEALTHY) > 0.95


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("mode", list(ROWS))
def test_a_fault_written_into_the_log_is_found(model: DriveModel, mode: FaultMode, known: bool) -> None:
    sensor, _ = assess_drive(written(mission(20, model=model if known else None), mode), LIMITS)
    (fault,) = sensor.findings
    assert (fault.side, fault.mode) == (Side.SENSOR, mode)
    assert abs(fault.start - START) <= 5
    assert abs(fault.stop - STOP) <= 5
    assert fault.detected is not None
    assert fault.detected - START < 0.5 / DT
    assert share(sensor, State(mode.value), slice(START, STOP)) > 0.97
    if mode is FaultMode.INEFFICIENT:
        assert fault.epsilon is not None
        assert fault.epsilon.value == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("mode", [FaultMode.STUCK, FaultMode.NO_SIGNAL])
def test_a_constant_sensor_is_found_in_the_loop_too(model: DriveModel, mode: FaultMode) -> None:
    sensor, actuator = assess_drive(mission(30, inside=ROWS[mode], model=model), LIMITS)
    assert [(f.side, f.mode) for f in sensor.findings if f.start < STOP] == [(Side.SENSOR, mode)]
    assert abs(sensor.findings[0].start - START) <= 5
    assert share(actuator, State.MASKED, slice(START + 5, STOP - 5)) > 0.95
    assert "nan" not in " ".join(sensor.findings[0].evidence)


def test_a_value_beyond_the_zero_of_a_sensor_is_one_that_it_is_stuck_at(model: DriveModel) -> None:
    held = mission(30, inside=lambda y, rng: 0.3, model=model)
    sensor, _ = assess_drive(held, replace(LIMITS, min_sat=0.5))
    assert sensor.findings[0].mode is FaultMode.STUCK


def test_a_sensor_that_loses_gain_in_the_loop_jumps(model: DriveModel) -> None:
    sensor, actuator = assess_drive(mission(40, inside=lambda y, rng: 0.6 * y, model=model), LIMITS)
    assert [(f.side, f.mode) for f in sensor.findings] == [(Side.SENSOR, FaultMode.INEFFICIENT)]
    assert abs(sensor.findings[0].start - START) * DT < 1.5
    assert actuator.findings == ()
    assert share(sensor, State.HEALTHY, slice(START + 100, STOP - 50)) < 0.05


def test_an_extra_load_bends_and_is_the_drives(model: DriveModel) -> None:
    sensor, actuator = assess_drive(mission(41, load=0.3, model=model), LIMITS)
    assert sensor.findings == ()
    assert {f.side for f in actuator.findings} == {Side.ACTUATOR}
    assert share(sensor, State.HEALTHY, slice(START + 100, STOP - 100)) < 0.05


def test_a_drive_faster_than_any_healthy_mission_is_not_assessed(model: DriveModel) -> None:
    assert model.effort is not None
    for side in assess_drive(mission(42, speed=1.4 * model.effort.fastest, model=model), LIMITS):
        assert share(side, State.HEALTHY) == 0.0
        assert share(side, State.NOT_ASSESSED) > 0.9
        assert "healthy missions drove at" in side.reasons[State.NOT_ASSESSED]


def test_without_healthy_missions_agreement_alone_proves_nothing() -> None:
    sensor, actuator = assess_drive(mission(50), LIMITS)
    assert share(sensor, State.NOT_ASSESSED) == share(actuator, State.NOT_ASSESSED) == 1.0
    assert "healthy missions" in sensor.reasons[State.NOT_ASSESSED]


def test_an_effort_that_answers_to_nothing_is_named_as_the_reason() -> None:
    rng = np.random.default_rng(0)
    data = mission(60)
    sensor, actuator = assess_drive(drive(data.y, data.command, rng.normal(size=SIZE), None), LIMITS)
    assert "which speed the controller received" in sensor.reasons[State.NOT_ASSESSED]
    assert share(actuator, State.NOT_ASSESSED) == 1.0


def test_lost_samples_are_no_data_and_a_silent_channel_is_no_signal(model: DriveModel) -> None:
    data = mission(70, model=model)
    y = data.y.copy()
    y[START:STOP] = np.nan
    alive = np.ones(SIZE, dtype=np.bool_)
    for others, state in ((alive, State.NO_SIGNAL), (~alive, State.NO_DATA)):
        lost = DriveData(
            y, np.isfinite(y), others, data.command, data.u, DT, model, 10.0, 1.0, None, data.names, data.open_loop
        )
        sensor, _ = assess_drive(lost, LIMITS)
        assert share(sensor, state, slice(START + 10, STOP - 10)) == 1.0


def test_a_controller_that_is_switched_off_and_on_raises_nothing(model: DriveModel) -> None:
    data = mission(80, model=model)
    y, command, u = data.y.copy(), data.command.copy(), data.u.copy()
    command[600:800], u[602:800] = 0.0, 0.0  # the effort follows its command
    y[600:800] = y[599] * np.exp(-np.arange(200) * DT / 0.3)  # the drive runs out
    sensor, actuator = assess_drive(drive(y, command, u, model), LIMITS)
    assert sensor.findings == actuator.findings == ()
    assert share(sensor, State.NOT_EXCITED, slice(602, 800)) == 1.0


def test_the_side_of_an_onset_is_open_where_a_jump_could_be_overlooked() -> None:
    rng = np.random.default_rng(0)
    y = 3 + rng.normal(0, 0.1, 400)
    assert onset_of(y, 200, 0.1, DT).side is Side.SENSOR_OR_ACTUATOR
    assert onset_of(y, 200, 1.0, DT).side is Side.ACTUATOR
    assert onset_of(y, 10, 1.0, DT).side is Side.SENSOR_OR_ACTUATOR
    y[200:] -= 1.0
    assert onset_of(y, 200, 1.0, DT).side is Side.SENSOR


@pytest.mark.parametrize("spans", [[(100, 1400)], [(100 * k, 100 * k + 20) for k in range(1, 9)]])
def test_a_controller_of_this_mission_alone_that_calls_most_or_many_pieces_of_it_faulty_is_not_believed(
    monkeypatch: pytest.MonkeyPatch, model: DriveModel, spans: list[tuple[int, int]]
) -> None:
    (one,) = assess_drive(written(mission(5), FaultMode.NOISY), LIMITS)[0].findings[:1]
    every = [replace(one, start=start, stop=stop) for start, stop in spans]
    monkeypatch.setattr("diagnosis.drives.assess.find_rows", lambda pair, limits: (every, np.zeros(SIZE), 0))
    own, known = assess_drive(mission(5), LIMITS), assess_drive(mission(5, model=model), LIMITS)
    assert [share(a, State.NOT_ASSESSED) for a in own] == [1.0, 1.0]
    assert "does not explain its driving" in own[0].reasons[State.NOT_ASSESSED]
    assert share(known[0], State.NOISY) > 0.8 * sum(stop - start for start, stop in spans) / SIZE
