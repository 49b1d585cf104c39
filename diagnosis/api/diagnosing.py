"""Diagnose a mission from Python, or read a saved result; a machine and its file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from diagnosis.api.errors import stated
from diagnosis.api.inputs import (
    MachineLike,
    StrPath,
    check_times,
    check_wheels,
    machine_given,
    mission_paths,
    path_of,
    paths_of,
)
from diagnosis.api.saved_results import previous_result, result_file
from replay.progress import Subscriber, silent

if TYPE_CHECKING:
    from diagnosis.api.result import Diagnosis
    from replay.machine.config import Machine


@stated
def diagnose(
    log: StrPath | Iterable[StrPath],
    machine: MachineLike = None,
    *,
    start_s: float | None = None,
    stop_s: float | None = None,
    wheels: Sequence[str] | None = None,
    machine_id: str | None = None,
    previous: StrPath | None = None,
    progress: Subscriber = silent,
) -> Diagnosis:
    """Diagnose one mission, as `mfhca diagnose` does; nothing is written.

    Parameters
    ----------
    log : str, Path or several
        A log, or the files of one mission: a bag and a PLC export. Several are put on one clock.
    machine : str, Path, Machine or None
        Machine file or machine; None: the paper's Haulotte, signals found by their names.
    start_s, stop_s : float or None
        Part of the mission to judge [s from the mission's start].
    wheels : Sequence[str] or None
        Wheels to judge; None: all.
    machine_id : str or None
        Identity for trends; None: what the log states, else the machine file's.
    previous : str, Path or None
        Earlier result of the same machine (folder or ``report.json``) to compare with, under ``report["previous"]``.
    progress : Callable[[Progress], None]
        Called at the beginning of each stage.

    Raises
    ------
    LogError
        Where a file cannot be read.
    NotJudged
        Where nothing in the log can be judged.
    ConfigError
        Where an option or the machine file is wrong.
    """
    from diagnosis import pipeline
    from diagnosis.api.result import Diagnosis
    from diagnosis.comparison.previous import with_previous

    paths = mission_paths(paths_of(log))
    check_times(start_s, stop_s, ("start_s", "stop_s"))
    the_machine, source = machine_given(machine)
    chosen = check_wheels([wheels] if isinstance(wheels, str) else wheels, the_machine, "wheels")
    earlier = None if previous is None else previous_result(path_of(previous))
    result = pipeline.diagnose(
        paths,
        the_machine,
        machine_source=source,
        start_s=start_s,
        stop_s=stop_s,
        wheels=chosen,
        machine_id=machine_id,
        progress=progress,
    )
    if earlier is not None:
        result = replace(result, report=with_previous(result.report, earlier, str(previous)))
    return Diagnosis(result)


@stated
def read_result(result: StrPath) -> Diagnosis:
    """Read a saved result.

    Parameters
    ----------
    result : str or Path
        Folder that `mfhca diagnose` or `Diagnosis.save` wrote, or its ``report.json``.

    Raises
    ------
    LogError
        Where there is none, or its files are damaged or not of this tool.
    """
    from diagnosis.api.result import Diagnosis
    from diagnosis.output import load_result

    return Diagnosis(load_result(result_file(path_of(result))))


@stated
def load_machine(file: StrPath) -> Machine:
    """Read a machine file (TOML); `mfhca config init` writes one with every key explained.

    Parameters
    ----------
    file : str or Path
        The file.

    Returns
    -------
    Machine
        Wheels, geometry, limits, control, plants and signals; see `replay.machine.config.Machine`.

    Raises
    ------
    ConfigError
        Where it cannot be read, a key is not known, or a value is out of its range: key, value, unit and range.
    """
    from replay.machine.toml_file import load_machine as load

    return load(path_of(file))
