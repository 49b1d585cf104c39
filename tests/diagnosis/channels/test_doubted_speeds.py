"""Two speeds of every wheel that differ by one factor: a setting is named, no sensor is, and a true fault beside it still is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.pipeline import diagnose_signals
from diagnosis.response.body import witnesses_of
from diagnosis.results.document import ReportDocument
from replay.faults import FaultMode, FaultSpec, Side
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.signals.speed_doubts import SpeedDoubt, speed_doubt
from replay.signals.timeline import align
from replay.simulation.options import SimulatedMission
from tests.campaigns import campaign
from tests.diagnosis.clearing.missions import LENGTH, simulated

WHEELS = haulotte().wheels


def signals(mission: SimulatedMission, factors: dict[str, float], unit: str = "rpm", second: str = "m/s") -> Signals:
    """A mission whose speeds are that much too large, with those of `second` as the second ones' unit."""
    items = {}
    for name, x in mission.columns.items():
        leaf = name.split(".")[-1]
        own = unit if leaf == "v" else second if leaf == "v_true" else None
        source = SignalSource(column=name, unit=own, at="motor" if own == "rpm" else "wheel")
        items[name] = Signal(name, mission.stamps, factors.get(name, 1.0) * x, source, "simulated", guessed=False)
    return Signals(items, {})


def wrong(factor: float, leaf: str = "v", wheels: tuple[str, ...] = WHEELS) -> dict[str, float]:
    return {f"wheel.{w}.{leaf}": factor for w in wheels}


def doubt(given: Signals) -> SpeedDoubt | None:
    return speed_doubt(align(given), given.items, haulotte())


def judged(given: Signals) -> ReportDocument:
    return diagnose_signals(given, haulotte()).report


@pytest.mark.parametrize("factor", [0.1, 0.7, 0.85, 1.3])
def test_a_diameter_that_is_wrong_is_told_with_the_one_that_fits(factor: float) -> None:
    found, geometry = doubt(signals(simulated(), wrong(factor))), haulotte().geometry
    assert found is not None
    assert geometry is not None
    assert found.factor == pytest.approx(1 / factor, rel=0.02)
    assert set(found.names) == set(wrong(factor))
    assert f"wheel_diameter = {geometry.wheel_diameter * found.factor:.3g}" in found.act
    assert f"gear_ratio = {haulotte().gear_ratio / found.factor:.3g}" in found.act


@pytest.mark.parametrize("seed", campaign([5]))
def test_it_is_a_setting_and_no_sensors_fault(seed: int) -> None:
    report = judged(signals(simulated(seed=seed), wrong(0.7)))
    assert report["intervals"] == []
    verdict = report["verdict"]
    assert (verdict["status"], verdict["title"]) == ("not_assessed", "The machine's settings do not fit the log")
    assert "wheel_diameter = " in verdict["text"]


def test_a_true_fault_beside_it_is_still_named_and_the_setting_too() -> None:
    fault = FaultSpec("FR", Side.SENSOR, FaultMode.NO_SIGNAL, 25.0, 35.0, 1.0)
    report = judged(signals(simulated(fault), wrong(0.7)))
    assert {(f["component"], f["side"], f["mode"]) for f in report["intervals"]} == {("FR", "sensor", "no_signal")}
    assert report["verdict"]["cleared"] is False
    assert any("wheel_diameter" in x["act"] for x in report["verdict"]["to_clear"])


def test_second_speeds_that_are_off_their_commands_are_what_is_put_right() -> None:
    found = doubt(signals(simulated(), wrong(0.5, "v_true"), unit="m/s"))
    assert found is not None
    assert set(found.names) == set(wrong(1.0, "v_true"))
    assert found.first_factor == 1.0
    assert '"wheel.FR.v_true" = { column = "wheel.FR.v_true", unit = "m/s", gain = 2.0 }' in found.act


def test_turns_of_the_motor_beside_turns_of_the_wheel_name_the_gear() -> None:
    given = signals(simulated(), wrong(0.7), second="rad/s")
    found = doubt(given)
    assert found is not None
    assert f"gear_ratio = {haulotte().gear_ratio * 0.7:.3g}" in found.act
    assert "wheel_diameter" not in found.act


@pytest.mark.parametrize(
    "factors",
    [{}, wrong(1.05), wrong(0.7, wheels=("FR", "FL")), dict(zip(wrong(1.0), (0.7, 0.6, 0.8, 0.5), strict=True))],
)
def test_sound_speeds_and_sensors_that_lose_apart_are_no_setting(factors: dict[str, float]) -> None:
    assert doubt(signals(simulated(), factors)) is None


def test_what_begins_in_the_middle_is_no_setting() -> None:
    mission = simulated()
    late = {
        f"wheel.{w}.v": np.where(np.arange(mission.stamps.size) > mission.stamps.size / 2, 0.7, 1.0)
        * mission.columns[f"wheel.{w}.v"]
        for w in WHEELS
    }
    assert doubt(signals(replace(mission, columns={**mission.columns, **late}), {})) is None


@pytest.mark.parametrize("seed", campaign([5, 6]))
def test_healthy_missions_and_faults_of_one_part_raise_no_doubt(seed: int) -> None:
    for fault in ((), (FaultSpec("RL", Side.SENSOR, FaultMode.INEFFICIENT, 0.0, LENGTH, 0.4),)):
        assert doubt(signals(simulated(*fault, seed=seed), {})) is None


def test_a_loop_that_follows_the_speed_it_reads_is_no_witness_and_satellites_are() -> None:
    """Where speeds and commands are off alike, the second speeds were to be written off, beside positions that agree with them."""
    given = signals(simulated(), {**wrong(0.7), **wrong(0.7, "v_ref"), "cmd.v": 0.7}, unit="m/s")
    made = simulated()
    ground = np.abs(np.mean([made.columns[f"wheel.{w}.v_true"] for w in WHEELS], axis=0))
    source = SignalSource(column="gnss.speed")
    given.items["gnss.speed"] = Signal("gnss.speed", made.stamps, ground, source, "simulated", guessed=False)
    line = align(given)
    alone = speed_doubt(line, given.items, haulotte())
    assert alone is not None
    assert set(alone.names) == set(wrong(1.0, "v_true"))
    found = speed_doubt(line, given.items, haulotte(), lambda: witnesses_of(line))
    assert found is not None
    assert set(found.names) == set(wrong(1.0))
    assert "where by speed over ground the second ones are right" in found.text
    assert found.factor == pytest.approx(1 / 0.7, rel=0.02)
    report = judged(given)
    assert report["intervals"] == []
    said = [x["reason"] for x in report["verdict"]["to_clear"]]
    assert not any("times as fast as by its wheels" in text for text in said)
