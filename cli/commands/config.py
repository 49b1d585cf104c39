"""`mfhca config`: machine files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.commands.config_init import run_init
from cli.terminal.command import App, Quiet, Verbose, terminal_of
from cli.terminal.options import Json, MachineFile
from diagnosis.api.inputs import machine_of, mission_paths
from replay.errors import ConfigError
from replay.machine.questions import open_questions
from replay.machine.unpowered import is_contradicted
from replay.progress import Stage
from replay.setup.preset import Preset
from replay.signals.unit_conflicts import unit_conflict

if TYPE_CHECKING:
    from replay.machine.config import Machine
    from replay.signals.signal import Signals

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
    force: Annotated[bool, typer.Option("--force", help="Replace the file where it exists.")] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write a machine file: from a log, or a commented starter with every key, its unit and default."""
    run_init(terminal_of(context), output, log or [], preset, force=force)


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
    asked, against, doubts, doubted = "", tuple[str, ...](), tuple[str, ...](), False
    document: dict[str, object] = {"file": str(file), "ok": True, "given_signals": sorted(machine.signals)}
    if log:
        with terminal.progress(Stage.STARTING) as progress:
            from cli.tables.signals import signals_document, signals_parts
            from replay.mission import first_question, read_signals

            files, signals = read_signals(mission_paths(log), machine, progress=progress)
        lost = [f"{name}: {signals.missing[name]}" for name in machine.signals if name in signals.missing]
        asked = first_question(signals) if signals.questions else ""
        if not asked:
            against, doubts, doubted = _contradictions(signals, machine)
            against = (*against, *(note for note in signals.notes if is_contradicted(note)))
        document |= {
            "ok": not (lost or asked or against),
            "signals": signals_document(files, signals, machine, source),
            "contradicted": list(against),
            "doubts": list(doubts),
        }
        if not json:
            terminal.show(*signals_parts(signals, machine, doubted=doubted))
    if json:
        terminal.show_json(document)
    if lost:
        raise ConfigError(f"{file}: {len(lost)} of its signals are not in the log: {'; '.join(lost)}")
    if asked:
        raise ConfigError(f"{file}: values of the log that cannot be with these units: {asked}")
    if against:
        raise ConfigError(f"{file}: the log contradicts it: {'; '.join(against)}")
    if conflict := unit_conflict(machine.signals):
        doubts = (*doubts, conflict)
    for doubt in doubts:
        terminal.note(f"to be checked: {doubt}")
    count = len(machine.signals)
    still = open_questions(file)
    open_ = _still_asked(still)
    parts = f"{machine.part}s {', '.join(machine.wheels)}{_free(machine)}"
    terminal.show(f"{file}: valid. {machine.name}, {parts}, {count} signals given.{open_}")


def _free(machine: Machine) -> str:
    """Which of the wheels have no drive, in brackets; empty where all have one."""
    return f" ({', '.join(machine.unpowered)} without a drive)" if machine.unpowered else ""


def _still_asked(questions: int) -> str:
    """How many of a machine file's comments are questions, a sentence after others; empty where none is."""
    if not questions:
        return ""
    if questions == 1:
        return " One of its comments is a question; remove it when it is answered."
    return f" {questions} of its comments are questions; remove each when it is answered."


def _contradictions(signals: Signals, machine: Machine) -> tuple[tuple[str, ...], tuple[str, ...], bool]:
    """What turns contradict of the places of wheels and axles, doubts about sizes and units, and whether the openings' unit is one."""
    from diagnosis.response.body import witnesses_of
    from diagnosis.results.machine_words import machine_words
    from replay.setup.body_scale import scale_doubts
    from replay.setup.places import place_doubts
    from replay.setup.turn_sizes import turn_size_doubt
    from replay.signals.opening_doubts import opening_doubt
    from replay.signals.speed_doubts import speed_doubt
    from replay.signals.timeline import align

    wheels = {n: s for w in machine.wheels if (s := signals.items.get(n := f"wheel.{w}.v")) is not None}
    if not any(len(s.stamps) > 1 for s in wheels.values()):
        return (), (), False
    line = align(signals)
    openings = opening_doubt(line, signals.items, machine)
    words = machine_words(machine, signals.items)
    of_openings = () if openings is None else (words.fill(f"{openings.text}; {openings.act}"),)
    speeds = speed_doubt(line, signals.items, machine, lambda: witnesses_of(line))
    of_speeds = () if speeds is None else (f"{speeds.text.partition(':')[0]}; {speeds.act}",)
    doubts = (*of_openings, *of_speeds, *scale_doubts(line, machine, wheels))
    against = place_doubts(line, machine)
    size = turn_size_doubt(line, machine) if not against else ""
    return against, (*doubts, size) if size else doubts, openings is not None


def show(context: typer.Context, machine: MachineFile = None, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Show all settings in use, as a machine file."""
    from replay.machine.toml_text import dump_machine

    the_machine, source = machine_of(machine)
    terminal_of(context).show_file(f"# {source}\n{dump_machine(the_machine)}")


for _function, _example in (
    (init, "mfhca config init --log mission.mcap -o machine.toml"),
    (check, "mfhca config check machine.toml --log mission.mcap"),
    (show, "mfhca config show -m machine.toml > full.toml"),
):
    app.command(epilog=f"\b\nExample:\n  {_example}")(_function)
