"""Controllers in the simulated loop, the preset of the paper's table, and the table itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from replay.controllers.choice import CONTROLLER_NAMES, Controller
from replay.errors import ConfigError
from replay.faults import FaultMode, Side
from replay.simulation.controller_table import TABLE_SCENARIOS, controller_table
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.presets import preset_options
from replay.simulation.run import mission_parts, simulate_mission
from replay.simulation.structures import StructureOptions

SHORT = SimulationOptions(scenario="paper", duration_s=20.0, rate_hz=100.0, evidence="base", faults=(), ice=0.0)


def error_and_effort(mission: SimulatedMission) -> tuple[float, float]:
    wheels = mission.truth.wheels
    error = [np.abs(mission.actual[f"wheel.{w}.v"] - mission.actual[f"wheel.{w}.v_ref"]).mean() for w in wheels]
    return float(np.mean(error)), float(np.mean([np.abs(mission.columns[f"wheel.{w}.u"]).mean() for w in wheels]))


@pytest.mark.parametrize("name", CONTROLLER_NAMES[2:])
def test_every_controller_tracks_a_healthy_machine(name: str) -> None:
    error, _ = error_and_effort(simulate_mission(replace(SHORT, controller=Controller(name))))
    assert error < 0.006


def test_the_proportional_controller_is_the_law_without_its_adaptive_part() -> None:
    law = simulate_mission(replace(SHORT, law="p"))
    controller = simulate_mission(replace(SHORT, controller=Controller("p")))
    np.testing.assert_array_equal(law.columns["wheel.FR.u"], controller.columns["wheel.FR.u"])


def test_a_controller_stands_in_for_the_law_of_a_structure_too() -> None:
    options = replace(SHORT, structure=StructureOptions("valves"), duration_s=5.0)
    own, other = (simulate_mission(replace(options, controller=c)) for c in (None, Controller("fuzzy")))
    assert np.abs(own.columns["wheel.FR.u"] - other.columns["wheel.FR.u"]).max() > 0.01


def test_brief_faults_are_those_that_a_machine_may_go_on_with() -> None:
    _, faults, _ = mission_parts(SimulationOptions(scenario="brief", duration_s=240.0, rate_hz=100.0))
    stuck = [f for f in faults if f.mode.total]
    assert [(f.component, f.side, f.mode, f.start_s, f.stop_s) for f in stuck] == [
        ("FR", Side.SENSOR, FaultMode.STUCK, t, t + 0.2) for t in (30.0, 100.0, 200.0)
    ]
    assert all(f.epsilon <= 0.3 for f in faults if not f.mode.total)
    assert len(faults) > len(stuck) + 8


def test_the_preset_comes_to_the_papers_table() -> None:
    options = preset_options("paper-table", SimulationOptions(rate_hz=50.0, evidence="base"))
    error, effort = error_and_effort(simulate_mission(options))
    assert error <= 0.019
    assert effort <= 0.125


def test_an_unknown_preset_is_named() -> None:
    with pytest.raises(ConfigError, match="--preset paper: is not known; expected one of paper-table"):
        preset_options("paper", SHORT)


def test_the_table_has_a_row_for_each_controller_and_scenario() -> None:
    *steps, (last, found) = controller_table(("mfhca", "pi"), TABLE_SCENARIOS, (1, 2), 3.0)
    assert [step for step, table in steps if table is None][:2] == ["mfhca, healthy", "pi, healthy"]
    assert last == ""
    assert found is not None
    assert [(r["scenario"], r["controller"]) for r in found["rows"]] == [
        (s, c) for s in TABLE_SCENARIOS for c in ("mfhca", "pi")
    ]
    row = found["rows"][0]
    assert row["error"]["low"] <= row["error"]["mean"] <= row["error"]["high"]  # type: ignore[operator]
    assert row["error_in_faults"]["mean"] is None
    assert found["gains"]["mfhca"]["zeta"] == 2600.0
