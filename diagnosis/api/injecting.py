"""Write known faults into a recorded log: a new log, and its truth beside it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from diagnosis.api.errors import stated
from diagnosis.api.inputs import MachineLike, StrPath, check_output, machine_given, mission_paths, path_of, paths_of
from diagnosis.api.log_format import LogFormat, format_named, format_of
from diagnosis.api.simulating import MadeLog
from replay.errors import ConfigError, OutputError
from replay.progress import Progress, Stage, Subscriber, silent

if TYPE_CHECKING:
    from replay.faults import FaultSpec
    from replay.injection.inject import InjectionOptions
    from replay.machine.config import Machine
    from replay.mission import MissionFile
    from replay.signals.signal import Signals

SILENT = ("zero", "nan", "drop")


@dataclass(frozen=True)
class InjectRequest:
    """What is asked for; names and defaults as on the command line.

    Attributes
    ----------
    paths : tuple[Path, ...]
        The files of the mission.
    output : Path
        Log to write.
    faults : tuple[str, ...]
        Faults in words, see `diagnosis.api.fault_words`.
    random, count, seed : bool, int, int
        Whether faults are drawn, how many, and from which seed.
    epsilon : float or None
        ε of inefficient and noisy faults that give none [1].
    silent : {"zero", "nan", "drop"}
        What a sensor without signal writes.
    keep_true, second_noise : bool, float or None
        Whether the original is kept as a second sensor, and its noise [m/s].
    plant : bool
        Whether the speed answers a valve's fault by the machine's K and τ.
    format : LogFormat or None
        Container; None: by the ending of `output`, else the input's.
    force : bool
        Whether `output` and its truth may be replaced.
    """

    paths: tuple[Path, ...]
    output: Path
    faults: tuple[str, ...] = ()
    random: bool = False
    count: int = 4
    seed: int = 1
    epsilon: float | None = None
    silent: Literal["zero", "nan", "drop"] = "zero"
    keep_true: bool = False
    second_noise: float | None = None
    plant: bool = False
    format: LogFormat | None = None
    force: bool = False

    def check(self) -> None:
        """Raise a `ConfigError` where no fault is asked for, or one that cannot be."""
        if not self.faults and not self.random:
            raise ConfigError("no fault is given; give --fault WORDS, or --random to draw some")
        if self.random and not 1 <= self.count <= 1000:
            raise ConfigError(f"--count {self.count}: expected 1 to 1000")
        if self.epsilon is not None and not 0.0 < self.epsilon < 1.0:
            raise ConfigError(f"--epsilon {self.epsilon:g}: expected more than 0 and less than 1")
        if self.silent not in SILENT:
            raise ConfigError(f"--silent {self.silent}: is not known; expected one of {', '.join(SILENT)}")

    def options(self) -> InjectionOptions:
        """How faults are written into the log."""
        from replay.injection.inject import InjectionOptions

        return InjectionOptions(
            silent=self.silent, keep_true=self.keep_true, second_speed_std=self.second_noise, plant=self.plant
        )


@stated
def inject(
    log: StrPath | Iterable[StrPath],
    output: StrPath,
    *,
    faults: Sequence[str] = (),
    random: bool = False,
    count: int = 4,
    seed: int = 1,
    machine: MachineLike = None,
    epsilon: float | None = None,
    silent: Literal["zero", "nan", "drop"] = "zero",
    keep_true: bool = False,
    second_noise: float | None = None,
    plant: bool = False,
    format: str | None = None,  # noqa: A002 - the option's name
    force: bool = False,
) -> MadeLog:
    """Write faults into a recorded log, as `mfhca inject` does: a new log, which says that it is open-loop, and its truth.

    Parameters
    ----------
    log : str, Path or several
        Recording, or the files of one mission; left as they are.
    output : str or Path
        Log to write.
    faults : Sequence[str]
        Faults, each ``PART SIDE MODE START STOP [eps=] [sat=] [std=] [tau=] [ramp=]``, times in seconds from the first wheel
        sample: ``"FR sensor stuck 30 45"``.
    random : bool
        Whether faults are drawn while the machine drives, `count` of them from `seed`.
    count, seed : int
        Number of drawn faults, 1 to 1000; the same seed gives the same faults and noise.
    machine : str, Path, Machine or None
        Machine file or machine; None: the paper's.
    epsilon : float or None
        ε of inefficient and noisy faults that give none, between 0 and 1 [1].
    silent : str
        What a sensor without signal writes: ``zero``, ``nan`` or ``drop`` (no sample).
    keep_true : bool
        Whether the original is kept as a second sensor, with noise of its own.
    second_noise : float or None
        Noise of that second sensor [m/s]; None: 0.6 % of the top speed.
    plant : bool
        Whether the speed answers a valve's fault by the machine's K and τ (linear).
    format : str or None
        Container, see `MadeLog.format`; None: by the ending of `output`, else the input's.
    force : bool
        Whether `output` and its truth may be replaced.

    Raises
    ------
    ConfigError
        Where no fault is given, or one cannot be injected.
    LogError
        Where the log cannot be read.
    OutputError
        Where `output` exists or cannot be written.
    """
    request = InjectRequest(
        paths=tuple(paths_of(log)),
        output=path_of(output),
        faults=tuple(faults),
        random=random,
        count=count,
        seed=seed,
        epsilon=epsilon,
        silent=silent,
        keep_true=keep_true,
        second_noise=second_noise,
        plant=plant,
        format=None if format is None else format_named(format),
        force=force,
    )
    return write_injection(request, machine_given(machine)[0])[0]


def write_injection(request: InjectRequest, machine: Machine, progress: Subscriber = silent) -> tuple[MadeLog, Signals]:
    """Inject faults into a log, and write it with its truth.

    Parameters
    ----------
    request : InjectRequest
        What is asked for.
    machine : Machine
        The machine.
    progress : Subscriber
        Called at the beginning of each stage.

    Returns
    -------
    tuple[MadeLog, Signals]
        What was written, and the signals in it.

    Raises
    ------
    ConfigError, LogError, OutputError
        See `inject`.
    """
    paths = mission_paths(request.paths)
    request.check()
    from replay.export.recording import write_recording
    from replay.injection.mission import inject_mission
    from replay.mission import read_signals
    from replay.truth import truth_path, write_truth

    output, options = request.output, request.options()
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
    return MadeLog(output, truth_file, kind.value, truth, tuple(_doubts(files, paths, signals, faulty))), faulty


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
    from diagnosis.api.fault_words import parse_fault
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
