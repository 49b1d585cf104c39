"""Tables and lines in one look; every text in them is shown as it is, never as markup."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.containers import Lines
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from cli.terminal.streams import clean

_UNIT = re.compile(r"(?<=\d) (?=(?:%|°|m/s|rad/s|rad|[km]?m|[mk]?Hz|ms|min|[shd]|MB)(?!\w))")
_JOINT = "\ue000"  # where no line is broken; of no log, for `clean` takes such characters out


class Sentence(Text):
    """Text of which no line ends between a number and its unit."""

    def wrap(self, console: Console, width: int, **options: Any) -> Lines:
        """Lines of a width [characters]; options as of `rich.text.Text.wrap`."""
        joined = self.copy()
        joined.plain = _UNIT.sub(_JOINT, self.plain)
        lines = joined.wrap(console, width, **options)
        for line in lines:
            line.plain = line.plain.replace(_JOINT, " ")
        return lines


def text(value: object, style: str = "") -> Text:
    """Text without control characters, styled as a whole."""
    return Sentence(clean(value), style=style)


def paragraph(value: object, style: str = "") -> Group:
    """The same to stand by itself: a console joins texts that follow each other to one that breaks lines anywhere."""
    return Group(text(value, style))


def table(headings: Sequence[str], rows: Iterable[Sequence[object]], right: Sequence[int] = ()) -> Table:
    """Plain table: headings dim, no lines; cells are text or `rich.text.Text`.

    Parameters
    ----------
    headings : Sequence[str]
        One per column.
    rows : Iterable[Sequence[object]]
        Cells.
    right : Sequence[int]
        Columns of numbers.
    """
    out = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim", show_edge=False)
    for i, heading in enumerate(headings):
        out.add_column(heading, justify="right" if i in right else "left", overflow="fold")
    for row in rows:
        out.add_row(*(cell if isinstance(cell, Text) else text(cell) for cell in row))
    return out


def whole_lines(lines: Iterable[Text]) -> Group:
    """Lines that are never broken: names in them can be searched and copied on terminals of any width."""
    out = []
    for line in lines:
        line.no_wrap, line.overflow = True, "ignore"
        out.append(line)
    return Group(*out)


class ByWidth:
    """The wide form where it fits on the terminal, else the narrow one."""

    def __init__(self, wide: RenderableType, narrow: RenderableType, needs: int) -> None:
        self._wide, self._narrow, self._needs = wide, narrow, needs

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield self._wide if options.max_width >= self._needs else self._narrow


def key_values(rows: Iterable[tuple[str, object]]) -> Table:
    """Two columns: what, and its value."""
    out = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    out.add_column(style="dim", no_wrap=True)
    out.add_column(overflow="fold")
    for key, value in rows:
        out.add_row(text(key), value if isinstance(value, Text) else text(value))
    return out


def bullets(lines: Iterable[object], style: str = "") -> Table:
    """Indented list."""
    out = Table.grid(padding=(0, 1, 0, 0))
    for line in lines:
        out.add_row(Text("•", style="dim"), line if isinstance(line, Text) else text(line, style))
    return out


def section(title: str) -> Padding:
    """Heading with a line of space before it."""
    return Padding(Text(title, style="bold"), (1, 0, 0, 0))
