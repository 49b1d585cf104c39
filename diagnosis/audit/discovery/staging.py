"""A mission's files as the local paths that `diagnosis.pipeline.diagnose` takes."""

from __future__ import annotations

import math
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from diagnosis.audit.discovery.listing import Entry, joined
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.discovery.remote import file_system, stamp_of
from diagnosis.audit.discovery.remote_mcap import why
from diagnosis.audit.discovery.safe_names import safe_name
from replay.errors import ConfigError, LogError
from replay.log.content_hash import content_hash
from replay.log.file_types import part_of, split_ending
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine


@dataclass(frozen=True)
class Staged:
    """Files ready to be read.

    Attributes
    ----------
    paths : tuple[Path, ...]
        What `diagnose` is given; the parts of a split recording are one folder.
    hashes : tuple[str, ...]
        SHA-256 of each file of the mission, in its order.
    """

    paths: tuple[Path, ...]
    hashes: tuple[str, ...]


class Late(Exception):
    """The files were not ready in time."""


def stage(mission: MissionSource, folder: Path, known: Sequence[str] = (), until: float = math.inf) -> Staged:
    """Make a mission's files local, and hash them.

    Parameters
    ----------
    mission : MissionSource
        As found.
    folder : Path
        Private and empty; takes copies of what is behind URLs, each read whole and once, and links to the parts of split
        recordings.
    known : Sequence[str]
        SHA-256 of each file where they are known, so that local files need not be read for them.
    until : float
        Time of `time.monotonic` at which they must be ready [s]; checked with each piece that comes from a server, and
        after each file.

    Raises
    ------
    Late
        Where they are not.
    LogError
        Where a file cannot be read, or was replaced since the missions were listed.
    ConfigError
        Where the kind of URL is not known.
    """
    sizes = mission.sizes or (-1,) * len(mission.files)
    paths, hashes = [], []
    for i, (name, size, stamp) in enumerate(zip(mission.files, sizes, mission.stamps, strict=True)):
        if "://" in name:
            paths.append(_fetch(name, folder / str(i), size, stamp, until))
            hashes.append(content_hash(paths[-1])[0])
        else:
            paths.append(Path(name))
            hashes.append(known[i] if i < len(known) else content_hash(paths[-1])[0])
        _in_time(until)
    return Staged(_recordings(paths, folder), tuple(hashes))


def machine_at(name: str) -> Machine:
    """Machine of a machine file, also behind a URL.

    Raises
    ------
    ConfigError
        Where it cannot be read or is wrong.
    """
    if "://" not in name:
        return load_machine(Path(name))
    system, path = file_system(name)
    with tempfile.TemporaryDirectory(prefix="mfhca-") as folder:
        local = Path(folder) / "machine.toml"
        try:
            system.get_file(path, str(local))
        except Exception as error:  # each package raises its own kinds
            raise ConfigError(f"{name}: cannot read the machine file: {why(error)}") from error
        return load_machine(local)


def _in_time(until: float) -> None:
    if time.monotonic() > until:
        raise Late


def _fetch(url: str, folder: Path, size: int, stamp: str, until: float) -> Path:
    """Copy an object, or all below a folder; refuse what was replaced since it was listed."""
    from fsspec.callbacks import Callback

    system, path = file_system(url)
    piece = Callback(hooks={"time": lambda *_, **__: _in_time(until)})
    stem, ending = split_ending(path.rstrip("/").rpartition("/")[2])
    local = folder / (safe_name(stem) + ending)
    try:
        folder.mkdir(parents=True)
        info = system.info(path)
        if info["type"] == "directory":
            found = _fetch_folder(system, path, url, local, piece)
        else:
            system.get_file(path, str(local), callback=piece)
            found = _checked(system, path, url, local)
    except OSError as error:
        raise LogError(f"{url}: cannot be read ({why(error)})") from error
    except (LogError, Late):
        raise
    except Exception as error:  # each package raises its own kinds
        raise LogError(f"{url}: cannot be read ({why(error)})") from error
    if (size, stamp) != found and (size >= 0 or stamp != found[1]):
        raise _replaced(url)
    return local


def _checked(system: Any, path: str, url: str, local: Path) -> tuple[int, str]:
    """Size and stamp of an object after it was copied."""
    system.invalidate_cache()
    info = system.info(path)
    if local.stat().st_size != info["size"]:
        raise _replaced(url)
    return int(info["size"]), stamp_of(info)


def _fetch_folder(system: Any, path: str, url: str, local: Path, piece: Any) -> tuple[int, str]:
    local.mkdir()
    for other in sorted(system.find(path)):
        relative = other[len(path) :].strip("/")
        if any(part in ("", ".", "..") for part in relative.replace("\\", "/").split("/")):
            raise LogError(f"{url}: holds an object with the name {relative[:80]!r}, which is not a file name")
        target = local / relative
        target.parent.mkdir(parents=True, exist_ok=True)
        system.get_file(other, str(target), callback=piece)
    system.invalidate_cache()
    rows = []
    for other, info in system.find(path, detail=True).items():
        relative = other[len(path) :].strip("/")
        if not (local / relative).is_file() or (local / relative).stat().st_size != info["size"]:
            raise _replaced(url)
        rows.append((relative, int(info["size"]), stamp_of(info)))
    whole = joined(Entry(url, "", url), rows)
    return whole.size, whole.stamp


def _replaced(url: str) -> LogError:
    return LogError(f"{url}: was replaced while it was read; audit again once it is complete")


def _recordings(paths: Sequence[Path], folder: Path) -> tuple[Path, ...]:
    """Paths with the numbered parts of each recording put into one folder."""
    parts: dict[tuple[str, str], list[Path]] = {}
    for path in paths:
        named = part_of(path.name)
        if named is not None and not path.is_dir():
            parts.setdefault((named[0], named[2]), []).append(path)
    out: list[Path] = []
    for path in paths:
        named = part_of(path.name)
        mine = parts.get((named[0], named[2]), []) if named is not None else []
        if len(mine) < 2 or path not in mine:
            out.append(path)
        elif path == mine[0]:
            out.append(_linked(mine, folder / f"parts{len(out)}" / named[0] if named else folder))
    return tuple(out)


def _linked(parts: Sequence[Path], folder: Path) -> Path:
    try:
        folder.mkdir(parents=True)
        for part in parts:
            _link(part.resolve(), folder / part.name)
    except OSError as error:
        raise LogError(f"{folder}: cannot take the parts of {parts[0].name} ({error.strerror or error})") from error
    return folder


def _link(source: Path, target: Path) -> None:
    ways: tuple[Callable[[Path, Path], object], ...] = (os.symlink, os.link, shutil.copyfile)
    for i, way in enumerate(ways):
        try:
            way(source, target)
        except OSError:  # Windows may refuse links
            if i == len(ways) - 1:
                raise
        else:
            return
