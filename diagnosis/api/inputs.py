"""From what was asked, on the command line or in Python, to checked paths, machines and times."""

from __future__ import annotations

import glob
import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from replay.errors import ConfigError, LogError
from replay.log.file_types import check_regular, part_of

if TYPE_CHECKING:
    from replay.machine.config import Machine

#: A path as text or as an object of `os.PathLike`, such as `pathlib.Path`.
StrPath: TypeAlias = str | os.PathLike[str]

#: A machine, its file, or None for the paper's machine.
MachineLike: TypeAlias = "Machine | StrPath | None"

DEFAULT_MACHINE = "paper defaults"


def path_of(path: StrPath) -> Path:
    """The path as an object; ``~`` is the home folder.

    Raises
    ------
    ConfigError
        Where it is no path.
    """
    if not isinstance(path, str | os.PathLike):
        raise ConfigError(f"{path!r} is no path; give text or a pathlib.Path")
    return Path(path).expanduser()


def paths_of(paths: StrPath | Iterable[StrPath]) -> list[Path]:
    """One path or several as a list.

    Raises
    ------
    ConfigError
        Where there is none, or one is no path.
    """
    given = [paths] if isinstance(paths, str | os.PathLike) else paths
    if not isinstance(given, Iterable):
        raise ConfigError(f"{paths!r} is no path; give text, a pathlib.Path, or several of them")
    found = [path_of(path) for path in given]
    if not found:
        raise ConfigError("no log is given; give the path of a log, or those of the files of one mission")
    return found


def machine_of(path: Path | None) -> tuple[Machine, str]:
    """Read the machine file, or take the paper's machine; with the name to show for it."""
    from replay.machine.config import haulotte
    from replay.machine.toml_file import load_machine

    return (haulotte(), DEFAULT_MACHINE) if path is None else (load_machine(path), path.name)


def machine_given(machine: MachineLike) -> tuple[Machine, str]:
    """A machine itself, or that of a file; with the name of where its settings come from.

    Raises
    ------
    ConfigError
        Where the file is not there or not right.
    """
    from replay.machine.config import Machine

    if isinstance(machine, Machine):
        return machine, machine.name
    return machine_of(None if machine is None else path_of(machine))


def mission_paths(paths: Sequence[Path]) -> list[Path]:
    """Check that the files of one mission are there, each once.

    Raises
    ------
    LogError
        Where one does not exist, is a pipe or a device, or is a folder of separate logs.
    ConfigError
        Where one is given twice.
    """
    for path in paths:
        if not path.exists():
            hint = "; give each file of the mission by its name" if glob.has_magic(str(path)) else ""
            raise LogError(f"{path}: no such file{hint}")
        check_regular(path)
        if path.is_dir():
            _check_one_recording(path)
    real = [p.resolve() for p in paths]
    for i, path in enumerate(real):
        if path in real[:i]:
            raise ConfigError(f"{paths[i]}: given twice; give each file of the mission once")
    return list(paths)


def _check_one_recording(folder: Path) -> None:
    """Raise a `LogError` where a folder without rosbag2's description holds files that are no numbered parts."""
    if (folder / "metadata.yaml").is_file():
        return
    parts = [p.name for p in folder.iterdir() if p.name.lower().endswith((".db3", ".mcap"))]
    stems = {part[0] if (part := part_of(name)) else name for name in parts}
    if len(stems) > 1:
        raise LogError(
            f"{folder}: is a folder of {len(parts)} logs, not one rosbag2 recording; give the files of one mission "
            "by their names"
        )


def check_output(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise a `ConfigError` where a result would replace a log, or stand inside a recording's folder."""
    for output in (o.resolve() for o in outputs):
        for path in inputs:
            real = path.resolve()
            if output == real or real in output.parents:
                raise ConfigError(
                    f"{path}: would be changed by writing {output.name} there; give another place with -o"
                )


def check_times(start: float | None, end: float | None, names: tuple[str, str] = ("--start", "--end")) -> None:
    """Raise a `ConfigError` where the asked part of a mission cannot be one. Times in s of the mission."""
    for name, value in zip(names, (start, end), strict=True):
        if value is not None and not (math.isfinite(value) and value >= 0):
            raise ConfigError(f"{name} {value:g}: expected seconds from the mission's start, 0 or more")
    if start is not None and end is not None and end <= start:
        raise ConfigError(f"{names[1]} {end:g}: must be later than {names[0]} {start:g}")


def check_wheels(wheels: Sequence[str] | None, machine: Machine, name: str = "--wheel") -> tuple[str, ...] | None:
    """Give the asked wheels as the machine spells them, in its order; None where none are asked for.

    Raises
    ------
    ConfigError
        Where a wheel is not one of the machine's.
    """
    if not wheels:
        return None
    spelling = {w.casefold(): w for w in machine.wheels}
    for wheel in wheels:
        if wheel.casefold() not in spelling:
            raise ConfigError(
                f"{name} {wheel or repr(wheel)}: no such wheel; the machine has {', '.join(machine.wheels)}"
            )
    asked = {spelling[w.casefold()] for w in wheels}
    return tuple(w for w in machine.wheels if w in asked)
