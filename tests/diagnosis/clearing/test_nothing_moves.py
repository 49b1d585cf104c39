"""A machine that stands while its drives are open, and axles that open late: neither is the fault of a part."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.nothing_moves import nothing_moves, supply_gone
from diagnosis.clearing.still import commanded_still, longest_still, opens_late
from replay.control.loop import Replay
from replay.machine.config import haulotte
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
DT, SIZE = 0.01, 7500
T = np.arange(SIZE) * DT
MACHINE = haulotte()
WHEELS, AXLES = MACHINE.wheels, MACHINE.axles
STALLED = (T >= 40.0) & (T < 43.0)
DRIVEN = np.where(T < 5.0, 0.0, 0.5)


def mission(speeds: dict[str, Array], openings: dict[str, Array], angle: Array, steered: Array) -> Cells:
    """Cells of a mission with such speeds [of the top speed], openings and one axle's angle and command."""
    columns = {f"wheel.{w}.v": x * MACHINE.max_speed for w, x in speeds.items()}
    columns |= {f"wheel.{w}.u": x for w, x in openings.items()}
    columns |= {f"steer.{AXLES[0]}.phi": angle, f"steer.{AXLES[0]}.u": steered}
    timeline = cast(Timeline, SimpleNamespace(dt=DT, size=SIZE, get=columns.get))
    return Cells(timeline, told(np.full(SIZE, np.nan)), MACHINE)


def told(speed: Array) -> Replay:
    """A replay in which every wheel is told such a speed [of the top speed]."""
    return cast(Replay, SimpleNamespace(v_ref=np.outer(speed * MACHINE.max_speed, np.ones(len(WHEELS)))))


def driving(stands: tuple[str, ...] = WHEELS, when: NDArray[np.bool_] = STALLED, steered: float = 0.4) -> Cells:
    """A machine whose wheels follow their openings, but for some of them at a time; its axle is steered then."""
    speeds = {w: DRIVEN * 0.8 * ~(when & (w in stands)) for w in WHEELS}
    command = steered * np.sin(0.7 * T)
    angle = 0.3 * np.cumsum(np.where(when & (len(stands) == len(WHEELS)), 0.0, command)) * DT
    return mission(speeds, dict.fromkeys(WHEELS, DRIVEN), angle, command)


def test_a_machine_that_stands_with_open_drives_is_told_as_that_and_no_axle_blamed() -> None:
    cells = driving()
    event = supply_gone(cells)
    assert event is not None
    assert "40.0–43.0 s" in event.text
    assert longest_still(cells, 0)[0] == 0.0


@pytest.mark.parametrize("stands", [WHEELS[:1], WHEELS[:2]])
def test_wheels_that_stand_while_others_move_are_no_stall(stands: tuple[str, ...]) -> None:
    assert supply_gone(driving(stands)) is None


@pytest.mark.parametrize(("steered", "stalls"), [(0.6, True), (0.1, False)])
def test_half_of_the_drives_tell_it_where_an_axle_stands_as_well(steered: float, stalls: bool) -> None:
    """Motors of the rear axle alone may drive; without an axle that shows it, too, the others may merely rest."""
    openings = {w: np.where(STALLED & (w in WHEELS[:2]), 0.0, DRIVEN) for w in WHEELS}
    command = np.where(STALLED, steered, 0.6 * np.sin(0.7 * T))
    angle = 0.3 * np.cumsum(np.where(STALLED, 0.0, command)) * DT
    cells = mission(dict.fromkeys(WHEELS, DRIVEN * 0.8 * ~STALLED), openings, angle, command)
    assert (supply_gone(cells) is not None) is stalls


