"""A wheel that deviates alone and by far is named, whichever side of it fails; where several do, or an axle may drag them, none is."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.clearing.added_findings import with_findings
from diagnosis.clearing.cells import Cells
from diagnosis.clearing.checks import checks_of
from diagnosis.clearing.one_supply import less_sure_together
from diagnosis.clearing.standing_out import what_stands_out, without_explained, without_followers
from diagnosis.clearing.untold_faults import fault_of_wheel, finding_of
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_event import foreign, gyro_or_slip, swinging
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import FaultMode, FaultSpec, Side, State
from tests.diagnosis.clearing.missions import LENGTH, in_cells, simulated

WHOLE, DT = (0.0, LENGTH), 0.01


def _found(*faults: FaultSpec, seed: int = 5) -> dict[str, Finding]:
    cells = in_cells(simulated(*faults, seed=seed), base=True)
    return what_stands_out(checks_of(cells, HYDRAULIC), cells, HYDRAULIC)


def test_nothing_stands_out_in_a_healthy_mission() -> None:
    assert _found() == {}


@pytest.mark.parametrize("side", [Side.SENSOR, Side.ACTUATOR])
def test_a_wheel_that_hardly_moves_may_have_no_signal_or_be_stuck_or_lose_nearly_all(side: Side) -> None:
    found = _found(FaultSpec("RR", side, FaultMode.NO_SIGNAL, *WHOLE))
    assert list(found) == ["RR"]
    fault = found["RR"]
    assert (fault.side, fault.mode) == (Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL)
    assert fault.epsilon is not None
    assert fault.epsilon.value > 0.9
    assert fault.probability == fault.hypotheses[0].p < 0.9  # the part is certain, its row is not
    assert sum(h.p for h in fault.hypotheses if h.mode != "healthy") == pytest.approx(0.95)
    assert sum(h.p for h in fault.hypotheses) == pytest.approx(1.0)
    assert (fault.stop - fault.start) / 100.0 > 0.8 * LENGTH  # at 100 Hz
    assert "below the other wheels'" in fault.evidence[0]


def test_a_reading_that_is_too_large_for_a_third_of_the_mission_is_named_where_it_is() -> None:
    fault = _found(FaultSpec("FL", Side.SENSOR, FaultMode.OUTSIDE_TABLE, 0.0, LENGTH / 3, -1.0), seed=7)["FL"]
    assert fault.mode is FaultMode.OUTSIDE_TABLE
    assert fault.epsilon is not None
    assert fault.epsilon.value < -0.4
    assert fault.stop / 100.0 < LENGTH / 3 + 4.0


def test_two_wheels_alike_leave_open_which_of_them_are_healthy() -> None:
    dead = [FaultSpec(w, Side.ACTUATOR, FaultMode.NO_SIGNAL, *WHOLE) for w in ("FR", "RR")]
    assert _found(*dead) == {}


def test_the_wheel_that_does_not_follow_is_blamed_and_not_the_one_that_drags_it_along() -> None:
    cells = in_cells(simulated(FaultSpec("RR", Side.ACTUATOR, FaultMode.NO_SIGNAL, *WHOLE)), base=True)
    about, either = (Kind.WHEEL,), Side.SENSOR_OR_ACTUATOR
    checks = [
        Checked(*about, wheel, either, check, worst, 0.2)
        for check, sizes in (
            (Check.TRACKING, {"FR": 0.3, "FL": 0.1, "RR": 2.0, "RL": 0.1}),
            (Check.LASTING_RESPONSE, {"FR": 2.2, "FL": 0.1, "RR": 4.0, "RL": 0.1}),
        )
        for wheel, worst in sizes.items()
    ]
    (name, fault) = next(iter(what_stands_out(checks, cells, HYDRAULIC).items()))
    assert name == "RR"
    assert "all other wheels follow their commands far better" in fault.evidence[0]
    claim = replace(fault, side=Side.ACTUATOR, mode=FaultMode.STUCK, probability=0.92)
    loss = replace(claim, mode=FaultMode.INEFFICIENT)
    states = np.full(round(100 * LENGTH) + 1, CODE[State.STUCK])
    before = {("FR", "actuator"): Assessment(states, findings=(claim, loss)), ("RR", "actuator"): Assessment(states)}
    after = without_followers(before, checks, cells)
    assert after["FR", "actuator"].findings == (loss,)
    assert after["RR", "actuator"] is before["RR", "actuator"]
    explained = replace(cells, stated={"RL": [(5.0, 50.0)]})  # by what is measured twice, say
    assert what_stands_out(checks, explained, HYDRAULIC) == {}
    drags = [c if c.component != "FR" else replace(c, worst=1.0) for c in checks]  # it does not follow either
    assert without_followers(before, drags, cells) == before


def test_an_axle_that_stands_still_is_named_and_explains_its_wheels() -> None:
    found = _found(FaultSpec("front", Side.ACTUATOR, FaultMode.NO_SIGNAL, *WHOLE))
    assert list(found) == ["front"]
    assert found["front"].mode is FaultMode.NO_SIGNAL
    fault = found["front"]
    assert "stands still" in fault.evidence[0]
    rest = np.full(
        fault.stop + 100, CODE[State.NOT_EXCITED], dtype=np.int8
    )  # which a command that moves nothing is not
    after = with_findings({("front", "actuator"): Assessment(rest)}, found, DT)["front", "actuator"]
    assert set(after.states[fault.start : fault.stop]) == {CODE[State.NO_SIGNAL]}
    assert after.states[fault.stop] == CODE[State.NOT_EXCITED]


def test_an_axle_that_rests_at_one_command_wherever_it_is_has_a_valve_that_is_off() -> None:
    (fault,) = _found(
        FaultSpec(
            "front", Side.ACTUATOR, FaultMode.OUTSIDE_TABLE, *WHOLE, epsilon=0.02, sat=7.5
        )  # 0.15 of full opening
    ).values()
    assert (fault.side, fault.mode) == (Side.ACTUATOR, FaultMode.OUTSIDE_TABLE)
    assert "rests again and again" in fault.evidence[0]
    assert sum(h.p for h in fault.hypotheses) == pytest.approx(1.0)


def test_a_wheel_model_that_does_not_fit_explains_no_axle() -> None:
    fault = next(iter(_found(FaultSpec("front", Side.ACTUATOR, FaultMode.NO_SIGNAL, *WHOLE)).values()))
    found, axles = {"front": fault, "RR": fault}, ("front", "rear")
    assert without_explained(found, (), axles) == found
    assert without_explained(found, (foreign("…"),), axles) == {"front": fault}
    assert without_explained(found, (foreign("…"), swinging("…")), axles) == {}


def test_a_gyro_that_contradicts_the_wheels_explains_no_axle() -> None:
    fault = next(iter(_found(FaultSpec("front", Side.ACTUATOR, FaultMode.NO_SIGNAL, *WHOLE)).values()))
    assert without_explained({"front": fault, "RR": fault}, (gyro_or_slip("…"),), ("front", "rear")) == {"front": fault}


def test_states_of_both_sides_say_the_fault_but_where_nothing_was_known() -> None:
    (fault,) = _found(FaultSpec("RR", Side.ACTUATOR, FaultMode.NO_SIGNAL, *WHOLE)).values()
    states = np.full(round(100 * LENGTH) + 1, CODE[State.HEALTHY])
    states[: fault.start + 5] = CODE[State.NO_DATA]
    states[fault.start + 50 : fault.start + 90] = CODE[State.SLIP]  # or its sensor is faulty: it is
    before = {(c, s): Assessment(states) for c in ("RR", "FR") for s in ("sensor", "actuator")}
    after = with_findings(before, {"RR": fault}, DT)
    assert after["FR", "sensor"] is before["FR", "sensor"]
    for side in ("sensor", "actuator"):
        a = after["RR", side]
        assert a.findings == (fault,)
        assert (a.states[: fault.start + 5] == CODE[State.NO_DATA]).all()
        assert (a.states[fault.start + 5 : fault.stop] == CODE[State.NO_SIGNAL]).all()


@pytest.mark.parametrize(
    ("mode", "p", "expected"), [(FaultMode.NOISY, 0.5, 1), (FaultMode.NOISY, 0.97, 2), (FaultMode.INEFFICIENT, 0.5, 2)]
)
def test_a_less_probable_finding_of_the_same_row_is_not_stated_beside_it(
    mode: FaultMode, p: float, expected: int
) -> None:
    states = np.full(3000, CODE[State.HEALTHY])
    states[1900:2700] = CODE[State(mode.value)]
    model = Finding(1900, 2700, Side.SENSOR, mode, p, (), None, None, (), Tier.MODEL)
    spikes = Finding(1700, 2650, Side.SENSOR, FaultMode.NOISY, 0.95, (), None, None, (), Tier.MODEL)
    after = with_findings({("RL", "sensor"): Assessment(states, findings=(model,))}, {"RL": spikes}, DT)["RL", "sensor"]
    assert len(after.findings) == expected
    if expected == 1:
        assert (after.states[1700:2650] == CODE[State.NOISY]).all()
        assert (after.states[2650:2700] == CODE[State.NOT_ASSESSED]).all()


def test_an_angle_that_is_off_its_second_measurement_all_the_time_is_its_sensors_fault() -> None:
    mission = simulated()
    angle = mission.columns["steer.rear.phi"] - 0.2
    cells = in_cells(replace(mission, columns={**mission.columns, "steer.rear.phi": angle}), base=False)
    found = what_stands_out(checks_of(cells, HYDRAULIC), cells, HYDRAULIC)
    fault = found["rear"]
    assert (fault.side, fault.mode) == (Side.SENSOR, FaultMode.OUTSIDE_TABLE)
    assert "reads 11° less" in fault.evidence[0]
    states = np.full(round(100 * LENGTH) + 1, CODE[State.HEALTHY])
    loss = replace(
        fault,
        side=Side.ACTUATOR,
        mode=FaultMode.INEFFICIENT,
        probability=0.99,
        hypotheses=(),
        evidence=(),
        tier=Tier.MODEL,
    )
    before = {("rear", "sensor"): Assessment(states), ("rear", "actuator"): Assessment(states, findings=(loss,))}
    after = with_findings(before, found, DT)
    assert [f.mode for f in after["rear", "sensor"].findings] == [FaultMode.OUTSIDE_TABLE]
    (valve,) = after["rear", "actuator"].findings
    assert valve.probability == pytest.approx(0.65)


def test_a_wheel_whose_speed_per_opening_no_window_shows_has_no_fault_of_a_size() -> None:
    """One that hardly ever drives beyond creeping, as a sensor that is deaf to small values leaves it."""
    cells = in_cells(simulated(), base=True)
    still = {**cells.timeline.signals, "wheel.FR.v": np.full(cells.timeline.size, np.nan)}
    deaf = replace(cells, timeline=replace(cells.timeline, signals=still), _kept={})
    check = Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.RESPONSE, 1.0, 0.2)
    assert fault_of_wheel(check, deaf, alone=False) is None


def test_a_wheel_that_is_off_where_it_creeps_alone_is_not_told() -> None:
    """Dead bands differ: where it drives, it does as the others do."""
    cells = in_cells(simulated(), base=True)
    check = Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.RESPONSE, 0.8, 0.2)
    assert fault_of_wheel(check, cells, alone=True) is None


def test_a_wheel_beside_others_that_all_stand_has_no_share_of_their_speed() -> None:
    """Their speed per opening is 0, and nothing is a multiple of that."""
    cells = in_cells(simulated(), base=True)
    others = {f"wheel.{w}.v": np.zeros(cells.timeline.size) for w in cells.machine.wheels[1:]}
    standing = replace(cells.timeline, signals={**cells.timeline.signals, **others})
    check = Checked(Kind.WHEEL, cells.machine.wheels[0], Side.SENSOR_OR_ACTUATOR, Check.EXCESS, 3.0, 0.2)
    assert fault_of_wheel(check, replace(cells, timeline=standing, _kept={}), alone=True) is None


def test_no_wheel_stands_out_by_others_that_stand() -> None:
    """Beside wheels that stand, two others are infinitely quick: neither is alone, nor is a multiple of that anything."""
    cells = in_cells(simulated(), base=True)
    wheels = cells.machine.wheels
    checks = [
        Checked(Kind.WHEEL, w, Side.SENSOR_OR_ACTUATOR, kind, worst, 0.2)
        for w, above in zip(wheels, (np.inf, np.inf, 0.1, 0.1), strict=True)
        for kind, worst in ((Check.EXCESS, above), (Check.RESPONSE, 0.1))
    ]
    assert what_stands_out(checks, cells, HYDRAULIC) == {}


@pytest.mark.parametrize(
    ("worst", "named"),
    [((0.4, 0.02, 0.03, 0.05), True), ((0.4, 0.3, 0.03, 0.05), False), ((0.2, 0.0, 0.0, 0.0), False)],
)
def test_a_wheel_that_is_off_the_machine_file_alone_is_named(worst: tuple[float, ...], *, named: bool) -> None:
    fault = FaultSpec("FR", Side.SENSOR, FaultMode.INEFFICIENT, *WHOLE, 0.3)
    cells = in_cells(simulated(fault), base=True)
    checks = [
        Checked(Kind.WHEEL, w, Side.SENSOR_OR_ACTUATOR, Check.PLANT_RESPONSE, x, 0.19)
        for w, x in zip(cells.machine.wheels, worst, strict=True)
    ]
    found = what_stands_out(checks, cells, HYDRAULIC)
    assert list(found) == (["FR"] if named else [])
    assert all(f.mode is FaultMode.INEFFICIENT and f.side is Side.SENSOR_OR_ACTUATOR for f in found.values())


@pytest.mark.parametrize(
    ("off", "side"),
    [
        ((0.05, 0.05), Side.ACTUATOR),
        ((0.3, 0.05), Side.SENSOR_OR_ACTUATOR),
        ((0.05, None), Side.SENSOR_OR_ACTUATOR),
        ((), Side.SENSOR_OR_ACTUATOR),
    ],
)
def test_what_stands_out_although_both_measurements_agree_lies_behind_the_valve(
    off: tuple[float | None, ...], side: Side
) -> None:
    cells = in_cells(simulated(FaultSpec("RR", Side.ACTUATOR, FaultMode.INEFFICIENT, *WHOLE, 0.6), seed=5), base=True)
    second = [
        Checked(Kind.WHEEL, "RR", of, Check.SECOND_MEASUREMENT, x, 0.25)
        for of, x in zip((Side.SENSOR, Side.ACTUATOR), off, strict=False)
    ]
    fault = what_stands_out((*checks_of(cells, HYDRAULIC), *second), cells, HYDRAULIC)["RR"]
    assert (fault.side, fault.mode) == (side, FaultMode.INEFFICIENT)
    assert ("lies behind the valve" in fault.evidence[-1]) is (side is Side.ACTUATOR)


@pytest.mark.parametrize(
    ("starts", "seconds", "makes", "sure"),
    [
        ((10.0, 10.2), 2.0, 1.0, False),
        ((10.0, 20.0), 2.0, 1.0, True),
        ((10.0, 10.2), 8.0, 1.0, True),
        ((10.0, 20.0), 2.0, 0.3, False),
        ((10.0, 20.0), 8.0, 0.3, True),
        ((10.0, 20.0), 2.0, 0.0, False),
        ((10.0, 20.0), 8.0, 0.0, True),
    ],
)
def test_axles_that_stand_for_a_moment_at_once_or_while_the_machine_slows_or_rests_are_hardly_faulty(
    starts: tuple[float, float], seconds: float, makes: float, *, sure: bool
) -> None:
    told = np.ones((600, 4))
    machine = SimpleNamespace(max_speed=2.0, axles=("front", "rear"))
    cells = cast(
        Cells,
        SimpleNamespace(
            timeline=SimpleNamespace(dt=0.01),
            dt=0.1,
            width=10,
            machine=machine,
            reference=told if makes else 0.0 * told,
            wheels=lambda _: makes * told,
            axles=lambda _: np.zeros((600, 2)),
        ),
    )
    found = {
        axle: finding_of((round(100 * a), round(100 * (a + seconds))), FaultMode.NO_SIGNAL, None, ())
        for axle, a in zip(("front", "rear"), starts, strict=True)
    }
    for f in less_sure_together(found, (), cells).values():
        faulty = sum(h.p for h in f.hypotheses if h.mode != "healthy")
        assert faulty == pytest.approx(0.95 if sure else 0.55)
