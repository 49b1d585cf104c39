"""Folders and files to look through, local or behind a URL, in one shape."""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Protocol

from diagnosis.audit.discovery.apart import HELPER, Span
from replay.errors import LogError
from replay.readers.registry import readers
from replay.signals.together import Extent

_PAUSE_NS = 5_000_000_000
_OVERLAP_NS = 2_000_000_000


@dataclass(frozen=True)
class Entry:
    """A file or folder.

    Attributes
    ----------
    path : str
        As it is to be opened: a local path or a URL.
    name : str
        Last part of `path`.
    real : str
        Its identity, whatever links lead to it.
    size : int
        In bytes; 0 for folders.
    stamp : str
        Changes with the content; empty for folders.
    link : bool
        Whether it is a symbolic link.
    """

    path: str
    name: str
    real: str
    size: int = 0
    stamp: str = ""
    link: bool = False


class Place(Protocol):
    """Where missions may be found."""

    def listed(self, folder: Entry) -> tuple[list[Entry], list[Entry]]:
        """Files and folders in a folder, sorted by name, links last, links to folders among them; raises `OSError`."""
        ...

    def lost(self, folder: Entry) -> list[str]:
        """What `listed` left out because it leads nowhere, one sentence each."""
        ...

    def text(self, file: Entry) -> str:
        """Text of a small file; raises `OSError` or `UnicodeDecodeError`."""
        ...

    def inside(self, folder: Entry, name: str) -> Entry | None:
        """File or folder by its name relative to a folder, unless it is outside of it or not there."""
        ...

    def beside(self, folder: str, name: str) -> Entry | None:
        """File by its name in a folder that need not be searched; None where it is not there, or the folder is for temporary files."""
        ...

    def is_folder(self, entry: Entry) -> bool:
        """Whether it is a folder."""
        ...

    def parent(self, path: str) -> str:
        """Folder of a path."""
        ...

    def home(self, file: Entry) -> str:
        """Identity of a file's folder."""
        ...

    def whole(self, folder: Entry) -> Entry:
        """A folder as one log: size and stamp of all that is in it; raises `OSError`."""
        ...

    def continuous(self, parts: Sequence[Entry]) -> bool:
        """Whether each of some logs goes on where the one before ended, with the same topics."""
        ...

    def extent(self, table: Entry) -> Extent | None:
        """When a table begins and ends, and its columns; None where that is not known."""
        ...

    def is_log(self, file: Entry) -> bool:
        """Whether a file's content looks like a log; for names that say little."""
        ...


