"""What the report says of the clocks of several files."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.decision.quality import Recorded, checks, clock_row, recorded
from diagnosis.results.machine_words import HYDRAULIC
from replay.clocks.source_clock import SourceClock
from replay.log.source_options import SignalSource
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline

LINE = Timeline(0, 1_000_000, 2, {"wheel.FR.v": np.zeros(2)}, {}, {}, {})
MOVED = SourceClock("logs/plc.csv", "logs/drive.mcap", "estimated", 0.319, 50.0, 4e-4, ("wheel.FR.v",), 120.0)
ALONE = SourceClock("logs/plc.csv", "logs/drive.mcap", "as recorded", reason="no signal is in both")
FIRST = SourceClock("logs/drive.mcap", "", "reference")


def rows(*clocks: SourceClock) -> list[dict[str, object]]:
    told = tuple(c.sentence for c in clocks if c.sentence)
    return [
        r
        for r in checks(Signals({}, {}, told), Recorded((), 0.0, 0), LINE, (), (), {}, None, HYDRAULIC, clocks)
        if told and r["result"] in told
    ]


@pytest.mark.parametrize(
    ("clock", "ok", "effect"),
    [(MOVED, True, "±0.4 ms (95 %)"), (ALONE, False, "its signals are not used")],
)
def test_clocks_are_told_once_with_their_effect(clock: SourceClock, ok: bool, effect: str) -> None:
    (row,) = rows(FIRST, clock)
    assert (row["check"], row["ok"]) == ("Clock", ok)
    assert effect in str(row["effect"])


def test_clock_in_the_report_names_no_folder() -> None:
    found = clock_row(MOVED)
    assert found is not None
    assert (found["reference"], found["method"], found["offset_s"]) == ("drive.mcap", "estimated", 0.319)
    assert clock_row(FIRST) is None
    assert clock_row(None) is None


def test_samples_without_a_number_are_a_gap() -> None:
    stamps = np.arange(1000, dtype=np.int64) * 10_000_000
    values = np.ones(1000)
    values[300:500] = np.nan
    signal = Signal("wheel.FR.v", stamps, values, SignalSource(column="v"), "a.csv", False)
    line = Timeline(0, 10_000_000, 2, {"wheel.FR.v": np.zeros(2)}, {}, {}, {"wheel.FR.v": 10_000_000})
    signals = Signals({"wheel.FR.v": signal}, {})
    told = recorded(signals, line, HYDRAULIC)
    (row,) = [r for r in checks(signals, told, line, (), (), {}, None, HYDRAULIC) if r["check"] == "Gaps"]
    assert row["ok"] is False
    assert "longest 2.01 s" in str(row["result"])


def test_notes_have_minus_signs() -> None:
    told = recorded(Signals({}, {}), LINE, HYDRAULIC)
    found = checks(
        Signals({}, {}, ("u reads -0.02 at rest, as a-1.csv has it",)), told, LINE, (), (), {}, None, HYDRAULIC
    )
    assert "u reads −0.02 at rest, as a-1.csv has it" in [r["result"] for r in found]
