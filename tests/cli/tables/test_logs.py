"""Files of a mission on the terminal: which were used, how their clocks were shifted, when it began."""

from __future__ import annotations

import io
from typing import Any

from rich.console import Console

from cli.tables.logs import log_parts
from tests.whole_documents import whole_report

CLOCK = {
    "reference": "", "method": "reference", "offset_s": None, "drift_ppm": None, "uncertainty_s": None, "signals": [],
    "overlap_s": None, "reason": "",
}  # fmt: skip


APART = "other.csv was left out: its clock could not be compared with drive.mcap: nothing in common"


def printed(*files: dict[str, Any], width: int = 200, quality: tuple[str, ...] = ()) -> list[str]:
    log = {"files": list(files), "start_ns": 1_760_000_000 * 10**9, "duration_s": 240.0, "driving_s": 230.5}
    report = whole_report(
        {
            "log": {**log, "open_loop": False},
            "machine": {"wheels": ["FR"]},
            "verdict": {"status": "ready", "title": "", "text": "", "caveats": [], "actions": []},
            "intervals": [],
            "quality": [{"check": "mapping", "result": text, "effect": "", "ok": False} for text in quality],
        }
    )
    console = Console(file=io.StringIO(), width=width, markup=False)
    for part in log_parts(report):
        console.print(part)
    assert isinstance(console.file, io.StringIO)
    return [line.rstrip() for line in console.file.getvalue().splitlines() if line.strip()]


def test_one_log() -> None:
    lines = printed({"path": "drive.mcap"})
    assert lines[0] == "Log"
    assert lines[1].startswith("from 2025-10-09 08:53:20 UTC")
    assert lines[1].endswith("on, 240 s, 230 s of driving")
    assert lines[2] == "• drive.mcap  (mcap)"


def test_clocks_of_several_logs() -> None:
    moved = {**CLOCK, "method": "estimated", "reference": "drive.mcap", "offset_s": -0.31904, "drift_ppm": 50.02}
    lines = printed(
        {"path": "drive.mcap", "clock": None, "damage": ["drive.mcap ends without a footer"]},
        {"path": "plc.csv", "format": "csv", "clock": {**moved, "uncertainty_s": 0.00003}},
        {
            "path": "twin.csv",
            "format": "csv",
            "clock": {**moved, "method": "given", "offset_s": 7200.0, "drift_ppm": 0.0},
        },
        {"path": "same.csv", "format": "csv", "clock": {**CLOCK, "method": "common"}},
        {
            "path": "other.csv",
            "format": "csv",
            "clock": {**CLOCK, "method": "as recorded", "reason": "nothing in common"},
            "damage": [APART],
            "left_out": [APART],
        },
    )
    assert lines[2:] == [
        "• drive.mcap  (mcap, damaged) its clock is the mission's",
        "• plc.csv  (csv) clock shifted by -319 ms and +50.0 ppm onto the clock of drive.mcap, 95 % within ±0.03 ms",
        "• twin.csv  (csv) clock shifted by +7200.0 s as the machine file says",
        "• same.csv  (csv) shares the mission's clock",
        "• other.csv  (csv) not used: its clock could not be compared",
    ]


def test_a_result_without_logs_says_nothing() -> None:
    assert printed() == []


def test_channels_whose_names_leave_something_open_are_named() -> None:
    text = "not used, for their names leave open what they hold: fVentil_Soll_FR [mA] (wheel.FR.u)"
    lines = printed({"path": "drive.csv"}, quality=(text, "clocks agree"))
    assert lines[-1] == f"• {text}"
