"""What one wheel's fault does to the others, and to the efforts of its side, is no fault of theirs."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.common_cause import less_sure
from diagnosis.response.inputs import FollowerData
from diagnosis.response.spells import Spell
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, WHEELS, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)


def found(data: dict[str, FollowerData]) -> dict[str, list[Finding]]:
    parts = assess_response(data, geometry(), None, LIMITS, DT).parts
    return {w: [f for side in sides for f in side.findings] for w, sides in parts.items()}


def with_efforts(seed: int, idle: slice) -> dict[str, FollowerData]:
    """Efforts by speed and load; that of RL is next to nothing in `idle`."""
    measured, asked, body = speeds(seed)
    rng = np.random.default_rng(seed)
    out = {}
    for w, data in followers_of(measured, asked, body).items():
        effort = 20.0 * np.sign(measured[w]) + 30.0 * measured[w] + rng.normal(0.0, 1.0, measured[w].size)
        if w == "RL":
            effort[idle] = rng.normal(0.0, 0.3, effort[idle].size)
        out[w] = replace(data, effort=effort)
    return out


def spans(asked: Array) -> tuple[slice, slice]:
    """A stretch of eight seconds and more in which the command changes, and one of four in which it stays."""
    steps = round(4.0 / DT)
    edges = np.flatnonzero(np.diff(asked, prepend=asked[0]) != 0.0)
    same = next(a for a, b in pairwise(edges) if b - a > 1.7 * steps and abs(asked[a + 1]) > 0.3)
    return slice(int(same) - steps, int(same) + 2 * steps), slice(
        int(same) + steps // 2, int(same) + steps // 2 + steps
    )


def test_wheels_without_a_drive_hide_no_idle_one_and_are_not_accused() -> None:
    moved, _ = spans(speeds(6)[1]["RL"])
    data = with_efforts(6, moved)
    data |= {w: replace(data[w], effort=np.zeros(data[w].y.size)) for w in ("FL", "FR")}
    parts = assess_response(data, geometry(), None, LIMITS, DT).parts
    told = {w: [f for side in sides for f in side.findings] for w, sides in parts.items()}
    assert [(f.side, f.mode) for f in told["RL"]] == [(Side.ACTUATOR, FaultMode.NO_SIGNAL)]
    assert [w for w in WHEELS if told[w]] == ["RL"]
    assert "nothing from end to end" in parts["FL"][1].reasons[State.NOT_ASSESSED]


def test_a_drive_without_effort_is_told_where_its_speed_was_to_change() -> None:
    moved, still = spans(speeds(6)[1]["RL"])
    told = found(with_efforts(6, moved))
    assert [(f.side, f.mode) for f in told["RL"]] == [(Side.ACTUATOR, FaultMode.NO_SIGNAL)]
    assert [w for w in WHEELS if told[w]] == ["RL"]
    # two loops that hold one speed share its load in any way
    assert not any(found(with_efforts(6, still)).values())


@pytest.mark.parametrize("dead", [False, True])
def test_an_only_wheel_of_its_side_that_pulls_nothing_is_blamed_where_it_leaves_its_command(dead: bool) -> None:
    pair = ("R", "L")
    measured, asked, body = speeds(6, pair)
    moved, _ = spans(asked["L"])
    if dead:  # it rolls out
        measured["L"][moved] = np.round(
            measured["L"][moved.start] * np.exp(-np.arange(moved.stop - moved.start) * DT), 3
        )
    rng = np.random.default_rng(6)
    data = {}
    for w, one in followers_of(measured, asked, body).items():
        effort = 20.0 * np.sign(measured[w]) + 30.0 * measured[w] + rng.normal(0.0, 1.0, measured[w].size)
        if w == "L":
            effort[moved] = rng.normal(0.0, 0.3, effort[moved].size)
        data[w] = replace(one, effort=effort)
    parts = assess_response(data, geometry(pair), None, LIMITS, DT).parts
    idle = [f for f in parts["L"][1].findings if f.mode is FaultMode.NO_SIGNAL and f.side is Side.ACTUATOR]
    assert bool(idle) == dead
    assert not parts["R"][1].findings


@pytest.mark.parametrize(("mode", "share"), [(FaultMode.INEFFICIENT, 0.85), (FaultMode.STUCK, 1.0)])
def test_what_begins_soon_after_another_wheels_fault_is_less_sure(mode: FaultMode, share: float) -> None:
    def wheel(*spells: Spell) -> Any:  # whose channel never jumps
        samples, jumps = SimpleNamespace(step=np.arange(4000)), SimpleNamespace(place=np.zeros(0, np.intp))
        blocks = SimpleNamespace(start=np.arange(0, 4000, 5))
        return SimpleNamespace(
            spells=list(spells), wheel=SimpleNamespace(dt=DT, samples=samples, jumps=jumps, blocks=blocks)
        )

    spell = Spell(140, 170, mode, 0.95)
    judged = {"MR": wheel(spell), "RR": wheel(Spell(100, 120, FaultMode.OUTSIDE_TABLE, 0.95))}
    assert less_sure(spell, "MR", judged, 0.25).p == pytest.approx(share * 0.95)
    before_it = spell._replace(start=95, stop=112)  # and shorter than the other one
    assert less_sure(before_it, "MR", judged, 0.25).p == pytest.approx(share * 0.95)
    assert less_sure(spell._replace(start=400, stop=420), "MR", judged, 0.25).p == 0.95


def test_no_delay_is_told_beside_a_wheel_that_is_evidently_wrong() -> None:
    measured, asked, body = speeds(7)
    part = slice(round(50 / DT), round(120 / DT))
    rng = np.random.default_rng(1)
    measured["FL"][part] += rng.normal(0.0, 0.3, part.stop - part.start)
    late = round(0.35 / DT)
    measured["RL"][part] = measured["RL"][part.start - late : part.stop - late]
    told = found(followers_of(measured, asked, body))
    assert {f.mode for f in told["FL"]} == {FaultMode.NOISY}
    assert [f for f in told["RL"] if f.mode is FaultMode.OUTSIDE_TABLE] == []


def test_efforts_of_a_machine_that_stands_though_it_is_commanded_accuse_no_drive() -> None:
    """Nothing is pulled then: the noise of one effort is by chance less than that of the others."""
    measured, asked, body = speeds(9)
    stop, rng = slice(round(60 / DT), round(85 / DT)), np.random.default_rng(9)
    changes = np.where(np.arange(stop.stop - stop.start) // 60 % 2, 0.4, 0.9)
    data = {}
    for w, one in followers_of(measured, asked, body).items():
        effort = np.sign(measured[w]) + 0.5 * measured[w] + rng.normal(0.0, 1.0, measured[w].size)
        effort[stop] = rng.normal(0.0, 0.02 if w == "RL" else 1.0, changes.size)
        y, told, commands = one.y.copy(), one.asked.copy(), one.commands.copy()
        y[stop], told[stop], commands[stop] = 0.0, 0.8, np.column_stack([changes, np.zeros(changes.size)])
        data[w] = replace(one, y=y, asked=told, commands=commands, effort=effort)
    assert not any(found(data).values())


def test_one_wheel_with_a_constant_makes_no_faults_of_a_machine_that_stands_though_it_is_commanded() -> None:
    measured, asked, body = speeds(9)
    stop, rng = slice(round(60 / DT), round(64 / DT)), np.random.default_rng(9)
    body[stop] = 0.8, 0.0
    for w in WHEELS:
        asked[w][stop] = 0.8
        measured[w][stop] = rng.normal(0.0, 0.001, stop.stop - stop.start)
    measured["RL"] += 0.08
    told = found(followers_of(measured, asked, body))
    assert not any(f.mode is FaultMode.NO_SIGNAL for w in WHEELS for f in told[w])
