"""Signals with the sign, the unit or the place of another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.clearing.mapping import _swapped as exchanged_with
from diagnosis.clearing.mapping import mapping_hints
from diagnosis.pipeline import diagnose_signals
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import haulotte
from replay.simulation.options import SimulatedMission
from tests.campaigns import campaign
from tests.diagnosis.clearing.missions import LENGTH, in_cells, signals_of, simulated

EDIT = Callable[[SimulatedMission], SimulatedMission]


def _times(name: str, factor: float) -> EDIT:
    return lambda m: replace(m, columns={**m.columns, name: factor * m.columns[name]})


def _swapped(a: str, b: str) -> EDIT:
    return lambda m: replace(m, columns={**m.columns, a: m.columns[b], b: m.columns[a]})


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (_times("wheel.RR.v", -1.0), "wheel.RR.v runs against its commanded speed throughout"),
        (_times("wheel.FR.v", 2.0), "wheel.FR.v is twice its commanded speed"),
        (_times("wheel.FR.u", -1.0), "wheel.FR.u runs against its commanded speed"),
        (_times("steer.rear.phi", -1.0), "steer.rear.phi runs against its commanded angle"),
        (_times("steer.front.phi", 57.29578), "steer.front.phi is 57.3 times (degrees read as radians?) its"),
        (_times("steer.front.u", -1.0), "steer.front.u runs against the rate of its angle"),
        (
            _swapped("wheel.FR.v", "wheel.RL.v"),
            "wheel.FR.v follows the commanded speed of RL, and wheel.RL.v that of FR",
        ),
        (_swapped("steer.front.phi", "steer.rear.phi"), "steer.front.phi follows the commanded angle of rear"),
    ],
)
def test_a_wrong_sign_unit_or_place_is_told(edit: EDIT, words: str) -> None:
    (hint, *others) = mapping_hints(in_cells(edit(simulated()), base=True))
    assert hint.text.startswith(words)
    assert "look at its entry under [signals] of a machine file" in hint.text
    assert len(others) <= 1


@pytest.mark.parametrize("seed", campaign([5, 6, 7]))
def test_healthy_missions_and_faults_of_parts_are_not_the_files(seed: int) -> None:
    assert mapping_hints(in_cells(simulated(seed=seed), base=True)) == ()
    for fault in (
        FaultSpec("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL, 0.0, LENGTH),
        FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 0.0, LENGTH, 1.0, 0.1),
        FaultSpec("front", Side.ACTUATOR, FaultMode.INEFFICIENT, 0.0, LENGTH, 0.5),
    ):
        assert mapping_hints(in_cells(simulated(fault, seed=seed), base=True)) == ()


@pytest.mark.parametrize(("share", "hints"), [(1.0, 1), (0.8, 0)])
def test_a_factor_that_is_not_there_all_through_is_no_matter_of_the_file(share: float, hints: int) -> None:
    mission = simulated()
    angle = mission.columns["steer.front.phi"].copy()
    angle[: round(share * angle.size)] *= 0.05
    edited = replace(mission, columns={**mission.columns, "steer.front.phi": angle})
    assert len([h for h in mapping_hints(in_cells(edited, base=True)) if "throughout" in h.text]) == hints


def test_the_gear_read_into_every_speed_is_told_and_clears_nothing() -> None:
    mission = simulated()
    columns = {n: x / 17.7 if n.startswith("wheel.") and n.endswith(".v") else x for n, x in mission.columns.items()}
    hints = mapping_hints(in_cells(replace(mission, columns=columns), base=True))
    assert len(hints) == 4
    assert all(
        "1/17.7 times (the wheel's speed read as the motor's?) its commanded speed" in hint.text for hint in hints
    )


def test_a_size_that_no_loop_stays_behind_by_is_told() -> None:
    (hint,) = mapping_hints(in_cells(_times("wheel.FR.v", 0.2)(simulated()), base=True))
    assert hint.text.startswith("wheel.FR.v is 0.2 times its commanded speed throughout")


def test_parts_that_count_backwards_are_named_and_nothing_that_a_model_claims_of_them_is_stated() -> None:
    turned = _times("wheel.RR.v", -1.0)(simulated())
    assert [(h.component, h.backwards) for h in mapping_hints(in_cells(turned, base=True))] == [("RR", True)]
    report = diagnose_signals(signals_of(turned, base=True), haulotte()).report
    assert not [f for f in report["intervals"] if f["component"] == "RR"]
    assert report["verdict"]["status"] == "not_assessed"
    assert "wheel.RR.v runs against its commanded speed" in report["verdict"]["text"]


@pytest.mark.parametrize(
    ("one", "other", "words"),
    [
        ("wheel.FR.u", "wheel.FL.u", "wheel.FR.u_applied follows the command of FL, and wheel.FL.u_applied that of FR"),
        ("steer.front.u", "steer.rear.u", "steer.front.u_applied follows the command of rear"),
    ],
)
def test_openings_that_follow_each_others_commands_blame_no_valve(one: str, other: str, words: str) -> None:
    mission = _swapped(one, other)(simulated())
    (hint,) = [h for h in mapping_hints(in_cells(mission, base=False)) if h.exchanged]
    assert hint.text.startswith(words)
    report = diagnose_signals(signals_of(mission, base=False), haulotte()).report
    assert not [f for f in report["intervals"] if f["component"] in hint.exchanged and f["severity"] != "info"]
    assert report["verdict"]["status"] == "not_assessed"
    assert "correct [signals] in a machine file" in report["verdict"]["text"]


@pytest.mark.parametrize("value", [-0.02, -0.3])
def test_a_reading_that_stays_where_it_is_runs_against_nothing(value: float) -> None:
    """Held beyond its middle while its command is mostly on the other side."""
    mission = simulated()
    asked = mission.columns["steer.front.phi_ref"]
    columns = {**mission.columns, "steer.front.phi": np.full(asked.size, value), "steer.front.phi_ref": np.abs(asked)}
    assert not [h for h in mapping_hints(in_cells(replace(mission, columns=columns), base=True)) if h.backwards]


def test_one_factor_of_all_wheels_is_no_fault_of_any() -> None:
    """A wheel's size or a unit that is wrong ten times: four speed sensors were to be replaced."""
    mission = simulated()
    wrong = {f"wheel.{w}.v": 0.09 * mission.columns[f"wheel.{w}.v"] for w in haulotte().wheels}
    edited = replace(mission, columns={**mission.columns, **wrong})
    hints = mapping_hints(in_cells(edited, base=True))
    assert {h.exchanged for h in hints} == {(w,) for w in haulotte().wheels}
    report = diagnose_signals(signals_of(edited, base=True), haulotte()).report
    assert report["verdict"]["title"] == "The machine's settings do not fit the log"
    assert not [f for f in report["intervals"] if f["severity"] != "info" and f["component"] in haulotte().wheels]
    one = {"wheel.FR.v": wrong["wheel.FR.v"]}
    alone = mapping_hints(in_cells(replace(mission, columns={**mission.columns, **one}), base=True))
    assert [h.exchanged for h in alone if h.component == "FR"] == [()]


