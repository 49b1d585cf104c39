"""Saved results by the words that name them: a report's folder, or its `report.json`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from replay.errors import LogError

if TYPE_CHECKING:
    from diagnosis.results.document import ReportDocument


def saved_report(path: Path) -> Path | None:
    """The report.json that a word names, None for a log."""
    if path.is_dir():
        return path / "report.json" if (path / "report.json").is_file() else None
    return path if path.suffix.lower() == ".json" else None


def result_file(path: Path) -> Path:
    """The report.json that a word names.

    Raises
    ------
    LogError
        Where there is none.
    """
    if not path.exists():
        raise LogError(f"{path}: no such file; give the folder of a report, or its report.json")
    saved = saved_report(path)
    if saved is None:
        what = "holds no report.json" if path.is_dir() else "is not a report.json"
        raise LogError(f"{path}: {what}; run `mfhca diagnose` on the log first, and give the folder that it writes")
    return saved


def previous_result(path: Path | None) -> ReportDocument | None:
    """Document of the result to compare with.

    Raises
    ------
    LogError
        Where it is no result.
    """
    if path is None:
        return None
    from diagnosis.output import load_report

    return load_report(result_file(path))
