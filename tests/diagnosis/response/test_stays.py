"""A wheel of two that stands for most of a short mission: told by its command, the other wheel, and the gyro where there is one."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.inputs import FollowerData, cells
from diagnosis.response.kernel import follow
from diagnosis.results.assessment import Finding
from replay.machine.config import Limits
from replay.machine.geometry import Geometry, WheelGeometry
from tests.campaigns import campaign

Array = NDArray[np.float64]

DT, SECONDS, TRACK = 0.05, 22.0, 0.4  # 18.5 s of it driven
PAIR = ("R", "L")
PLACES = {w: WheelGeometry(0.0, (-0.5 if w == "R" else 0.5) * TRACK, 0.0, "fixed") for w in PAIR}
N = round(SECONDS / DT)
TIME = np.arange(N) * DT


def told(
    seed: int, still: slice, *, drive: bool = False, sensor: bool = False, gyro: bool = True, own: bool = False
) -> list[tuple[str, Finding]]:
    """Findings by wheel, of a drive of which the left wheel stands (`drive`), or reads 0 (`sensor`), in some steps; `own`: each wheel has its command."""
    rng = np.random.default_rng(seed)
    v, turn = (np.repeat(rng.uniform(a, b, 8), 60)[:N] for a, b in ((0.25, 0.7), (-0.5, 0.5)))
    rest = (TIME < 2.0) | (TIME >= 20.5)
    v[rest] = turn[rest] = 0.0
    asked = {w: v - PLACES[w].y * turn for w in PAIR}
    made = {w: follow(np.r_[np.zeros(2), x[:-2]], 0.0, 0.2, 0.2) for w, x in asked.items()}
    if drive:
        made["L"][still] = 0.0
    yaw = (made["R"] - made["L"]) / TRACK + rng.normal(0.0, 0.01, N)
    read = {w: x + rng.normal(0.0, 0.005, N) * (np.abs(x) > 0.01) for w, x in made.items()}
    if sensor:
        read["L"][still] = 0.0
    body = np.column_stack([v, turn])
    data = {
        w: FollowerData(y, np.ones(N, np.bool_), cells(asked[w], 1)[:, None] if own else body, asked[w], f"wheel.{w}.v")
        for w, y in read.items()
    }
    parts = assess_response(data, Geometry(PLACES, 0.1), yaw if gyro else None, Limits(driving_speed=0.05), DT).parts
    return [(w, f) for w, sides in parts.items() for side in sides for f in side.findings]


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize(("first", "last"), [(6.0, 16.0), (10.5, 20.5)])
@pytest.mark.parametrize("seed", campaign([1, 2, 3, 4], 2))
def test_a_drive_that_stands_for_ten_of_eighteen_seconds_is_named_by_the_gyro(
    seed: int, first: float, last: float, own: bool
) -> None:
    """The gyro agrees with the sensor: that had left the drive neither named nor cleared."""
    found = told(seed, slice(round(first / DT), round(last / DT)), drive=True, own=own)
    assert {(w, f.side.value, f.mode.value) for w, f in found} == {("L", "actuator", "no_signal")}
    assert all(abs(f.start * DT - first) < 1.0 and abs(f.stop * DT - last) < 1.0 for _, f in found)


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("gyro", [False, True])
@pytest.mark.parametrize("seed", campaign([1, 2, 3, 4], 2))
def test_a_speed_that_reads_nothing_so_long_is_named(seed: int, gyro: bool, own: bool) -> None:
    found = told(seed, slice(120, 320), sensor=True, gyro=gyro, own=own)
    assert {(w, f.mode.value) for w, f in found} == {("L", "no_signal")}
    assert all(f.side.value != "actuator" for _, f in found)


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("gyro", [False, True])
@pytest.mark.parametrize("seed", campaign([1, 2, 3, 4], 2))
def test_a_healthy_drive_as_short_is_not(seed: int, gyro: bool, own: bool) -> None:
    assert not told(seed, slice(0), gyro=gyro, own=own)


def test_a_wheel_that_is_told_to_stand_does_nothing_wrong() -> None:
    """A turn about the left wheel, and a start of the right one alone."""
    n = slice(120, 320)
    read = {"R": np.where(TIME < 1.0, 0.0, 0.4), "L": np.where(TIME < 1.0, 0.0, 0.4)}
    read["L"][n] = 0.0
    asked = {w: x.copy() for w, x in read.items()}
    data = {
        w: FollowerData(y, np.ones(N, np.bool_), asked[w][:, None], asked[w], f"wheel.{w}.v") for w, y in read.items()
    }
    parts = assess_response(data, Geometry(PLACES, 0.1), None, Limits(driving_speed=0.05), DT).parts
    assert not [
        f for sides in parts.values() for side in sides for f in side.findings if "told to go" in " ".join(f.evidence)
    ]


def test_a_turn_about_a_wheel_by_another_track_than_the_machine_file_has_is_none_of_its_faults() -> None:
    """The file's track makes the wheel in the middle of the turn move a little."""
    turning = (TIME >= 6.0) & (TIME < 16.0)
    v, turn = np.where((TIME < 2.0) | (TIME > 20.0), 0.0, np.where(turning, 0.2, 0.12)), np.where(turning, 1.0, 0.0)
    data = {}
    for w in PAIR:
        y, asked = (v + np.sign(-PLACES[w].y) * 0.5 * track * turn for track in (TRACK, 0.25))
        data[w] = FollowerData(y, np.ones(N, np.bool_), np.column_stack([v, turn]), asked, f"wheel.{w}.v")
    parts = assess_response(data, Geometry(PLACES, 0.1), turn, Limits(driving_speed=0.05), DT).parts
    assert not [f for sides in parts.values() for side in sides for f in side.findings if "told to go" in f.evidence[0]]


def test_a_wheel_that_never_follows_its_command_is_not_held_against_it() -> None:
    """Its command is another one's, or not carried out: that is no standstill under command."""
    read = {"R": np.where(TIME < 1.0, 0.0, 0.4), "L": np.where(TIME < 15.0, 0.0, 0.4)}
    asked = {"R": read["R"], "L": np.where(TIME < 15.0, 0.4, 0.0)}
    data = {
        w: FollowerData(y, np.ones(N, np.bool_), asked[w][:, None], asked[w], f"wheel.{w}.v") for w, y in read.items()
    }
    parts = assess_response(data, Geometry(PLACES, 0.1), None, Limits(driving_speed=0.05), DT).parts
    assert not [
        f for sides in parts.values() for side in sides for f in side.findings if "told to go" in " ".join(f.evidence)
    ]