@pytest.mark.parametrize(
    ("axles", "turns_at_rest", "stalls"), [(AXLES, True, True), (AXLES[:1], True, False), (AXLES, False, False)]
)
def test_axles_that_stand_together_at_rest_are_the_supplys(
    axles: tuple[str, ...], *, turns_at_rest: bool, stalls: bool
) -> None:
    """An engine may die while nobody drives; tyres that never turn at rest, and one axle alone, tell nothing of that."""
    rests, dead = (T >= 40.0) & (T < 48.0), (T >= 40.0) & (T < 42.0)
    command = 0.6 * np.where((T // 4.0).astype(int) % 2 == 0, 1.0, -1.0)
    driven = np.where(rests, 0.0, DRIVEN)
    columns = {f"wheel.{w}.v": driven * 0.8 * MACHINE.max_speed for w in WHEELS} | {
        f"wheel.{w}.u": driven for w in WHEELS
    }
    for axle in AXLES:
        stands = dead if axle in axles else np.zeros(SIZE, np.bool_)
        moved = np.where(stands if turns_at_rest or axle not in axles else rests, 0.0, command)
        columns |= {f"steer.{axle}.phi": 0.3 * np.cumsum(moved) * DT, f"steer.{axle}.u": command}
    timeline = cast(Timeline, SimpleNamespace(dt=DT, size=SIZE, get=columns.get))
    cells = Cells(timeline, told(np.full(SIZE, np.nan)), MACHINE)
    assert (supply_gone(cells) is not None) is stalls


@pytest.mark.parametrize(("opened_s", "stalls"), [(0.6, True), (0.0, False)])
def test_an_axle_that_stands_after_open_drives_stopped_is_the_supplys(opened_s: float, *, stalls: bool) -> None:
    """Too briefly to tell by themselves; where the drives were shut before, the axle has a fault."""
    rests = (T >= 40.0) & (T < 46.0)
    openings = dict.fromkeys(WHEELS, np.where(rests & (40.0 + opened_s <= T), 0.0, DRIVEN))
    command = np.where(rests & (T < 44.0), 0.6, np.where(rests, 0.0, 0.6 * np.sin(0.7 * T)))
    angle = 0.3 * np.cumsum(np.where(rests, 0.0, command)) * DT
    cells = mission(dict.fromkeys(WHEELS, DRIVEN * 0.8 * ~rests), openings, angle, command)
    assert (supply_gone(cells) is not None) is stalls


@pytest.mark.parametrize(("speed", "stalls"), [(0.0, False), (0.4, True)])
def test_a_machine_that_is_held_on_a_slope_follows_its_command(speed: float, *, stalls: bool) -> None:
    cells = replace(driving(), replay=told(np.where(STALLED, speed, 0.8 * DRIVEN)))
    assert nothing_moves(cells).any() == stalls


@pytest.mark.parametrize(("creeps", "stalls"), [(0.02, False), (0.0, True)])
def test_second_speeds_that_creep_on_show_that_the_first_are_deaf(creeps: float, *, stalls: bool) -> None:
    cells = driving()
    rng = np.random.default_rng(2)
    rolls = np.where(STALLED, creeps, 0.8 * DRIVEN) * MACHINE.max_speed + rng.normal(0.0, 0.002, SIZE)
    columns = {f"wheel.{w}.v_true": rolls for w in WHEELS}
    timeline = cells.timeline
    both = cast(Timeline, SimpleNamespace(dt=DT, size=SIZE, get=lambda name: columns.get(name, timeline.get(name))))
    assert nothing_moves(replace(cells, timeline=both)).any() == stalls


def test_a_moment_is_no_stall() -> None:
    assert supply_gone(driving(when=(T >= 40.0) & (T < 40.6))) is None


def test_drives_that_never_move_anything_are_no_stall() -> None:
    """Nothing says that such openings would have moved the machine: each drive may have failed."""
    assert not nothing_moves(driving(when=T >= 12.0)).any()


def test_a_sensor_that_waits_for_its_next_edge_moves_nothing() -> None:
    cells = driving()
    held = np.where(STALLED, 0.05, cells.means(f"wheel.{WHEELS[0]}.v")[0])
    columns = {f"wheel.{w}.v": DRIVEN * 0.8 * ~STALLED * MACHINE.max_speed for w in WHEELS}
    columns[f"wheel.{WHEELS[0]}.v"] = np.where(STALLED, held * MACHINE.max_speed, columns[f"wheel.{WHEELS[0]}.v"])
    columns |= {f"wheel.{w}.u": DRIVEN for w in WHEELS}
    timeline = cast(Timeline, SimpleNamespace(dt=DT, size=SIZE, get=columns.get))
    assert supply_gone(replace(cells, timeline=timeline, _kept={})) is not None


def steering(turns: Array, command: Array) -> Cells:
    return mission({}, {}, 0.4 * np.cumsum(turns) * DT, command)


def _command() -> Array:
    """Small and large commands by turns, each for 1.5 s, to either side."""
    size = np.where((T // 1.5).astype(int) % 2 == 0, 0.15, 0.4)
    return size * np.where((T // 3.0).astype(int) % 2 == 0, 1.0, -1.0)


def test_an_axle_that_rests_at_small_commands_alone_opens_late() -> None:
    command = _command()
    cells = steering(np.where(np.abs(command) > 0.2, command, 0.0), command)
    assert np.nanmax(commanded_still(cells, 0)) == pytest.approx(0.15, abs=0.01)
    assert opens_late(cells, 0)


def test_an_axle_that_rests_now_and_then_has_a_fault() -> None:
    command = _command()
    dead = (T > 30.0) & (T < 42.0)
    assert not opens_late(steering(np.where(dead, 0.0, command), command), 0)


def test_an_axle_that_never_turns_has_a_fault() -> None:
    assert not opens_late(steering(np.zeros(SIZE), _command()), 0)


def test_a_machine_without_steered_axles_may_stall_as_well() -> None:
    cells = replace(driving(), machine=replace(MACHINE, geometry=None), _kept={})
    assert cells.machine.axles == ()
    assert supply_gone(cells) is not None