def test_a_wheel_that_is_dragged_along_while_its_loop_opens_is_no_matter_of_the_file() -> None:
    """A dead motor of six-wheeled machines was "half its commanded speed": correct [signals]."""
    mission = simulated()
    half = {"wheel.FR.v": 0.5 * mission.columns["wheel.FR.v"]}
    asks = {"wheel.FR.u": 1.5 * mission.columns["wheel.FR.u"]}
    (told,) = mapping_hints(in_cells(replace(mission, columns={**mission.columns, **half}), base=True))
    assert told.text.startswith("wheel.FR.v is half its commanded speed throughout")
    assert mapping_hints(in_cells(replace(mission, columns={**mission.columns, **half, **asks}), base=True)) == ()


def test_an_opening_that_stays_at_zero_is_exchanged_with_none() -> None:
    mission = simulated()
    asked = mission.columns["wheel.FR.u"]
    columns = {
        **mission.columns,
        "wheel.FR.u": np.sign(asked) * np.minimum(1.0, 3.0 * np.abs(asked)),
        "wheel.FR.u_applied": 0.001 * asked,
    }
    hints = mapping_hints(in_cells(replace(mission, columns=columns), base=False))
    assert not [h for h in hints if "follows" in h.text]


def test_two_rows_tell_no_place() -> None:
    """A log of 20 ms was told to have its valves exchanged."""
    mission = _swapped("wheel.FR.v", "wheel.RL.v")(simulated())
    short = replace(
        mission, stamps=mission.stamps[2000:2300], columns={n: x[2000:2300] for n, x in mission.columns.items()}
    )
    assert mapping_hints(in_cells(short, base=True)) == ()


@pytest.mark.parametrize(("gain", "exchanged"), [(0.6, False), (1.0, True)])
def test_a_weak_valve_beside_one_that_follows_its_own_command_is_not_exchanged_with_it(
    gain: float, *, exchanged: bool
) -> None:
    """Its loop opens it further, so that it stands where its neighbour is told to."""
    told = 0.3 + 0.2 * np.sin(0.4 * np.arange(600) * 0.1)
    wanted = np.column_stack([told, told / 0.6])
    measured = wanted[:, ::-1] if exchanged else wanted * np.array([1.0, gain])
    assert exchanged_with(measured, wanted, 0.1) is exchanged
