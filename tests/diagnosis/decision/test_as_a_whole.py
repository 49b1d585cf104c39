"""What a machine does as a whole: all of it is another share of its commands, or what measures the body contradicts its wheels for a time."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.clearing.cells import Cells
from diagnosis.decision.as_a_whole import _at_rest, _falls_behind, _held, as_a_whole
from diagnosis.decision.course import Course
from replay.machine.config import haulotte
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import LENGTH, in_cells, simulated

Array = NDArray[np.float64]
SETTLED = 10  # a mission in which the commands rest for long enough


@cache
def mission(seed: int) -> SimulatedMission:
    """One with a receiver's speed and a gyro that measure the body itself."""
    one, geometry, rng = simulated(seed=seed), haulotte().geometry, np.random.default_rng(1)
    assert geometry is not None
    v = np.median([x for n, x in one.columns.items() if n.startswith("wheel.") and n.endswith(".v_true")], axis=0)
    turn = np.tan(one.columns["steer.front.phi"]) - np.tan(one.columns["steer.rear.phi"])
    yaw = v * turn / (geometry.axle_x("front") - geometry.axle_x("rear"))
    body = {"gnss.speed": np.abs(v) + 0.005 * rng.normal(size=v.size)}
    return replace(one, columns={**one.columns, **body, "imu.yaw_rate": yaw + 0.005 * rng.normal(size=v.size)})


def told(seed: int, leaf: str, share: float, since: float, until: float = LENGTH) -> list[str]:
    """Events of a mission in which channels are multiplied for a time."""
    one = mission(seed)
    t = (one.stamps - one.stamps[0]) * 1e-9
    at = np.where((t >= since) & (t < until), share, 1.0)
    columns = {n: x * at if n.endswith(leaf) else x for n, x in one.columns.items()}
    return [e.text for e in as_a_whole(in_cells(replace(one, columns=columns), base=False))]


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_a_healthy_machine_does_nothing_of_it(seed: int) -> None:
    assert told(seed, ".v", 1.0, 0.0) == []


def test_wheels_that_all_make_less_of_their_commands_are_told() -> None:
    text = " ".join(told(SETTLED, ".v", 0.6, 30.0))
    assert text.startswith("All {wheels} together make ")
    assert "times what they are told up to" in text
    assert told(SETTLED, ".v", 0.85, 30.0) == []
    assert "times what they are told throughout" in " ".join(told(SETTLED, ".v", 0.6, 0.0))


def test_a_receiver_that_comes_to_show_less_contradicts_the_wheels() -> None:
    (text,) = told(5, "gnss.speed", 0.6, 30.0)
    assert text.startswith("By speed over ground the machine goes ")
    assert "as fast as by its {wheels} up to" in text


def test_in_a_tight_turn_the_wheels_that_are_left_beside_a_fault_are_one_sides() -> None:
    one = mission(5)
    t = (one.stamps - one.stamps[0]) * 1e-9
    turns = (t >= 20.0) & (t < 40.0)
    side = {"R": 1.4, "L": 0.6}
    columns = {
        n: x * np.where(turns, side[n[7]], 1.0) if n.startswith("wheel.") and n.endswith((".v", ".v_true")) else x
        for n, x in one.columns.items()
    }
    cells = in_cells(replace(one, columns=columns), base=False)
    beside = replace(cells, stated={"FR": [(0.0, LENGTH)]})
    assert not [e.text for e in as_a_whole(beside) if e.text.startswith("By ")]


@pytest.mark.parametrize(
    ("share", "since", "words"),
    [
        (0.5, 0.0, "turns 0.5"),
        (-1.0, 0.0, "turns the other way, "),
        (0.0, 20.0, "hardly turns, 0.0"),
    ],
)
def test_a_gyro_that_contradicts_the_turns_is_told(share: float, since: float, words: str) -> None:
    (text,) = told(6, "imu.yaw_rate", share, since)
    assert words in text
    assert ("throughout" in text) == (since == 0.0)


def test_without_openings_other_models_judge_the_machine() -> None:
    one = mission(5)
    t = (one.stamps - one.stamps[0]) * 1e-9
    columns = {n: x for n, x in one.columns.items() if not n.endswith((".u", ".u_applied"))}
    columns["gnss.speed"] = columns["gnss.speed"] * np.where(t > 30.0, 0.5, 1.0)
    assert as_a_whole(in_cells(replace(one, columns=columns), base=False)) == []


@pytest.mark.parametrize(("stated", "said"), [(False, True), (True, False)])
def test_wheels_that_all_read_a_speed_at_rest_are_told_but_not_those_of_stated_faults(stated: bool, said: bool) -> None:
    size, wheels, top = 300, ("FR", "FL", "RR", "RL"), 2.0
    rests = np.zeros((size, 4))
    leaves = {"v": rests + 0.3, "u": rests, "u_applied": np.full((size, 4), np.nan)}
    machine = SimpleNamespace(wheels=wheels, max_speed=top)
    cells = SimpleNamespace(
        size=size,
        dt=0.1,
        machine=machine,
        reference=rests,
        wheels=leaves.get,
        told=lambda _: np.full(size, stated),
        driven=range(len(wheels)),
    )
    assert bool(list(_at_rest(cast(Cells, cells)))) is said


@pytest.mark.parametrize(
    ("held", "moves", "said"), [((20, 100), True, True), ((20, 60), True, False), ((20, 100), False, False)]
)
def test_a_body_speed_that_is_held_while_all_wheels_change_theirs_is_told(
    held: tuple[int, int], moves: bool, said: bool
) -> None:
    wheel = 1.0 + (0.6 * np.sin(np.arange(200) / 12.0) if moves else 0.01 * np.arange(200) % 0.05)
    body = wheel.copy()
    body[slice(*held)] = body[held[0]]
    cells = cast(Cells, SimpleNamespace(dt=0.1))
    assert bool(_held(cells, body, np.column_stack([wheel, 1.02 * wheel]), 1.5)) is said


def test_wheels_that_fall_behind_again_and_again_are_told_with_each_of_these_times() -> None:
    share = np.full(200, 1.0)
    for start in (20, 60, 100, 140):
        share[start : start + 9] = 0.5
    cells = cast(Cells, SimpleNamespace(dt=0.1, frame=SimpleNamespace(hop=5, length=10)))
    found = _falls_behind(Course(share, cells), 0.25)
    assert found is not None
    assert "again and again, for 18 s in all" in found.text
    assert found.spans == ((10.0, 15.0), (30.0, 35.0), (50.0, 55.0), (70.0, 75.0))


@pytest.mark.parametrize(("share", "noise", "found"), [(0.6, 0.03, True), (0.9, 0.03, False), (0.6, 0.3, False)])
def test_a_spell_of_another_share_stands_out_of_a_quiet_course_alone(share: float, noise: float, found: bool) -> None:
    course = np.exp(np.random.default_rng(3).normal(0.0, noise, 120))
    course[::3] = np.nan
    course[50:62] *= share
    cells = cast(Cells, SimpleNamespace(dt=0.1, frame=SimpleNamespace(hop=5, length=30)))
    spell = Course(course, cells).spell(0.245, 6.0)
    assert (spell is not None) is found
    assert spell is None or abs(spell[0] - 50) <= 2
    assert Course(course[:20], cells).spell(0.245, 6.0) is None


def test_a_gyro_that_reads_less_for_some_turns_is_told() -> None:
    (text,) = told(6, "imu.yaw_rate", 0.55, 14.0, 21.0)
    assert "turns 0.5" in text
    assert "and 1.00 times else" in text