class LocalPlace:
    """The file system."""

    def __init__(self) -> None:
        self._lost: dict[str, list[str]] = {}

    def entry(self, path: str) -> Entry:
        """Entry of an existing path; raises `OSError`."""
        state = os.stat(path)  # noqa: PTH116 - also for names that pathlib would change
        real = os.path.realpath(path)
        folder = stat.S_ISDIR(state.st_mode)
        name = os.path.basename(real if folder else path)  # noqa: PTH119
        size, stamp = (0, "") if folder else (state.st_size, str(state.st_mtime_ns))
        return Entry(path, name, real, size, stamp, os.path.islink(path))  # noqa: PTH114

    def listed(self, folder: Entry) -> tuple[list[Entry], list[Entry]]:
        """Files and folders in a folder; pipes and devices are left out."""
        files, folders = [], []
        lost = self._lost[folder.path] = []
        with os.scandir(folder.path) as found:
            for item in found:
                try:
                    if item.is_dir():
                        folders.append(replace(self.entry(item.path), name=item.name))
                    elif item.is_file():
                        files.append(self.entry(item.path))
                    elif item.is_symlink() and not item.name.startswith("."):
                        item.stat()  # says where it leads nowhere
                except OSError as error:
                    if item.is_symlink() and not item.name.startswith("."):
                        lost.append(f"{item.path}: the link leads nowhere ({error.strerror or error})")
        return sorted(files, key=_order), sorted(folders, key=_order)

    def lost(self, folder: Entry) -> list[str]:
        """Links in a folder that lead nowhere."""
        return self._lost.get(folder.path, [])

    def text(self, file: Entry) -> str:
        """Text of a small file."""
        return Path(file.path).read_text(encoding="utf-8")

    def inside(self, folder: Entry, name: str) -> Entry | None:
        """File or folder within a folder, by real path; a name that reads like a URL is none."""
        if "://" in name:
            return None
        try:
            found = self.entry(os.path.join(folder.path, name))  # noqa: PTH118
        except (OSError, ValueError):
            return None
        return found if found.real.startswith(folder.real.rstrip(os.sep) + os.sep) else None

    def beside(self, folder: str, name: str) -> Entry | None:
        """File in any folder but one that everybody puts files into, such as ``/tmp``."""
        try:
            mode = os.stat(folder).st_mode  # noqa: PTH116
            if mode & stat.S_IWOTH and mode & stat.S_ISVTX:
                return None
            found = self.entry(os.path.join(folder, name))  # noqa: PTH118
        except (OSError, ValueError):
            return None
        return found if self.is_file(found) else None

    def is_folder(self, entry: Entry) -> bool:
        """Whether it is a folder."""
        return os.path.isdir(entry.path)  # noqa: PTH112

    def is_file(self, entry: Entry) -> bool:
        """Whether it is a regular file."""
        return os.path.isfile(entry.path)  # noqa: PTH113

    def parent(self, path: str) -> str:
        """Folder of a path."""
        return os.path.dirname(path) or os.curdir  # noqa: PTH120

    def home(self, file: Entry) -> str:
        """Real path of a file's folder."""
        return os.path.realpath(self.parent(file.path))

    def whole(self, folder: Entry) -> Entry:
        """A folder as one log."""
        rows = []
        for base, _, names in os.walk(folder.path, onerror=_fail):
            for name in names:
                path = os.path.join(base, name)  # noqa: PTH118
                state = os.stat(path)  # noqa: PTH116
                rows.append((os.path.relpath(path, folder.path), state.st_size, str(state.st_mtime_ns)))
        return joined(folder, rows)

    def continuous(self, parts: Sequence[Entry]) -> bool:
        """Whether logs go on from one to the next, by their indexes."""
        try:
            return continues(HELPER.span(part.path) for part in parts)
        except LogError:
            return False

    def extent(self, table: Entry) -> Extent | None:
        """When a table begins and ends, by its first and last rows."""
        try:
            span = HELPER.span(table.path)
        except LogError:
            return None
        return Extent(span.start_ns, span.stop_ns, span.columns)

    def is_log(self, file: Entry) -> bool:
        """Whether a reader knows the content."""
        try:
            return any(reader.matches(Path(file.path)) for reader in readers())
        except (OSError, LogError):
            return True


def joined(folder: Entry, rows: Iterable[tuple[str, int, str]]) -> Entry:
    """A folder with size and stamp of the files in it, given as relative name, size and stamp."""
    held = sorted(rows)
    digest = hashlib.sha256(repr(held).encode("utf-8", "backslashreplace")).hexdigest()
    return Entry(folder.path, folder.name, folder.real, sum(r[1] for r in held), digest[:32], folder.link)


def continues(parts: Iterable[Span]) -> bool:
    """Whether each log goes on where the one before ended, with the same topics; none is taken behind one that does not."""
    for before, after in pairwise(parts):
        pause = after.start_ns - before.stop_ns
        related = after.topics <= before.topics or before.topics <= after.topics
        if not (-_OVERLAP_NS <= pause <= _PAUSE_NS and related):
            return False
    return True


def _order(entry: Entry) -> tuple[bool, str]:
    return entry.link, entry.name


def _fail(error: OSError) -> None:
    raise error
