"""Every channel of a log, for the terminal and as JSON."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import PurePath

from rich.console import RenderableType
from rich.text import Text

from cli.tables.layout import text, whole_lines
from replay.machine.config import Machine
from replay.setup.all_channels import ChannelRow
from replay.setup.ranges import range_text

_LONG_ARRAY = 4
_NARROW, _WIDE = 25, 44  # characters of a field that share a line with the rest, on terminals of 80 and of 120 columns


def channels_document(rows: Sequence[ChannelRow], machine: Machine | None, source: str) -> dict[str, object]:
    """All channels as JSON values."""
    known = None if machine is None else {"name": machine.name, "source": source, "wheels": list(machine.wheels)}
    return {"machine": known, "channels": [asdict(row) for row in rows]}


def channels_parts(rows: Sequence[ChannelRow], machine: Machine | None, width: int) -> list[RenderableType]:
    """A heading for each topic or table, and a line or two for each of its channels."""
    whose = (
        text("No wheels were found in the names; the machine's signals need a machine file.", "bold")
        if machine is None
        else text(f"Could be: signals of a machine with the wheels {', '.join(machine.wheels)}.", "dim")
    )
    lines = list(_lines(rows, _WIDE if width >= 110 else _NARROW))
    count = f"{len(rows)} channels."
    return [whole_lines(lines), "", text(count, "dim"), whose]


def _lines(rows: Sequence[ChannelRow], field: int) -> Iterator[Text]:
    heading = ""
    for row in _folded(rows):
        place = row.topic or PurePath(row.source).name
        if place != heading:
            rate = f"  {row.rate_hz:.4g} Hz" if row.rate_hz else ""
            kind = row.type_name.rpartition("/")[2] if row.topic else ""
            yield Text.assemble("\n" if heading else "", text(place, "bold"), text(f"  {kind}{rate}", "dim"))
            heading = place
        yield from _row(row, field)


def _folded(rows: Sequence[ChannelRow]) -> Iterator[ChannelRow]:
    """Elements of arrays without names, such as covariances, in one row for each array."""
    place, run = "", list[ChannelRow]()
    for row in rows:
        found = re.fullmatch(r"(.*)\[\d+\]([^\[\]]*)", row.field)
        own = "" if found is None or row.could_be else f"{row.topic} {found[1]}[]{found[2]}"
        if run and own != place:
            yield from _joined(run)
            run = []
        if not own:
            yield row
            continue
        place = own
        run.append(row)
    yield from _joined(run)


def _joined(run: Sequence[ChannelRow]) -> Iterator[ChannelRow]:
    if len(run) < _LONG_ARRAY:
        yield from run
        return
    numbers = [n for r in run for n in (r.low, r.high) if n is not None]
    span = (min(numbers), max(numbers)) if numbers else (None, None)
    yield replace(
        run[0], field=re.sub(r"\[\d+\]", f"[0…{len(run) - 1}]", run[0].field, count=1), low=span[0], high=span[1]
    )


def _row(row: ChannelRow, field: int) -> Iterator[Text]:
    """The channel's whole name, then range, unit and signals, below it where it is long."""
    name = f"  {row.field if row.topic else row.name}"
    unit = f"{row.unit}{'?' if row.guessed and row.unit else ''}" or "–"
    span = "no number" if row.low is None or row.high is None else range_text(row.low, row.high, 4)
    could = ", ".join(row.could_be)
    rest = f"{span:<21}  {unit:<5}  {could}".rstrip()
    if len(name) <= field + 2:
        yield text(f"{name:<{field + 2}}  {rest}")
        return
    yield text(name)
    yield text(f"{'':<{field + 2}}  {rest}")
