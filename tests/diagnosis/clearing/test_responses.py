"""Limits of a wheel's speed per opening: lower where the other wheels hardly deviate; none asked where openings tell no speeds."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.clearing.axles import _alone
from diagnosis.clearing.cells import Frame
from diagnosis.clearing.limits import long_limit, response_limits, usual_limits
from diagnosis.clearing.longer import LONG_S, around, longer
from diagnosis.clearing.openings import openings_tell
from diagnosis.clearing.responses import Responses, Usual, growth
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

ONCE, TWICE, CLEAR_AT = (False, False), (True, True), 0.25


def responses(*largest: float, changes: tuple[float | None, ...] = ()) -> Responses:
    """Wheels whose largest deviation below and above their usual speed per opening is given."""
    rows = [np.concatenate([np.zeros(20), [x, -x]]) for x in largest]
    windows = np.column_stack(rows)
    known = list(changes or [0.0] * len(largest))
    return Responses(
        windows, windows, [Usual()] * len(largest), windows, windows >= 0.0, known, known, windows, windows
    )


def test_a_wheel_that_deviates_alone_is_held_to_a_lower_limit() -> None:
    of, usual = responses(0.17, 0.01, 0.015, 0.015, changes=(0.15, 0.02, 0.01, None)), usual_limits(ONCE, CLEAR_AT)
    first, second, *_ = response_limits(of, [ONCE] * 4, CLEAR_AT)
    assert first.below == first.above == pytest.approx(0.06)  # no lower than that, however quiet the others are
    assert first.changed == first.grown == pytest.approx(0.038)  # 1.9 times the next
    still = responses(0.0, 0.0, 0.0, 0.0, changes=(0.15, 0.01, 0.01, None))
    assert response_limits(still, [ONCE] * 4, CLEAR_AT)[0].changed == pytest.approx(0.035)
    half = response_limits(of, [(True, False)] * 4, CLEAR_AT)[0]
    assert half.below == pytest.approx(0.1)  # where openings are measured, less hangs on it
    assert half.changed == pytest.approx(0.055)  # and on a change
    assert (first.lasting_below, first.lasting_above) == (usual.lasting_below, usual.lasting_above)
    assert second.below == usual.below  # another wheel deviates by far more


def test_a_wheel_that_is_measured_twice_on_both_sides_keeps_its_limit_of_what_is_above() -> None:
    of = responses(0.3, 0.02, 0.03, 0.03, changes=(0.3, 0.02, 0.01, None))
    usual = usual_limits(TWICE, CLEAR_AT)
    limits = response_limits(of, [TWICE] * 4, CLEAR_AT)
    assert [(limit.above, limit.lasting_above) for limit in limits] == [(usual.above, usual.lasting_above)] * 4
    assert (
        limits[0].below == usual.below < 0.288
    )  # the others' are much less, but what is left is behind its valve; a loss that counts is beyond it


def test_a_change_that_one_wheel_alone_makes_counts_although_it_is_measured_twice() -> None:
    of = responses(0.0, 0.0, 0.0, 0.0, changes=(0.3, 0.02, 0.01, 0.02))
    first, *others = response_limits(of, [TWICE] * 4, CLEAR_AT)
    assert first.changed == pytest.approx(0.055)
    assert all(limit.changed == usual_limits(TWICE, CLEAR_AT).changed for limit in others)


@pytest.mark.parametrize(("ahead", "below"), [((1.0, 1.0, -1.0, -1.0), 0.06), ((1.0, -1.0, -1.0, 1.0), 0.21)])
def test_two_wheels_of_one_axle_that_lose_together_are_held_to_the_others(
    ahead: tuple[float, ...], below: float
) -> None:
    """Two of one side are not, which differ in turns."""
    of = responses(0.07, 0.06, 0.01, 0.005)
    limits = response_limits(of, [ONCE] * 4, CLEAR_AT, ahead=ahead)
    assert limits[0].below == pytest.approx(below)
    assert response_limits(of, [ONCE] * 4, CLEAR_AT)[0].below == pytest.approx(0.21)
    single = response_limits(responses(0.07, 0.06), [ONCE] * 2, CLEAR_AT, ahead=ahead[:2])
    assert single == [usual_limits(ONCE, CLEAR_AT)] * 2


def test_where_all_deviate_alike_the_limit_stays() -> None:
    limits = response_limits(responses(0.17, 0.15, 0.16, 0.14, changes=(0.12, 0.12, 0.12, 0.12)), [ONCE] * 4, CLEAR_AT)
    assert limits == [usual_limits(ONCE, CLEAR_AT)] * 4
    assert response_limits(responses(0.17, 0.02), [ONCE] * 2, CLEAR_AT) == [usual_limits(ONCE, CLEAR_AT)] * 2


@pytest.mark.parametrize("torque", [False, True])
def test_openings_tell_no_speeds_where_they_explain_little_and_most_wheels_stray(*, torque: bool) -> None:
    speed = np.linspace(0.1, 0.3, 200)
    opening = np.where(np.arange(200) % 40 < 20, 1.0, 0.2) if torque else speed
    columns = {
        leaf: x[:, np.newaxis] * np.ones(4) for leaf, x in (("v", speed), ("u", opening), ("u_applied", opening))
    }
    of: Any = SimpleNamespace(
        dt=0.1,
        frame=Frame(200, 30, 5),
        machine=SimpleNamespace(max_speed=0.36, limits=SimpleNamespace(clear_at=CLEAR_AT)),
        wheels=lambda leaf: columns[leaf],
    )
    assert openings_tell(of, responses(0.9, 0.05, 0.05, 0.05))
    assert openings_tell(of, responses(0.9, 0.6, 0.5, 0.5)) is not torque


def test_what_both_axles_do_at_once_is_of_neither() -> None:
    off = np.array([[0.9, 0.8], [0.9, 0.0], [0.9, np.nan], [0.1, -0.9]])
    assert _alone(off, 0) == pytest.approx([0.1, 0.9, 0.9, 0.1])


def test_what_the_ground_hides_of_a_loss_is_not_left_to_the_limit_over_the_mission() -> None:
    """A quarter less of a valve whose wheel the ground half carries is an eighth less speed: the limit may not be above that."""
    of, usual = responses(0.1, 0.1, 0.1, 0.1), usual_limits(ONCE, CLEAR_AT)
    first, second, *_ = response_limits(of, [ONCE] * 4, CLEAR_AT, [0.5, 0.2, 0.0, 0.0])
    assert first.lasting_below == pytest.approx(-np.log(1 - 0.125))
    assert second.lasting_below == usual.lasting_below
    half = response_limits(of, [(True, False)] * 4, CLEAR_AT, [0.5] * 4)[0]
    assert half.lasting_below == usual_limits((True, False), CLEAR_AT).lasting_below


def test_what_grows_is_seen_although_no_moment_parts_it() -> None:
    grows, every = np.linspace(0.0, 0.34, 130), np.ones(130, np.bool_)
    assert growth(grows, [every]) == pytest.approx(0.17)
    assert growth(np.where(np.arange(130) % 26 < 13, 0.2, 0.0), [every]) == 0.0  # comes and goes
    assert growth(np.where(every, np.nan, grows), [every]) == 0.0
    assert growth(np.r_[grows, -grows], [np.arange(260) < 130, np.arange(260) >= 130]) == pytest.approx(0.17)


def test_a_loss_over_the_mission_of_one_wheel_alone_counts_although_it_is_measured_twice() -> None:
    of = responses(*[0.05] * 4)._replace(usual=[Usual(0.2), Usual(0.03), Usual(0.02), Usual(0.0)])
    alike = of._replace(usual=[Usual(0.2), Usual(0.1), Usual(0.15), Usual(0.0)])
    assert response_limits(of, [TWICE] * 4, CLEAR_AT)[0].lasting_below == pytest.approx(0.15)
    assert response_limits(alike, [TWICE] * 4, CLEAR_AT)[0].lasting_below == usual_limits(TWICE, CLEAR_AT).lasting_below


def test_a_second_speed_makes_no_limit_of_what_lies_behind_a_drive_wider() -> None:
    both, valve = (usual_limits(twice, CLEAR_AT) for twice in (TWICE, (True, False)))
    assert both.below <= valve.below
    assert both.changed <= valve.changed
    assert both.lasting_below <= valve.lasting_below


def test_a_loss_over_the_mission_of_one_wheel_alone_counts_where_nothing_is_measured_twice() -> None:
    of, usual = responses(*[0.05] * 4), usual_limits(ONCE, CLEAR_AT)
    alone = of._replace(usual=[Usual(0.07), Usual(0.004), Usual(0.0), Usual(0.0)])
    alike = of._replace(usual=[Usual(0.07), Usual(0.04), Usual(0.0), Usual(0.0)])
    assert response_limits(alone, [ONCE] * 4, CLEAR_AT)[0].lasting_below == pytest.approx(0.06)
    assert response_limits(alike, [ONCE] * 4, CLEAR_AT)[0].lasting_below == usual.lasting_below


def test_what_one_wheel_loses_for_ten_seconds_stands_out_where_three_do_not_show_it() -> None:
    rng = np.random.default_rng(5)
    windows = rng.normal(0.0, 0.03, (140, 4))
    windows[40:64, 1] += 0.11  # twelve seconds
    explained = {"FL": np.zeros(140, np.bool_)}
    of: Any = SimpleNamespace(
        dt=0.1,
        frame=Frame(1425, 30, 5),
        machine=SimpleNamespace(wheels=("FR", "FL", "RR", "RL")),
        explained=lambda wheel: explained.get(wheel, np.zeros(140, np.bool_)),
    )
    long = longer(of, windows, of.machine.wheels)
    assert long.shape == windows.shape
    assert int(np.nanargmax(long[:, 1])) == pytest.approx(52, abs=6)  # in its middle
    assert long[52, 1] == pytest.approx(windows[45:60, 1].mean())
    most = [float(x) for x in np.nanmax(long, axis=0)]
    assert most[1] > long_limit(most, 1, 0.288) == pytest.approx(max(0.075, 3.0 * max(most[0], *most[2:])))
    assert most[0] < long_limit(most, 0, 0.288)
    explained["FL"][38:66] = True  # stated
    assert np.nanmax(longer(of, windows, of.machine.wheels)[:, 1]) < 0.06
    explained = {wheel: np.zeros(8, np.bool_) for wheel in of.machine.wheels}
    assert np.isnan(longer(of, windows[:8], of.machine.wheels)).all()  # shorter than that


def test_a_value_over_ten_seconds_is_told_with_all_of_them() -> None:
    check = Checked(Kind.WHEEL, "FR", Side.SENSOR_OR_ACTUATOR, Check.RESPONSE, 0.2, 0.1, 20.0, 23.0)
    whole = around(check)
    assert (whole.start_s, whole.stop_s) == (16.5, 26.5)
    assert whole.stop_s - whole.start_s == LONG_S
