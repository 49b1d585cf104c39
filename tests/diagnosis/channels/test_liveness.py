"""A silent channel among those recorded with it: no signal, and what is lost with a whole message or by its topic."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from diagnosis.channels.liveness import alive, alive_sources
from diagnosis.pipeline import diagnose
from replay.export.mission import FORMATS, write_mission
from replay.faults import FaultMode, FaultSpec, Side
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align
from replay.simulation.options import EvidenceLevel, SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign_of_rows

START = 1_760_000_000_000_000_000
N = 3000  # samples of 2 ms


def recorded(name: str, topic: str | None, *gaps: tuple[int, int], nan: bool = False, late: int = 0) -> Signal:
    """A signal without the samples of its gaps, or with NaN there."""
    stamps = START + (2_000_000 * np.arange(N) + late).astype(np.int64)
    values = np.sin(0.01 * np.arange(N))
    kept = np.ones(N, dtype=np.bool_)
    for a, b in gaps:
        kept[a:b] = False
    if nan:
        values, kept = np.where(kept, values, np.nan), np.ones(N, dtype=np.bool_)
    origin = SignalSource(topic=topic, field=name) if topic else SignalSource(column=name)
    return Signal(name, stamps[kept], values[kept], origin, "a", guessed=False)


def silent_steps(name: str, *signals: Signal) -> np.ndarray:
    """Steps at which a signal is silent while others live."""
    timeline = align(Signals({s.name: s for s in signals}, {}))
    assert timeline.size == N
    return np.flatnonzero(~np.isfinite(timeline.signals[name]) & alive(timeline, alive_sources(timeline), name))


def test_message_that_is_missing_silences_none_of_its_signals() -> None:
    commands = recorded("cmd.v", "/cmd_vel")
    for gap in ((1000, 1030), (1000, 2500)):
        joints = [recorded(f"wheel.{w}.v", "/joint_states", gap) for w in ("FR", "FL")]
        assert silent_steps("wheel.FR.v", *joints, commands).size == 0


def test_signals_that_end_before_one_that_comes_late_are_not_silent() -> None:
    joints = [recorded(f"wheel.{w}.v", "/joint_states", (2800, N)) for w in ("FR", "FL", "RR")]
    late = recorded("wheel.RL.v", "/joint_states")
    assert silent_steps("wheel.FR.v", *joints, late).size == 0
    early = recorded("wheel.FR.v", "/joint_states", (2500, N))
    steps = silent_steps("wheel.FR.v", early, *joints[1:], late)
    assert steps[-1] == 2799


@pytest.mark.parametrize("nan", [False, True])
def test_signal_that_is_missing_from_its_message_is_silent(nan: bool) -> None:
    whole, cut = recorded("wheel.FL.v", "/joint_states"), recorded("wheel.FR.v", "/joint_states", (1000, 1030), nan=nan)
    steps = silent_steps("wheel.FR.v", whole, cut)
    assert steps[0] <= 1002
    assert_array_equal(steps, np.arange(steps[0], 1030))


def test_topic_of_one_signal_is_silent_beside_those_of_the_other_wheels() -> None:
    # stamps of the others lie between its own, and one moment is lost by all
    stall = (2000, 2200)
    others = [recorded(f"wheel.{w}.v", f"/{w}/speed", stall, late=900_000) for w in ("FL", "RR")]
    command = recorded("cmd.v", "/cmd_vel")
    for gap in ((1000, 1050), (1000, 1800)):
        steps = silent_steps("wheel.FR.v", recorded("wheel.FR.v", "/FR/speed", gap, stall), *others, command)
        assert_array_equal(steps, np.arange(steps[0], gap[1]))
        assert steps[0] <= 1002


def test_gap_of_a_topic_is_lost_data_where_others_lose_as_much() -> None:
    others = [recorded("wheel.FL.v", "/FL/speed", (300, 320)), recorded("cmd.v", "/cmd_vel", (600, 640))]
    assert silent_steps("wheel.FR.v", recorded("wheel.FR.v", "/FR/speed", (1000, 1030)), *others).size == 0
    for longer in ((1000, 1150), (1000, 1500)):
        steps = silent_steps("wheel.FR.v", recorded("wheel.FR.v", "/FR/speed", longer), *others)
        assert_array_equal(steps, np.arange(steps[0], longer[1]))


def test_only_drive_is_silent_beside_its_own_other_topics_alone() -> None:
    speed = recorded("wheel.M.v", "/speed", (1000, 1500))
    assert silent_steps("wheel.M.v", speed, recorded("cmd.v", "/cmd_vel")).size == 0
    assert silent_steps("wheel.M.v", speed, recorded("wheel.M.u", "/effort")).size > 490


def test_table_holds_quantities_that_came_apart() -> None:
    speeds = [recorded(f"wheel.{w}.v", None, (1000, 1030), nan=True) for w in ("FR", "FL")]
    valve = recorded("wheel.FR.u", None)
    assert silent_steps("wheel.FR.v", *speeds, valve).size == 0
    assert silent_steps("wheel.FR.v", speeds[0], recorded("wheel.FL.v", None), valve).size > 20


@pytest.mark.parametrize(
    ("name", "evidence"),
    campaign_of_rows([("mcap", "direct"), ("csv", "base"), ("mcap", "base"), ("twincat", "base")], 2),
)
def test_lost_bursts_are_no_signal_of_nothing(tmp_path: Path, name: str, evidence: EvidenceLevel) -> None:
    options = SimulationOptions(
        scenario="healthy",
        seed=11,
        duration_s=20.0,
        rate_hz=250.0,
        evidence=evidence,
        drop_share=0.03,
        drop_burst_s=0.06,
    )
    write_mission(simulate_mission(options), tmp_path / "log", name)
    report = diagnose([tmp_path / "log"], haulotte()).report
    assert [f for f in report["intervals"] if f["mode"] == "no_signal"] == []
    assert {s["state"] for s in report["states"]} >= {"healthy", "no_data"}


@pytest.mark.turns("silent")
@pytest.mark.parametrize("silent", ["drop", "nan"])
@pytest.mark.parametrize("name", [f for f in FORMATS if f != "parquet"])
def test_silent_sensor_is_found_in_every_format(tmp_path: Path, name: str, silent: Literal["drop", "nan"]) -> None:
    fault = FaultSpec("FR", Side.SENSOR, FaultMode.NO_SIGNAL, 6.0, 9.0, 1.0)
    options = SimulationOptions(
        scenario="healthy", seed=4, duration_s=14.0, rate_hz=100.0, evidence="base", faults=(fault,), silent=silent
    )
    write_mission(simulate_mission(options), tmp_path / "log", name)
    found = [f for f in diagnose([tmp_path / "log"], haulotte()).report["intervals"] if f["mode"] == "no_signal"]
    assert [(f["component"], f["side"]) for f in found] == [("FR", "sensor")]
    assert found[0]["start_s"] == pytest.approx(6.0, abs=0.05)
    assert found[0]["stop_s"] == pytest.approx(9.0, abs=0.05)
