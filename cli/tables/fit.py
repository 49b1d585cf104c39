"""Constants of a machine as tables of the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.tables.layout import bullets, section, table, text
from diagnosis.fitting.document import number, remark, stated

if TYPE_CHECKING:
    from rich.console import RenderableType

    from diagnosis.fitting.missions import FitResult


def fit_parts(result: FitResult) -> list[RenderableType]:
    """Tables and lists for the terminal."""
    rows = [
        (
            c.key,
            text(stated(c), "" if c.written else "dim"),
            c.unit,
            number(c.before),
            c.windows or "–",
            c.missions,
            text(remark(c), "dim"),
        )
        for c in result.constants
        if not c.key.startswith("noise.")
    ]
    pairs = zip(
        (c for c in result.constants if c.key.endswith(".std")),
        (c for c in result.constants if c.key.endswith(".lsb")),
        strict=True,
    )
    noise = [
        (std.key.removesuffix(".std"), stated(std), number(lsb.value), std.missions, text(remark(std), "dim"))
        for std, lsb in pairs
    ]
    count = len(result.missions)
    title = (
        f"{count} mission{'' if count == 1 else 's'}, {result.seconds:.0f} s, {result.driving:.0f} s of them driving"
    )
    parts: list[RenderableType] = [
        section(title),
        table(("constant", "value", "unit", "was", "windows", "missions", ""), rows, right=(3, 4, 5)),
        "",
        table(("channel, SI units", "std", "lsb", "missions", ""), noise, right=(3,)),
    ]
    if result.unit_errors:
        parts += [section("Wrong units: these constants are not written"), bullets(e.text for e in result.unit_errors)]
    if result.left_out:
        parts += [section("Left out"), bullets(result.left_out)]
    if result.notes:
        parts += [section("Notes"), bullets(result.notes)]
    return parts
