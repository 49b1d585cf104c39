"""Which files a verdict rests on, when they were recorded, and how their clocks were put onto one."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import RenderableType
from rich.text import Text

from cli.tables.layout import bullets, section, text
from cli.terminal.dates import shown_moment
from diagnosis.results.document import ReportDocument
from diagnosis.results.log_rows import ClockRow, FileRow
from replay.signals.unsure_names import NOT_USED


def log_parts(report: ReportDocument) -> list[RenderableType]:
    """Files of a mission with their clocks, and its begin in UTC and local time."""
    log = report["log"]
    files = log["files"]
    if not files:
        return []
    when = f"from {shown_moment(log['start_ns'])} on, {log['duration_s']:.0f} s, {log['driving_s']:.0f} s of driving"
    lines = [_line(file, files) for file in files]
    lines += [text(row["result"], "yellow") for row in report["quality"] if row["result"].startswith(NOT_USED)]
    return [section("Log" if len(files) == 1 else "Logs"), text(when, "dim"), bullets(lines)]


def _line(file: FileRow, files: Sequence[FileRow]) -> Text:
    gone = file.get("left_out", [])
    damaged = any(damage not in gone for damage in file["damage"])
    words = [f"({file['format']}{', damaged' if damaged else ''})"]
    unused = next((note for note in file["notes"] if note.startswith("none of its channels")), "")
    if unused:
        words.append(unused)
    elif gone:
        words.append("not used: its clock could not be compared" if file["clock"] else "not used")
    elif len(files) > 1 or (file["clock"] is not None and file["clock"]["method"] != "reference"):
        words.append(_clock(file["clock"]))
    return Text.assemble(text(file["path"]), "  ", text(" ".join(filter(None, words)), "yellow" if gone else "dim"))


def _clock(clock: ClockRow | None) -> str:
    if clock is None:  # of the file that the others were put onto
        return "its clock is the mission's"
    method, offset = clock["method"], clock["offset_s"]
    if method == "reference":
        return "its clock is the mission's"
    if method in ("estimated", "given") and offset is not None:
        bound = f", 95 % within ±{_time(clock['uncertainty_s'])}" if clock["uncertainty_s"] is not None else ""
        how = (
            "as the machine file says"
            if method == "given"
            else f"onto the clock of {clock['reference'] or 'the first'}"
        )
        drift = f" and {clock['drift_ppm']:+.1f} ppm" if clock["drift_ppm"] else ""
        return f"clock shifted by {_time(offset, sign=True)}{drift} {how}{bound}"
    return "shares the mission's clock" if method == "common" else "stamps as recorded"


def _time(seconds: float, *, sign: bool = False) -> str:
    """Time in s or ms, whichever reads better."""
    value, unit = (seconds, "s") if abs(seconds) >= 1 else (seconds * 1e3, "ms")
    digits = ".1f" if abs(value) >= 1000 else ".3g"
    return f"{value:{'+' if sign else ''}{digits}} {unit}"
