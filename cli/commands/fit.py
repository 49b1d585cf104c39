"""`mfhca fit`: machine constants from healthy missions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.terminal.command import Quiet, Verbose, terminal_of
from cli.terminal.inputs import find_logs
from cli.terminal.options import Json, MachineFile
from diagnosis.api.inputs import check_output, machine_of
from replay.errors import ConfigError, LogError, NotJudged
from replay.progress import Stage

EXAMPLES = """\b
Examples:
  mfhca fit healthy.mcap                                   # shows the constants only
  mfhca fit healthy/*.bag -m base.toml -o machine.toml
  mfhca fit logs/healthy -m base.toml -o machine.toml --force --json"""


Missions = Annotated[
    list[str],
    typer.Argument(
        metavar="LOG...",
        help="Healthy missions of one machine; folders, globs. Tables that begin and end together are one mission.",
        show_default=False,
    ),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="FILE", help="Machine file to write.", show_default="no file, only the table"
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Replace the file where it exists.")]


def fit(
    context: typer.Context,
    logs: Missions,
    machine: MachineFile = None,
    output: Output = None,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Measure a machine's constants, with their uncertainty, from missions in which it was healthy."""
    terminal = terminal_of(context, json=json)
    found = find_logs(logs)
    if found.missing:
        raise LogError("; ".join(found.missing))
    if not found.paths:
        raise LogError(f"{', '.join(logs)}: no log was found")
    the_machine, source = machine_of(machine)
    if output is not None:
        check_output([output], found.paths)
        if output.exists() and not force:
            raise ConfigError(f"{output}: exists and was not changed; give another name, or --force to replace it")
    with terminal.progress(Stage.STARTING) as progress:
        from diagnosis.decision.assumed import assumed_words
        from diagnosis.fitting.document import fit_document, fit_toml
        from diagnosis.fitting.files import missions_of_files
        from diagnosis.fitting.missions import fit_missions
        from replay.atomic_write import atomic_path
        from replay.mission import load_mission

        groups = missions_of_files(found.paths)
        missions = [load_mission(files, the_machine, progress=progress) for files in groups]
        result = fit_missions(missions, the_machine, progress=progress)
    for files in groups:
        if len(files) > 1:
            terminal.note(f"one mission: {', '.join(str(f) for f in files)}")
    if assumed := assumed_words(the_machine):
        terminal.note(
            f"{'no machine file was given' if machine is None else f'{source} leaves out some numbers'}: of the paper's {the_machine.name}, "
            f"not known to be of this machine, are {'; '.join(assumed)}; constants and unit errors rest on them"
        )
    for error in result.unit_errors:
        terminal.note(f"unit error: {error.text}")
    if not json:
        from cli.tables.fit import fit_parts

        terminal.show(*fit_parts(result))
    written = any(c.written for c in result.constants)
    if output is not None and written:
        with atomic_path(output) as temporary:
            temporary.write_text(fit_toml(result), encoding="utf-8")
    if json:
        shown = str(output) if output is not None and written else None
        terminal.show_json(fit_document(result) | {"source": source, "output": shown})
    if not written:
        raise NotJudged("no constant of the machine can be identified from these missions; nothing is written")
    if output is not None:
        terminal.show(f"Wrote {output}; use it with: mfhca diagnose LOG --machine {output}")
