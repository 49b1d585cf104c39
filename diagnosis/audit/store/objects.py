"""Result objects: one immutable JSON file per attempt, from which the store can be made again."""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import orjson

from diagnosis.audit.store.records import SCHEMA, ResultObject, with_number
from diagnosis.results.json_text import dump_json
from replay.errors import OutputError

_NAME = re.compile(r"[0-9a-f]{8}-[0-9a-f]{8}-.+-(?:[0-9]+|m[0-9a-f]{8})\.json")
#: Names of recorded repairs.
REPAIR = re.compile(r"repair-[0-9a-f]{16}\.json")
_TRIES = 10_000


class Objects:
    """A folder of result objects, local or behind a URL; what is in it is never changed.

    Parameters
    ----------
    place : str
        Folder or fsspec URL.
    """

    def __init__(self, place: str) -> None:
        self.place = place
        self._remote = None
        if "://" in place:
            from diagnosis.audit.discovery.remote import file_system

            self._remote, self._root = file_system(place)
        else:
            self._root = place

    def names(self, pattern: re.Pattern[str] = _NAME) -> list[str]:
        """Names of the objects of results, or those of another pattern, sorted; other files are left aside.

        Raises
        ------
        OutputError
            Where the folder cannot be listed.
        """
        try:
            if self._remote is not None:
                found = self._remote.ls(self._root, detail=False) if self._remote.isdir(self._root) else []
                names = [path.rpartition("/")[2] for path in found]
            else:
                names = os.listdir(self._root) if Path(self._root).is_dir() else []  # noqa: PTH208 - names alone
        except OSError as error:
            raise OutputError(f"{self.place}: cannot be listed ({error.strerror or error})") from error
        return sorted(name for name in names if pattern.fullmatch(name))

    def read(self, name: str) -> bytes:
        """Content of an object; raises an `OSError` where it cannot be read."""
        if self._remote is not None:
            content: bytes = self._remote.cat_file(f"{self._root}/{name}")
            return content
        return (Path(self._root) / name).read_bytes()

    def put(self, name: str, content: bytes) -> bool:
        """Write an object whole or not at all; False where one of that name is there.

        Raises
        ------
        OutputError
            Where it cannot be written.
        """
        try:
            if self._remote is not None:
                try:
                    self._remote.pipe_file(f"{self._root}/{name}", content, mode="create")
                except FileExistsError:
                    return False
                return True
            return _put_file(Path(self._root), name, content)
        except OSError as error:
            raise OutputError(
                f"{self.place}/{name}: cannot be written ({error.strerror or error}); earlier results are kept: "
                "make room or give another output folder, then audit again to continue"
            ) from error

    def put_attempt(self, stem: str, document: ResultObject, first: int) -> int:
        """Write an attempt under the first free number.

        Parameters
        ----------
        stem : str
            From `diagnosis.audit.store.keys.Key.stem`.
        document : ResultObject
            Of an attempt, whose number is set here.
        first : int
            Lowest number.

        Returns
        -------
        int
            The number.

        Raises
        ------
        OutputError
            Where it cannot be written.
        """
        for number in range(first, first + _TRIES):
            full: ResultObject = {**with_number(document, number), "schema": SCHEMA}
            if self.put(attempt_name(stem, number), encode(full)):
                return number
        raise OutputError(f"{self.place}: holds {_TRIES} attempts at {stem}; move them away")


def attempt_name(stem: str, number: int) -> str:
    """Name of an attempt's object."""
    return f"{stem}-{number}.json"


def encode(document: Mapping[str, object]) -> bytes:
    """Bytes of a document; the same document gives the same bytes."""
    return dump_json(document, option=orjson.OPT_SORT_KEYS | orjson.OPT_INDENT_2)


def _put_file(folder: Path, name: str, content: bytes) -> bool:
    """Write a file under a temporary name, to the disk, and give it its own; False where that is taken.

    The folder's list of names is left to the system: after a loss of power the store holds what an object's name may lack.
    """
    target = folder / name
    if target.exists():
        return False
    folder.mkdir(parents=True, exist_ok=True)
    temporary = folder / f".{name}.{os.getpid()}-{secrets.token_hex(4)}.part"
    try:
        with temporary.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        try:
            os.link(temporary, target)  # unlike a rename, never replaces
        except FileExistsError:
            return False
        except OSError:  # a file system without links
            if target.exists():
                return False
            temporary.replace(target)
    finally:
        with suppress(OSError):
            temporary.unlink()
    return True
