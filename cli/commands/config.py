"""`mfhca config`: machine files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.commands.config_init import run_init
from cli.terminal.command import App, Quiet, Verbose, terminal_of
from cli.terminal.options import Json, MachineFile
from diagnosis.api.inputs import machine_of, mission_paths
from replay.errors import ConfigError
from replay.progress import Stage
from replay.setup.preset import Preset

app = typer.Typer(
    cls=App,
    rich_markup_mode=None,
    help="Write, check and show machine files.",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  mfhca config init --log mission.mcap -o machine.toml     # filled in from a log
  mfhca config init -o machine.toml                        # every key, explained
  mfhca config check machine.toml --log mission.mcap
  mfhca config show -m machine.toml""",
)


def init(
    context: typer.Context,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="File to write; - is standard output.",
            show_default="standard output",
        ),
    ] = None,
    log: Annotated[
        list[Path] | None,
        typer.Option(
            "--log",
            metavar="LOG",
            help="Fill it in from this log; may be given again for the files of one mission.",
            show_default=False,
        ),
    ] = None,
    preset: Annotated[
        Preset | None, typer.Option("--preset", help="Kind of machine. Default: found in the log.", show_default=False)
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write a machine file: from a log, or a commented starter with every key, its unit and default."""
    run_init(terminal_of(context), output, log or [], preset)


def check(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Machine file.", show_default=False)],
    log: Annotated[
        list[Path] | None,
        typer.Option("--log", metavar="LOG", help="Also find its signals in this log.", show_default=False),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Check a machine file; with --log also that every signal it names is there."""
    terminal = terminal_of(context, json=json)
    machine, source = machine_of(file)
    lost: list[str] = []
    asked: tuple[str, ...] = ()
    document: dict[str, object] = {"file": str(file), "ok": True, "given_signals": sorted(machine.signals)}
    if log:
        with terminal.progress(Stage.STARTING) as progress:
            from cli.tables.signals import signals_document, signals_parts
            from replay.mission import read_signals

            files, signals = read_signals(mission_paths(log), machine, progress=progress)
        lost = [f"{name}: {signals.missing[name]}" for name in machine.signals if name in signals.missing]
        asked = signals.questions
        document |= {"ok": not (lost or asked), "signals": signals_document(files, signals, machine, source)}
        if not json:
            terminal.show(*signals_parts(signals, machine))
    if json:
        terminal.show_json(document)
    if lost:
        raise ConfigError(f"{file}: {len(lost)} of its signals are not in the log: {'; '.join(lost)}")
    if asked:
        raise ConfigError(f"{file}: values of the log that cannot be with these units: {'; '.join(asked)}")
    count = len(machine.signals)
    still = sum(line.startswith("# QUESTION: ") for line in file.read_text(encoding="utf-8").splitlines())
    open_ = f" {still} of its comments are questions; remove each when it is answered." if still else ""
    terminal.show(f"{file}: valid. {machine.name}, wheels {', '.join(machine.wheels)}, {count} signals given.{open_}")


def show(context: typer.Context, machine: MachineFile = None, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Show all settings in use, as a machine file."""
    from replay.machine.toml_text import dump_machine

    the_machine, source = machine_of(machine)
    terminal_of(context).show_text(f"# {source}\n{dump_machine(the_machine)}")


for _function, _example in (
    (init, "mfhca config init --log mission.mcap -o machine.toml"),
    (check, "mfhca config check machine.toml --log mission.mcap"),
    (show, "mfhca config show -m machine.toml > full.toml"),
):
    app.command(epilog=f"\b\nExample:\n  {_example}")(_function)
