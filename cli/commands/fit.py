"""`mfhca fit`: machine constants from healthy missions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.terminal.command import command
from cli.terminal.console import Terminal
from cli.terminal.inputs import check_output, find_logs, machine_of
from cli.terminal.options import Json, MachineFile
from replay.errors import ConfigError, LogError, NotJudged
from replay.progress import Stage

if TYPE_CHECKING:
    from rich.console import RenderableType

    from diagnosis.fitting.missions import FitResult

EXAMPLES = """\b
Examples:
  mfhca fit healthy.mcap                                   # look only
  mfhca fit healthy/*.bag -m base.toml -o machine.toml
  mfhca fit logs/healthy -m base.toml -o machine.toml --force --json"""


@command
def fit(
    terminal: Terminal,
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG...", help="Healthy missions of one machine: one log each; folders, globs.", show_default=False
        ),
    ],
    machine: MachineFile = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Machine file to write.", show_default="none: the table only"
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file where it exists.")] = False,
    json: Json = False,
) -> None:
    """Measure a machine's constants, with their uncertainty, from missions in which it was healthy."""
    found = find_logs(logs)
    if found.missing:
        raise LogError("; ".join(found.missing))
    if not found.paths:
        raise LogError(f"{', '.join(logs)}: no log was found")
    the_machine, source = machine_of(machine)
    if output is not None:
        check_output([output], found.paths)
        if output.exists() and not force:
            raise ConfigError(f"{output}: exists and is left as it is; give another name, or --force to replace it")
    with terminal.progress(Stage.STARTING) as progress:
        from diagnosis.fitting.document import fit_document, fit_toml
        from diagnosis.fitting.missions import fit_missions
        from replay.atomic_write import atomic_path
        from replay.mission import load_mission

        missions = [load_mission([path], the_machine, progress=progress) for path in found.paths]
        result = fit_missions(missions, the_machine, progress=progress)
    for error in result.unit_errors:
        terminal.note(f"unit error: {error.text}")
    if not json:
        terminal.show(*fit_parts(result))
    written = any(c.written for c in result.constants)
    if output is not None and written:
        with atomic_path(output) as temporary:
            temporary.write_text(fit_toml(result), encoding="utf-8")
    if json:
        shown = str(output) if output is not None and written else None
        terminal.show_json(fit_document(result) | {"source": source, "output": shown})
    if not written:
        raise NotJudged("no constant of the machine can be told from these missions, and nothing is written")
    if output is not None:
        terminal.show(f"Wrote {output}; use it with: mfhca diagnose LOG --machine {output}")


def fit_parts(result: FitResult) -> list[RenderableType]:
    """Tables and lists for the terminal."""
    from cli.tables.layout import bullets, section, table, text
    from diagnosis.fitting.document import number, remark, stated

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
