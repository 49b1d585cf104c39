"""From what the user typed to checked paths, machines and times."""

from __future__ import annotations

import glob
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from replay.errors import ConfigError, LogError
from replay.log.file_types import LOG_ENDINGS, check_regular, is_result, part_of, words_of

if TYPE_CHECKING:
    from replay.machine.config import Machine

DEFAULT_MACHINE = "paper defaults"


def machine_of(path: Path | None) -> tuple[Machine, str]:
    """Read the machine file, or take the paper's machine; with the name to show for it."""
    from replay.machine.config import haulotte
    from replay.machine.toml_file import load_machine

    return (haulotte(), DEFAULT_MACHINE) if path is None else (load_machine(path), path.name)


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


def check_times(start: float | None, end: float | None) -> None:
    """Raise a `ConfigError` where the asked part of a mission cannot be one."""
    for name, value in (("--start", start), ("--end", end)):
        if value is not None and not (math.isfinite(value) and value >= 0):
            raise ConfigError(f"{name} {value:g}: expected seconds from the mission's start, 0 or more")
    if start is not None and end is not None and end <= start:
        raise ConfigError(f"--end {end:g}: must be later than --start {start:g}")


def check_wheels(wheels: Sequence[str] | None, machine: Machine) -> tuple[str, ...] | None:
    """Give the asked wheels as the machine spells them, in its order; None where none are asked for."""
    if not wheels:
        return None
    spelling = {w.casefold(): w for w in machine.wheels}
    for wheel in wheels:
        if wheel.casefold() not in spelling:
            raise ConfigError(f"--wheel {wheel}: no such wheel; the machine has {', '.join(machine.wheels)}")
    asked = {spelling[w.casefold()] for w in wheels}
    return tuple(w for w in machine.wheels if w in asked)


@dataclass
class FoundLogs:
    """Logs behind the words of a command line.

    Attributes
    ----------
    paths : list[Path]
        Files and rosbag2 folders, each once, in the given order; those in folders sorted.
    missing : list[str]
        Words behind which nothing was found, with the reason.
    left_aside : int
        Files in given folders that are no logs.
    urls : list[str]
        Words that are URLs, as given.
    """

    paths: list[Path]
    missing: list[str]
    left_aside: int = 0
    urls: list[str] = field(default_factory=list)


def find_logs(words: Iterable[str], *, urls: bool = False) -> FoundLogs:
    """Expand files, folders, globs and ``-`` (paths on stdin, one per line); URLs are taken as they are where asked for."""
    found = FoundLogs([], [])
    seen: set[Path] = set()
    for word in words_of(words):
        path = Path(word)
        if "://" in word:
            if urls:
                found.urls.append(word)
            else:
                found.missing.append(f"{word}: only audit and inspect read URLs; copy the log here and give the copy")
            continue
        if path.exists():
            hits = [path]
        elif glob.has_magic(word):
            hits = [Path(p) for p in sorted(glob.glob(word, recursive=True))]  # noqa: PTH207 - absolute patterns too
        else:
            hits = []
        logs = [log for hit in hits for log in _logs_at(hit, found)]
        if not hits:
            found.missing.append(f"{word}: no such file" if not glob.has_magic(word) else f"{word}: matches no file")
        elif not logs:
            found.missing.append(f"{word}: holds no log ({', '.join(LOG_ENDINGS)} or a rosbag2 folder)")
        for log in logs:
            if (real := log.resolve()) not in seen:
                seen.add(real)
                found.paths.append(log)
    return found


def _logs_at(path: Path, found: FoundLogs) -> Iterator[Path]:
    """Yield a file itself, a rosbag2 folder as one log, or the logs in a folder and below; links to folders are not followed."""
    if not path.is_dir() or (path / "metadata.yaml").is_file():
        yield path
        return
    for child in sorted(path.iterdir()):
        if child.is_dir():
            if not child.is_symlink() and not child.name.startswith("."):
                yield from _logs_at(child, found)
        elif child.name.lower().endswith(LOG_ENDINGS) and not child.name.startswith(".") and not is_result(child):
            yield child
        else:
            found.left_aside += 1
