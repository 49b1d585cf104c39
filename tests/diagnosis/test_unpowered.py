"""A truck whose rear wheels have no drive: nothing of a drive is asked of them, and their speed sensors are judged."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.clearing.forecast import forecast
from diagnosis.decision.quality import missing_rows
from diagnosis.pipeline import diagnose, diagnose_mission
from diagnosis.report.machine_picture import machine_picture
from diagnosis.report.timeline import timeline
from diagnosis.results.document import ReportDocument
from diagnosis.results.machine_words import machine_words
from replay.control.loop import replay_loop
from replay.control.loop_columns import replay_columns
from replay.errors import ConfigError
from replay.faults import FaultMode, FaultSpec, Side
from replay.injection.checks import InjectionOptions, check_faults
from replay.machine.config import haulotte
from replay.mission import Mission
from tests.diagnosis.test_pipeline import in_memory, simulated

TRUCK = replace(haulotte(), unpowered=("RR", "RL"))
#: All signals but those of the rear wheels' drives.
KEPT = r"^(?!wheel\.R[RL]\.(u|u_applied|psi|pressure_a|pressure_b|effort)$)"


@cache
def mission() -> Mission:
    return in_memory(simulated("direct", (), 60.0), keep=KEPT)


@cache
def judged(*, declared: bool = True, gain: float = 1.0) -> ReportDocument:
    one = mission()
    if gain != 1.0:
        items, line = dict(one.signals.items), one.timeline
        speed = items["wheel.RR.v"]
        scaled = np.where(np.arange(speed.values.size) < speed.values.size // 2, speed.values, gain * speed.values)
        items["wheel.RR.v"] = replace(speed, values=scaled)
        half = np.arange(line.size) < line.size // 2
        y = line.signals["wheel.RR.v"]
        line = replace(line, signals={**line.signals, "wheel.RR.v": np.where(half, y, gain * y)})
        one = replace(one, signals=replace(one.signals, items=items), timeline=line)
    return diagnose_mission(one, TRUCK if declared else haulotte()).report


def test_it_is_ready_where_its_drives_would_be_missed() -> None:
    assert not judged(declared=False)["verdict"]["cleared"]
    verdict = judged()["verdict"]
    assert verdict["status"] == "ready"
    assert (
        "of every wheel with a drive, and the speed sensors of RR and RL, which have none, were judged healthy"
        in (verdict["text"])
    )
    assert judged()["machine"]["unpowered"] == ["RR", "RL"]


def test_nothing_is_said_of_a_drive_that_is_not_there() -> None:
    report = judged()
    sides = {(row["component"], row["side"]) for row in report["coverage"]}
    assert ("RR", "sensor") in sides
    assert not sides & {("RR", "actuator"), ("RL", "actuator")}
    assert all(row["component"] not in ("RR", "RL") or row["side"] == "sensor" for row in report["clearing"])
    lanes = timeline(report, 60.0)
    assert [(x.component, x.side) for x in (*lanes.lanes, *lanes.quiet) if x.component == "RR"] == [("RR", "sensor")]
    assert str(machine_picture(report)).count("free wheel, without a drive") == 4  # a title and a label of each
    columns = replay_columns(mission().timeline, replay_loop(mission().timeline, TRUCK), TRUCK, detail=True)
    assert {n for n in columns if n.startswith("replay.RR.")} == {"replay.RR.v_ref", "replay.RR.e", "replay.RR.phi"}


def test_a_fault_of_its_sensor_is_found() -> None:
    report = judged(gain=0.6)
    assert {(i["component"], i["side"], i["mode"]) for i in report["intervals"]} == {("RR", "sensor", "inefficient")}
    assert report["verdict"]["status"] == "watch"


def test_no_signal_of_a_drive_is_missed() -> None:
    words = machine_words(TRUCK, mission().signals.items)
    missed = {row["name"] for row in missing_rows(mission().signals, TRUCK, words)}
    assert not any(n.startswith("wheel.RR.") and n.rpartition(".")[2] in ("u", "u_applied") for n in missed)


@pytest.mark.parametrize(
    ("logged", "told", "words"),
    [
        ({"cmd.v", "wheel.RR.v", "wheel.RL.v"}, True, "the commanded speed or from the other wheels; it has no drive"),
        ({"wheel.RR.v", "wheel.RL.v"}, False, "no command is logged"),
        ({"wheel.RR.v", "wheel.RR.v_true"}, True, "against its second measurement"),
        ({"cmd.v"}, False, "no speed is logged"),
    ],
)
def test_what_can_be_told_of_it(logged: set[str], told: bool, words: str) -> None:
    found = [f for f in forecast(logged, TRUCK, machine_words(TRUCK)) if "RR" in f.components]
    assert [f.side for f in found] == [Side.SENSOR]
    assert found[0].told is told
    assert words in found[0].words


def test_no_fault_of_its_drive_can_be_injected() -> None:
    fault = FaultSpec("RR", Side.ACTUATOR, FaultMode.NO_SIGNAL, 5.0, 8.0)
    with pytest.raises(ConfigError, match="RR: it has no drive"):
        check_faults([fault], TRUCK, mission().signals, 60.0, InjectionOptions())


@pytest.mark.parametrize(("moves", "cleared"), [(True, False), (False, True)])
def test_a_drive_that_is_in_the_log_all_the_same_keeps_the_machine_in(
    tmp_path: Path, moves: bool, cleared: bool
) -> None:
    one = simulated("direct", (), 40.0, 100.0)
    kept = {n: x for n, x in one.columns.items() if re.search(KEPT, n) or n == "wheel.RR.u"}
    if not moves:  # a controller that logs four channels, and uses two
        kept["wheel.RR.u"] = np.zeros(one.stamps.size)
    pd.DataFrame({"time": (one.stamps - one.stamps[0]) * 1e-9, **kept}).to_csv(tmp_path / "a.csv", index=False)
    verdict = diagnose([tmp_path / "a.csv"], TRUCK).report["verdict"]
    assert verdict["cleared"] is cleared
    assert moves is ("RR by machine.unpowered has no drive, and the log has" in verdict["text"])
