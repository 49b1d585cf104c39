"""A run of `mfhca inject`: read, inject, write, and say what was injected."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cli.terminal.console import Terminal
from cli.terminal.inputs import check_output, machine_of, mission_paths
from cli.terminal.log_format import LogFormat, format_of
from replay.errors import ConfigError, OutputError
from replay.progress import Progress, Stage

if TYPE_CHECKING:
    from replay.faults import FaultSpec
    from replay.injection.inject import InjectionOptions
    from replay.machine.config import Machine
    from replay.mission import MissionFile
    from replay.signals.signal import Signals
    from replay.truth import MissionTruth


@dataclass(frozen=True)
class InjectRequest:
    """What the command line asks for; names and defaults as there."""

    logs: list[Path]
    output: Path
    faults: list[str]
    random: bool
    count: int
    seed: int
    epsilon: float | None
    silent: Literal["zero", "nan", "drop"]
    keep_true: bool
    second_noise: float | None
    plant: bool
    machine: Path | None
    format: LogFormat | None
    force: bool
    json: bool

    def check(self) -> None:
        """Raise a `ConfigError` where no fault is asked for, or one that cannot be."""
        if not self.faults and not self.random:
            raise ConfigError("no fault is given; give --fault WORDS, or --random to draw some")
        if self.epsilon is not None and not 0.0 < self.epsilon < 1.0:
            raise ConfigError(f"--epsilon {self.epsilon:g}: expected more than 0 and less than 1")

    def options(self) -> InjectionOptions:
        """How faults are written into the log."""
        from replay.injection.inject import InjectionOptions

        return InjectionOptions(
            silent=self.silent, keep_true=self.keep_true, second_speed_std=self.second_noise, plant=self.plant
        )


@dataclass(frozen=True)
class _Written:
    """A log with faults, as it was written.

    Attributes
    ----------
    truth_file : Path
        Where its truth stands.
    kind : LogFormat
        Its container.
    doubts : list[str]
        What may spoil the comparison with the truth.
    """

    signals: Signals
    truth: MissionTruth
    truth_file: Path
    kind: LogFormat
    doubts: list[str]


def run_injection(terminal: Terminal, request: InjectRequest) -> None:
    """Inject faults into a log, and write it with its truth."""
    paths = mission_paths(request.logs)
    request.check()
    machine, source = machine_of(request.machine)
    written = _written(terminal, request, paths, machine)
    for text in written.doubts:
        terminal.note(text)
    own_machine = ["-m", str(request.machine)] if request.machine is not None else []
    words = ["mfhca", "diagnose", str(request.output), *own_machine]
    if request.json:
        terminal.show_json(
            {
                "log": str(request.output),
                "truth": str(written.truth_file),
                "format": written.kind.value,
                "machine": {"name": machine.name, "source": source},
                "open_loop": True,
                "signals": list(written.signals.items),
                "faults": [asdict(interval) for interval in written.truth.intervals],
                "diagnose": words,
            }
        )
    else:
        _show(terminal, request.output, written, words)


def _written(terminal: Terminal, request: InjectRequest, paths: list[Path], machine: Machine) -> _Written:
    from replay.truth import truth_path

    output = request.output
    with terminal.progress(Stage.STARTING) as progress:
        from replay.export.recording import write_recording
        from replay.injection.mission import inject_mission
        from replay.mission import read_signals
        from replay.truth import write_truth

        options = request.options()
        kind = request.format or _format_for(output, paths, machine)
        truth_file = truth_path(output, folder=kind is LogFormat.ROSBAG2)
        check_output([output, truth_file], paths)
        _check_absent([output, truth_file], request.force)
        files, signals = read_signals(paths, machine, progress=progress)
        progress(Progress(Stage.INJECTING))
        faults = _faults(request, signals, machine, options)
        faulty, truth = inject_mission(signals, faults, machine, request.seed, options)
        progress(Progress(Stage.WRITING, output.name))
        write_recording(faulty, output, kind.value)
        write_truth(truth, truth_file)
    return _Written(faulty, truth, truth_file, kind, _doubts(files, paths, signals, faulty))


def _show(terminal: Terminal, output: Path, written: _Written, words: list[str]) -> None:
    from cli.tables.layout import key_values, section, table

    rows = [
        (i.component, i.side, i.mode, f"{i.start_s:g} to {i.stop_s:g} s", f"{i.epsilon:.3g}", f"{i.sat_mean:.3g}")
        for i in written.truth.intervals
    ]
    what = f"{written.kind.value}, {len(written.signals.items)} signals, open-loop; other channels are not written"
    terminal.show(
        section("Injected faults"),
        table(["part", "side", "mode", "time", "ε", "sat"], rows, right=(4, 5)),
        "",
        key_values([("log", f"{output}  ({what})"), ("truth", str(written.truth_file)), ("next", shlex.join(words))]),
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

    found = summarise_log(paths[0], source_options(paths[0], machine)).format
    if found not in list(LogFormat):
        raise ConfigError(
            f"{output}: the input's format {found} is read, not written; give OUT an ending such as .mcap, or --format"
        )
    return LogFormat(found)


def _check_absent(outputs: Sequence[Path], force: bool) -> None:
    """Raise where a result would replace something that was not asked to be replaced."""
    for path in outputs:
        if path.exists() and not force:
            raise OutputError(f"{path}: exists; give another name with -o, or --force to replace it")


def _faults(request: InjectRequest, signals: Signals, machine: Machine, options: InjectionOptions) -> list[FaultSpec]:
    """Faults as given and as drawn."""
    from cli.commands.fault_spec import parse_fault
    from replay.injection.mission import draw_faults

    epsilon = request.epsilon
    speeds = dict.fromkeys(machine.wheels, machine.max_speed)
    faults = [parse_fault(text, epsilon=epsilon, speeds=speeds) for text in request.faults]
    if request.random:
        faults += draw_faults(
            signals, machine, request.count, request.seed, epsilon=epsilon, options=options, beside=faults
        )
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
                out.append(
                    f"{path}: {own.name} names faults that the recording already has; the new truth does not contain them, "
                    "and `mfhca evaluate` counts reports of them as false alarms: inject into a healthy recording"
                )
    return out
