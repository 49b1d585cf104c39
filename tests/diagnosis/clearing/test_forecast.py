"""What a log's signals can tell, before anything is judged."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from diagnosis.clearing.forecast import Forecast, forecast
from diagnosis.pipeline import diagnose_signals
from diagnosis.results.document import ReportDocument
from diagnosis.results.machine_words import HYDRAULIC, MachineWords
from diagnosis.results.vocabulary import Kind
from replay.faults import Side
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission

PAPER = haulotte()

_BASE = [f"wheel.{w}.{leaf}" for w in ("FR", "FL", "RR", "RL") for leaf in ("v", "u")] + [
    f"steer.{a}.{leaf}" for a in ("front", "rear") for leaf in ("phi", "u")
]


def _by_part(logged: list[str]) -> dict[tuple[str, Side], Forecast]:
    return {(c, f.side): f for f in forecast(logged, haulotte(), HYDRAULIC) for c in f.components}


def test_single_measurements_do_not_tell_sensor_from_valve() -> None:
    found = forecast(_BASE, haulotte(), HYDRAULIC)
    assert [(len(f.components), f.side, f.told) for f in found] == [
        (4, Side.SENSOR, False),
        (4, Side.ACTUATOR, False),
        (2, Side.SENSOR, False),
        (2, Side.ACTUATOR, False),
    ]
    assert [f.log for f in found] == [
        ("wheel.*.v_true",),
        ("wheel.*.u_applied",),
        ("steer.*.phi_true or imu.yaw_rate",),
        ("steer.*.u_applied",),
    ]


def test_second_measurements_tell_their_side_at_any_time() -> None:
    found = _by_part([*_BASE, "wheel.FR.v_true", "wheel.FL.u_applied", "steer.front.phi_true", "imu.yaw_rate"])
    assert found["FR", Side.SENSOR].told
    assert not found["FR", Side.ACTUATOR].told
    assert found["FL", Side.ACTUATOR].told
    assert found["front", Side.SENSOR].told
    assert "offset shows by the yaw rate" in found["rear", Side.SENSOR].words


def test_what_is_not_logged_is_not_judged() -> None:
    found = _by_part(["wheel.FR.v", "wheel.FR.v_ref", "wheel.FL.u", "steer.front.phi"])
    assert "not judged: no valve command" in found["FR", Side.ACTUATOR].words
    assert "departs from the commanded speed" in found["FR", Side.SENSOR].words
    assert found["FL", Side.SENSOR].words == "not judged: no speed is logged"
    assert found["FL", Side.ACTUATOR].words == "not judged: no speed and no opening is logged"
    assert found["front", Side.SENSOR].log[0] == "steer.*.phi_ref or steer.*.u"
    assert "too few wheels" in _by_part(["wheel.FR.v", "wheel.FR.u"])["FR", Side.SENSOR].words


def test_only_what_is_not_logged_is_asked_for() -> None:
    found = _by_part(["wheel.FR.v", "wheel.FR.v_ref", "wheel.FR.u_applied", "wheel.FL.v"])
    assert found["FR", Side.ACTUATOR].log == ("wheel.*.u",)
    assert found["FL", Side.ACTUATOR].log == ("wheel.*.u", "wheel.*.u_applied")


def test_one_speed_without_a_command_is_not_judged() -> None:
    one = replace(haulotte(), wheels=("D",), geometry=None)
    told = forecast(["wheel.D.v"], one, MachineWords(drive="drive"))
    assert [(f.words, f.log) for f in told] == [
        ("only a speed that is frozen, wild or noisy shows: no command is logged", ("cmd.v", "wheel.*.v_true")),
        ("not judged: no command is logged", ("cmd.v", "wheel.*.effort")),
    ]
    sensor, drive = forecast(["wheel.D.v", "wheel.D.v_ref"], one, MachineWords(drive="drive"))
    assert "standstill" in sensor.words
    assert "standstill" in drive.words


def _axles(report: ReportDocument) -> set[tuple[str, Side]]:
    """Sides of axles of which anything was judged."""
    return {
        (row["component"], Side(row["side"]))
        for row in report["coverage"]
        if row["component"] in PAPER.axles and row["tier"] != "none"
    }


@pytest.mark.parametrize(
    "left_out",
    [
        r"_true|u(_applied)?$",
        r"_true|u(_applied)?$|phi_ref",
        r"_true|u(_applied)?$|phi_ref|cmd|_ref",
        r"_true|\.u$",
        r"_true|applied",
        r"phi$|_true|applied",
    ],
)
def test_what_is_said_of_the_steering_is_what_the_diagnosis_does(left_out: str) -> None:
    mission = simulate_mission(SimulationOptions(scenario="healthy", seed=7, duration_s=40.0, rate_hz=100.0))
    items = {
        n: Signal(n, mission.stamps, x, SignalSource(column=n), "a.mcap", guessed=False)
        for n, x in mission.columns.items()
        if not re.search(left_out, n)
    }
    report = diagnose_signals(Signals(items, {}), PAPER).report
    foretold = forecast(items, PAPER, HYDRAULIC)
    told = {(c, f.side) for f in foretold if f.kind is Kind.STEER for c in f.components if "not judged" not in f.words}
    assert told == _axles(report)


def test_openings_whose_unit_is_in_doubt_are_no_evidence() -> None:
    logged = [*_BASE, "wheel.FR.u_applied", "steer.front.u_applied", "cmd.v"]
    found = {(c, f.side): f for f in forecast(logged, PAPER, HYDRAULIC, doubted=True) for c in f.components}
    for part in ("FR", "RL", "front"):
        assert found[part, Side.ACTUATOR].words == "not judged before the unit of the valve openings is certain"
    assert found["RL", Side.SENSOR].words.startswith("what departs from the commanded speed")
