"""One log's contents and timing for `mfhca inspect`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from rich.text import Text

from cli.tables import bullets, table, text

if TYPE_CHECKING:
    from rich.console import RenderableType

    from replay.inspect import InspectReport, TopicTiming


def inspect_document(report: InspectReport) -> dict[str, Any]:
    """Everything as JSON values."""
    from diagnosis.result import to_json

    document: dict[str, Any] = to_json(report)
    return document | {"duration_s": report.duration_s}


def inspect_parts(report: InspectReport) -> list[RenderableType]:
    """File and time; a line per topic; what is unusual; damage and notes."""
    when = "no stamps"
    if report.stop_ns:
        start = np.datetime64(report.start_ns, "ns").astype("M8[ms]")
        when = f"{str(start).replace('T', ' ')} UTC, {report.duration_s:.3f} s"
    parts: list[RenderableType] = [
        Text.assemble(text(report.source, "bold"), "  ", text(report.format), ", ", text(when))
    ]
    headings = ("topic", "type", "count", "Hz", "jitter ms", "gaps", "header−log ms")
    rows = [_row(t) for t in report.topics]
    parts.append(table(headings, rows, right=(2, 3, 4, 5, 6)) if rows else text("It holds no topics."))
    unusual = [f"{t.name}: {words}" for t in report.topics if (words := _unusual(t))]
    for title, lines, style in (
        ("Unusual", unusual, "bold"),
        ("Damage", report.damage, "bold red"),
        ("Notes", report.notes, "bold"),
    ):
        if lines:
            parts += [text(title, style), bullets(lines)]
    return parts


def _row(topic: TopicTiming) -> tuple[object, ...]:
    return (
        topic.name,
        text(topic.type_name.rpartition("/")[2], "dim"),
        topic.count,
        "–" if topic.rate_hz is None else f"{topic.rate_hz:.5g}",
        "–" if topic.jitter_p99_s is None else f"{topic.jitter_p99_s * 1e3:.2g}",
        topic.gaps or "–",
        "–" if topic.offset_s is None else f"{topic.offset_s * 1e3:.3g}",
    )


def _unusual(topic: TopicTiming) -> str:
    """What a user should know about a topic's stamps, or why it was not decoded."""
    words = []
    if topic.note:
        words.append(topic.note)
    if topic.gaps and topic.longest_gap_s is not None:
        words.append(f"{topic.gaps} gap{'' if topic.gaps == 1 else 's'}, longest {topic.longest_gap_s:.3g} s")
    if topic.backwards:
        words.append("1 stamp goes back" if topic.backwards == 1 else f"{topic.backwards} stamps go back")
    if topic.duplicates:
        some = "1 stamp repeats" if topic.duplicates == 1 else f"{topic.duplicates} stamps repeat"
        words.append(f"{some} the one before")
    return "; ".join(words)
