"""Parts of one table are read as one; what only looks like parts is not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from replay.errors import LogError
from replay.log.joined_tables import joined_tables
from replay.log.source_options import SourceOptions
from replay.machine.config import haulotte
from replay.mission import load_mission
from replay.readers.registry import read_log


def table() -> pd.DataFrame:
    v = np.repeat(np.random.default_rng(1).uniform(-0.3, 0.3, 15), 40)
    columns: dict[str, Any] = {"time": np.arange(600) * 0.05}
    for name in ("fr", "fl", "rr", "rl"):
        columns |= {f"speed_{name} [m/s]": v, f"speed_{name}_setpoint [m/s]": v}
    return pd.DataFrame(columns)


def write(frame: pd.DataFrame, path: Path) -> Path:
    frame.to_csv(path, index=False)
    return path


def test_parts_give_the_mission_of_the_whole_table_in_any_order(tmp_path: Path) -> None:
    whole = table()
    parts = [write(whole[200 * i : 200 * (i + 1)], tmp_path / f"part{i}.csv") for i in range(3)]
    expected = load_mission([write(whole, tmp_path / "whole.csv")], haulotte())
    for given in (parts, [parts[2], parts[0], parts[1]]):
        mission = load_mission(given, haulotte())
        axes = [(m.timeline.start_ns, m.timeline.step_ns, m.timeline.size) for m in (mission, expected)]
        assert axes[0] == axes[1]
        for name, signal in expected.signals.items.items():
            np.testing.assert_array_equal(mission.signals.items[name].values, signal.values)
        assert [f.path for f in mission.files] == given
        assert [f.joined for f in mission.files] == [f.path != parts[0] for f in mission.files]
        assert sum("read as a part of that" in n for f in mission.files for n in f.summary.notes) == 2


def test_what_begins_anew_overlaps_or_comes_later_is_no_part(tmp_path: Path) -> None:
    whole = table()
    first = whole[:200]
    others = {
        "anew": first,
        "overlapping": whole[150:400],
        "later": whole[200:400].assign(time=lambda t: t["time"] + 6.0),
        "different": whole[200:400].rename(columns={"speed_fl [m/s]": "speed_fl"}),
    }
    head = read_log(write(first, tmp_path / "first.csv"), SourceOptions())
    for name, frame in others.items():
        other = read_log(write(frame, tmp_path / f"{name}.csv"), SourceOptions())
        assert joined_tables([head, other]) == [head, other], name


def test_the_same_table_twice_is_refused(tmp_path: Path) -> None:
    paths = [write(table(), tmp_path / f"{name}.csv") for name in ("a", "b")]
    with pytest.raises(LogError, match="none of its channels is used"):
        load_mission(paths, haulotte())
