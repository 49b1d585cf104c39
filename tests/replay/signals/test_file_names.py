"""Wheels that have a table each."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.machine.config import haulotte
from replay.readers.registry import read_log
from replay.setup.draft import draft_machine
from replay.signals.file_names import named_channels
from replay.signals.mapping import map_signals


def tables(folder: Path, *names: str, columns: str = "set_speed_mps,act_speed_mps,valve_pct") -> list[RawLog]:
    for k, name in enumerate(names):
        rows = "".join(f"{i * 0.1:.1f},{k},{k + 0.5},{10 * k}\n" for i in range(30))
        (folder / name).write_text(f"t,{columns}\n{rows}")
    return [read_log(folder / name, SourceOptions()) for name in names]


def test_the_file_says_which_wheel_it_is(tmp_path: Path) -> None:
    logs = tables(tmp_path, "wheel_FL.csv", "wheel_FR.csv", "wheel_RL.csv", "wheel_RR.csv")
    found = map_signals(logs, haulotte())
    for k, wheel in enumerate(("FL", "FR", "RL", "RR")):
        speed = found.items[f"wheel.{wheel}.v"]
        assert (speed.origin.column, speed.origin.source) == ("act_speed_mps", f"wheel_{wheel}.csv")
        np.testing.assert_allclose(speed.values, k + 0.5)
        np.testing.assert_allclose(found.items[f"wheel.{wheel}.v_ref"].values, k)
        np.testing.assert_allclose(found.items[f"wheel.{wheel}.u"].values, k / 10)


def test_a_machine_file_names_each_wheel_s_table(tmp_path: Path) -> None:
    logs = tables(tmp_path, "VL.csv", "VR.csv", "HL.csv", "HR.csv")
    machine = draft_machine(logs).machine
    assert set(machine.wheels) == {"VL", "VR", "HL", "HR"}
    assert machine.signals["wheel.HR.v"].source == "HR.csv"
    np.testing.assert_allclose(map_signals(logs, machine).items["wheel.HR.v"].values, 3.5)


def test_other_tables_keep_the_names_of_their_columns(tmp_path: Path) -> None:
    logs = tables(tmp_path, "drive_left.csv", "pump.csv")
    assert "drive_left.act_speed_mps" in named_channels(logs)[0]
    assert named_channels(logs)[1] is logs[1].channels  # no place in its name
    (alone,) = named_channels(logs[:1])
    assert alone is logs[0].channels  # nothing to tell apart
