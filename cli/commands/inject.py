"""`mfhca inject`: known faults in a recorded log, to measure the diagnosis on one's own machine."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.commands.simulate import LogFormat, format_of
from cli.terminal.command import command
from cli.terminal.console import Terminal
from cli.terminal.inputs import check_output, machine_of, mission_paths
from cli.terminal.options import Json, Logs, MachineFile
from replay.errors import ConfigError, OutputError
from replay.progress import Progress, Stage

if TYPE_CHECKING:
    from replay.faults import FaultSpec
    from replay.injection.inject import InjectionOptions
    from replay.machine.config import Machine
    from replay.mission import MissionFile
    from replay.signals.signal import Signals
    from replay.truth import TruthInterval

EXAMPLES = """\b
Examples:
  mfhca inject drive.mcap -o faulty.mcap --fault "FR sensor stuck 30 45"
  mfhca inject drive.bag -o faulty.bag --fault "RL sensor inefficient 60 75 eps=0.4 ramp=3"
  mfhca inject drive.csv -o faulty.csv -m machine.toml --random --count 6 --seed 7
  mfhca diagnose faulty.mcap && mfhca evaluate faulty.mcap

\b
A fault is PART SIDE MODE START STOP [eps=] [sat=] [std=] [tau=] [ramp=]: PART a wheel or steering
axle; SIDE sensor or actuator; MODE stuck, no_signal, inefficient or noisy; times in s from the first
wheel sample; sat and std in m/s (speed), rad (angle) or fraction of full opening (valve); tau the
correlation time in s; ramp the time in s over which eps grows.

