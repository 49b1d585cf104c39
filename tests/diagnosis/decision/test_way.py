"""Where path and distance come from, by hand."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.decision.way import path_of, way_of
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

STEP = 100_000_000  # 10 Hz
MACHINE = Machine(name="two", id="", wheels=("A", "B"), geometry=None)
N = 600
T = np.arange(N) * 0.1
LAT = 61.0 + 0.5 * T / 111_195.0  # 0.5 m/s to the north
SPEEDS = {"wheel.A.v": np.full(N, 0.5), "wheel.B.v": np.full(N, 0.5)}
GNSS = {"gnss.lat": LAT, "gnss.lon": np.full(N, 24.0)}
ODOMETRY = {"odom.x": 0.5 * T, "odom.y": 0.0 * T}
DEAD = {"odom.x": 0.0 * T, "odom.y": 0.0 * T}
AT_REST = {"wheel.A.v": 0.0 * T, "wheel.B.v": 0.0 * T}


def timeline(columns: dict[str, np.ndarray]) -> Timeline:
    named = {name: np.asarray(x, dtype=np.float64) for name, x in columns.items()}
    return Timeline(
        start_ns=0,
        step_ns=STEP,
        size=next(iter(named.values())).size,
        signals=named,
        fresh={k: np.isfinite(x) for k, x in named.items()},
        sources=dict.fromkeys(named, "a.csv"),
        periods_ns=dict.fromkeys(named, STEP),
    )


def test_odometry_comes_before_gnss() -> None:
    both = timeline({"odom.x": [0.0, 1.0], "odom.y": [0.0, 2.0], "gnss.lat": [61.0, 61.0], "gnss.lon": [24.0, 24.0]})
    assert_array_equal(path_of(both, MACHINE)["path.y"], [0.0, 2.0])
    assert way_of(both, MACHINE) == ("odometry", "", None, "")
    gnss = path_of(timeline({"gnss.lat": [np.nan, 61.0, 61.001], "gnss.lon": [np.nan, 24.0, 24.001]}), MACHINE)
    assert_allclose(gnss["path.y"], [np.nan, 0.0, 111.195], atol=0.01)
    assert_allclose(gnss["path.x"], [np.nan, 0.0, 111.195 * np.cos(np.radians(61))], atol=0.01)
    assert path_of(timeline({"wheel.A.v": [0.0]}), MACHINE) == {}


@pytest.mark.parametrize("others", [GNSS, SPEEDS | GNSS, AT_REST | GNSS])
def test_odometry_that_stands_still_is_not_used(others: dict[str, np.ndarray]) -> None:
    line = timeline(DEAD | others)
    way = way_of(line, MACHINE)
    assert way.positions == "GNSS"
    assert way.path_note.startswith("Odometry stands still where ")
    assert np.ptp(path_of(line, MACHINE)["path.y"]) == pytest.approx(30.0, abs=0.1)


def test_odometry_that_freezes_early_is_not_used() -> None:
    frozen = {"odom.x": 0.5 * np.minimum(T, 15.0), "odom.y": 0.0 * T}
    assert way_of(timeline(frozen | GNSS), MACHINE).positions == "GNSS"
    late = {"odom.x": 0.5 * np.minimum(T, 45.0), "odom.y": 0.0 * T}
    assert way_of(timeline(late | GNSS), MACHINE).positions == "odometry"


def test_where_no_source_of_positions_moves_there_is_none() -> None:
    way = way_of(timeline(DEAD | SPEEDS), MACHINE)
    assert (way.positions, way.distance_m) == ("", pytest.approx(30.0))
    assert "the wheels' speeds show 30 m of way" in way.path_note
    still = {"gnss.lat": np.full(N, 61.0), "gnss.lon": np.full(N, 24.0)}
    assert way_of(timeline(still | SPEEDS), MACHINE).path_note.startswith("GNSS stands still")
    assert way_of(timeline(still | ODOMETRY | SPEEDS), MACHINE) == ("odometry", "", pytest.approx(30.0), "")


def test_a_machine_at_rest_keeps_its_odometry() -> None:
    """A satellite receiver wanders."""
    rng = np.random.default_rng(3)
    wander = {"gnss.lat": 61.0 + rng.normal(0.0, 0.3 / 111_195.0, N), "gnss.lon": np.full(N, 24.0)}
    assert way_of(timeline(DEAD | AT_REST | wander), MACHINE) == ("odometry", "", 0.0, "")


def test_speeds_that_are_dead_do_not_tell_the_distance() -> None:
    for positions, by in ((GNSS, "GNSS"), (ODOMETRY, "odometry"), (DEAD | GNSS, "GNSS")):
        way = way_of(timeline(AT_REST | positions), MACHINE)
        assert way.distance_m == pytest.approx(30.0, abs=0.6)
        assert way.distance_note.startswith(f"by {by}, ")


def test_a_pivot_turn_is_no_way() -> None:
    turning = {"wheel.A.v": np.full(N, -0.5), "wheel.B.v": np.full(N, 0.5)}
    assert way_of(timeline(turning | DEAD), MACHINE).positions == "odometry"


@pytest.mark.parametrize("size", [1, 2, 49, 50, 51, 52, 599, 551])
def test_any_length_is_cut_into_the_same_steps(size: int) -> None:
    whole = {n: x[:size] for n, x in (DEAD | GNSS | SPEEDS).items()}
    way = way_of(timeline(whole), MACHINE)
    assert way.positions == ("GNSS" if size > 40 else "odometry")
    assert way.distance_m == pytest.approx(0.05 * size)
