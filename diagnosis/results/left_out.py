"""What was left out of a mission is not damaged: it was read whole, and its signals are not used."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.results.document import ReportDocument
from replay.log.left_out import FileLeftOut


def is_left_out(text: str) -> bool:
    """Whether a sentence on a log's damage says no more than that a whole file was left out, and why."""
    return isinstance(text, FileLeftOut)


def by_its_clock(text: str) -> bool:
    """Whether a file was left out because its clock could not be compared with the others'."""
    return isinstance(text, FileLeftOut) and text.clock


def only_left_out(texts: Sequence[str]) -> bool:
    """Whether all of them do; not where there are none."""
    return bool(texts) and all(map(is_left_out, texts))


def lacks_files_alone(report: ReportDocument) -> bool:
    """Whether nothing is wrong with a mission's log but that files were left out; see `FileRow`."""
    files = report["log"]["files"]
    return any(f["damage"] for f in files) and all(set(f["damage"]) <= set(f.get("left_out", ())) for f in files)