\b
OUT holds the mapped signals in SI under canonical names at their own stamps, and says that it is
open-loop: the controller never met these faults. Other topics and columns are left out."""


class Silent(StrEnum):
    """What a sensor without signal logs."""

    ZERO = "zero"
    NAN = "nan"
    DROP = "drop"


@command
def inject(
    terminal: Terminal,
    logs: Logs,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="OUT", help="Log to write, with its truth beside it.")
    ],
    fault: Annotated[
        list[str] | None,
        typer.Option("--fault", metavar="WORDS", help="A fault; may be given again.", show_default=False),
    ] = None,
    random: Annotated[bool, typer.Option("--random", help="Draw faults while the machine drives.")] = False,
    count: Annotated[int, typer.Option(metavar="K", min=1, max=1000, help="Faults to draw.")] = 4,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same faults and noise.")] = 1,
    epsilon: Annotated[
        float | None,
        typer.Option(metavar="E", help="ε of inefficient and noisy faults that give none.", show_default=False),
    ] = None,
    silent: Annotated[Silent, typer.Option(help="What a sensor without signal logs.")] = Silent.ZERO,
    keep_true: Annotated[
        bool, typer.Option("--keep-true", help="Keep the original as a second sensor, v_true, with noise of its own.")
    ] = False,
    second_noise: Annotated[
        float | None,
        typer.Option(metavar="M/S", help="That noise.", show_default="0.6 % of the top speed"),
    ] = None,
    plant: Annotated[
        bool,
        typer.Option("--plant", help="Let the speed answer a valve's fault by the machine file's K and tau (linear)."),
    ] = False,
    machine: MachineFile = None,
    format: Annotated[  # noqa: A002
        LogFormat | None,
        typer.Option("--format", "-f", help="Container.", show_default="by OUT's ending, else the input's, else mcap"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace OUT and its truth.")] = False,
    json: Json = False,
) -> None:
    """Inject sensor (L4) and actuator (L8) faults into a recorded log: a new log, and its truth beside it."""
    from replay.truth import truth_path

    paths = mission_paths(logs)
    if not fault and not random:
        raise ConfigError("no fault is given; give --fault WORDS, or --random to draw some")
    if epsilon is not None and not 0.0 < epsilon < 1.0:
        raise ConfigError(f"--epsilon {epsilon:g}: expected more than 0 and less than 1")
    the_machine, source = machine_of(machine)
    with terminal.progress(Stage.STARTING) as progress:
        from replay.export.recording import write_recording
        from replay.injection.inject import InjectionOptions
        from replay.injection.mission import inject_mission
        from replay.mission import read_signals
        from replay.truth import write_truth

        options = InjectionOptions(silent=silent.value, keep_true=keep_true, second_speed_std=second_noise, plant=plant)
        kind = format or _format_for(output, paths, the_machine)
        truth_file = truth_path(output, folder=kind is LogFormat.ROSBAG2)
        check_output([output, truth_file], paths)
        _check_absent([output, truth_file], force)
        files, signals = read_signals(paths, the_machine, progress=progress)
        progress(Progress(Stage.INJECTING))
        faults = _faults(fault or [], random, count, seed, epsilon, signals, the_machine, options)
        faulty, truth = inject_mission(signals, faults, the_machine, seed, options)
        progress(Progress(Stage.WRITING, output.name))
        write_recording(faulty, output, kind.value)
        write_truth(truth, truth_file)
    for text in _doubts(files, paths, signals, faulty):
        terminal.note(text)
    words = ["mfhca", "diagnose", str(output), *(["-m", str(machine)] if machine is not None else [])]
    if json:
        terminal.show_json(
            {
                "log": str(output),
                "truth": str(truth_file),
                "format": kind.value,
                "machine": {"name": the_machine.name, "source": source},
                "open_loop": True,
                "signals": list(faulty.items),
                "faults": [_row(i) for i in truth.intervals],
                "diagnose": words,
            }
        )
        return
    from cli.tables.layout import key_values, section, table

    rows = [
        (i.component, i.side, i.mode, f"{i.start_s:g} to {i.stop_s:g} s", f"{i.epsilon:.3g}", f"{i.sat_mean:.3g}")
        for i in truth.intervals
    ]
    terminal.show(
        section("Injected faults"),
        table(["part", "side", "mode", "time", "ε", "sat"], rows, right=(4, 5)),
        "",
        key_values(
            [
                (
                    "log",
                    f"{output}  ({kind.value}, {len(faulty.items)} signals, open-loop; other channels are left out)",
                ),
                ("truth", str(truth_file)),
                ("next", shlex.join(words)),
            ]
        ),
    )


def _format_for(output: Path, paths: Sequence[Path], machine: Machine) -> LogFormat:
    """Format by the ending of the output, else that of the one input, else MCAP."""
    if output.suffix.lower() == ".gz":
        raise ConfigError(f"{output}: compressed tables are read, not written; leave out .gz")
    if output.suffix:
        try:
            return format_of(output)
        except ConfigError:
            pass
    if len(paths) > 1:
        return LogFormat.MCAP
    from replay.mission import source_options
    from replay.readers.registry import summarise_log

    return LogFormat(summarise_log(paths[0], source_options(paths[0], machine)).format)


def _check_absent(outputs: Sequence[Path], force: bool) -> None:
    """Raise where a result would replace something that was not asked to be replaced."""
    for path in outputs:
        if path.exists() and not force:
            raise OutputError(f"{path}: exists; give another name with -o, or --force to replace it")


def _faults(
    words: Sequence[str],
    random: bool,
    count: int,
    seed: int,
    epsilon: float | None,
    signals: Signals,
    machine: Machine,
    options: InjectionOptions,
) -> list[FaultSpec]:
    """Faults as given and as drawn."""
    from cli.commands.fault_spec import parse_fault
    from replay.injection.mission import draw_faults

    speeds = dict.fromkeys(machine.wheels, machine.max_speed)
    faults = [parse_fault(text, epsilon=epsilon, speeds=speeds) for text in words]
    if random:
        faults += draw_faults(signals, machine, count, seed, epsilon=epsilon, options=options, beside=faults)
    return faults


def _doubts(files: Sequence[MissionFile], paths: Sequence[Path], before: Signals, after: Signals) -> list[str]:
    """What may spoil the comparison with the truth."""
    from replay.truth import read_truth, truth_path

    out = [text for text in after.notes if text not in before.notes]
    out += [f"{file.path}: is damaged ({text})" for file in files for text in file.summary.damage[:1]]
    for path in paths:
        own = truth_path(path, folder=path.is_dir())
        with suppress(ConfigError):  # a file of that name that is no truth
            if read_truth(own).intervals:
                out.append(f"{path}: {own.name} names faults that it holds already; the new truth does not know them")
    return out


def _row(interval: TruthInterval) -> dict[str, Any]:
    from dataclasses import asdict

    return asdict(interval)
