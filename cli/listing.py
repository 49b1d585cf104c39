"""One log's contents for `mfhca inspect`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from cli.tables import bullets, table, text

if TYPE_CHECKING:
    from rich.console import RenderableType

    from replay.rawlog import LogSummary


def summary_parts(summary: LogSummary) -> list[RenderableType]:
    """File, time, topics, damage and notes."""
    span = (summary.stop_ns - summary.start_ns) * 1e-9
    start = f", {np.datetime64(summary.start_ns, 'ms')} UTC, {span:.3f} s" if summary.stop_ns else ""
    parts: list[RenderableType] = [Text.assemble(text(summary.source, "bold"), text(f"  {summary.format}{start}"))]
    rows = [(t.name, t.type_name, f"{t.count}", text(t.note, "dim")) for t in summary.topics]
    parts.append(table(("topic", "type", "count", ""), rows, right=(2,)))
    if summary.damage:
        parts += [text("Damage", "bold red"), bullets(summary.damage)]
    if summary.notes:
        parts += [text("Notes", "bold"), bullets(summary.notes)]
    return parts
