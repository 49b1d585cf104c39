"""The folder that a conversion of a log writes: its index, and how it takes the place of an earlier one."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal, TypedDict

from replay.errors import OutputError

INDEX = "index.json"
SCHEMA = "mfhca-raw/1"


class RawColumn(TypedDict):
    """One channel of a file."""

    name: str
    field: str
    dtype: str
    unit: str | None


class RawFile(TypedDict):
    """One file: channels of a topic that have the same stamps [ns]."""

    file: str
    topic: str
    type: str
    rows: int
    first_ns: int | None
    last_ns: int | None
    columns: list[RawColumn]


class RawHead(TypedDict):
    """Where the numbers come from; every file holds it too."""

    schema: str
    source: str
    sha256: str
    bytes: int
    format: str
    clock: str
    start_ns: int
    stop_ns: int


class RawIndex(RawHead):
    """``index.json``."""

    status: Literal["ok", "degraded"]
    damage: list[str]
    notes: list[str]
    files: list[RawFile]


def refuse_foreign_folder(folder: Path, *, force: bool) -> None:
    """Raise an `OutputError` where a place holds something that no conversion wrote.

    Parameters
    ----------
    folder : Path
        Place to write to.
    force : bool
        Whether a folder with other files will do.
    """
    if folder.suffix.lower() in (".parquet", ".csv", ".mcap"):
        raise OutputError(
            f"{folder}: a folder is to be written, one file for each topic; give a name without an ending"
        )
    if not folder.exists():
        return
    if not folder.is_dir():
        raise OutputError(f"{folder}: is a file, a folder is to be written; give another name")
    if not force and any(folder.iterdir()) and not _is_own(folder):
        raise OutputError(f"{folder}: holds other files; give a new folder, or --force to write among them")


def _is_own(folder: Path) -> bool:
    """Whether a folder holds an earlier conversion and nothing else."""
    try:
        index = json.loads((folder / INDEX).read_text(encoding="utf-8"))
        files = {INDEX, *(str(f["file"]) for f in index["files"])}
        return index["schema"] == SCHEMA and {p.name for p in folder.iterdir()} <= files
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """Give a temporary folder beside the one to write; what is left of it in the end is removed."""
    temporary = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    folder.parent.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(temporary, ignore_errors=True)
    temporary.mkdir()
    try:
        yield temporary
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def place(temporary: Path, folder: Path) -> None:
    """Put a finished folder where it belongs: in place of an earlier conversion, else file by file, the index last."""
    if folder.exists() and _is_own(folder):
        old = folder.with_name(f".{folder.name}.{os.getpid()}.old")
        folder.rename(old)
        temporary.rename(folder)
        shutil.rmtree(old, ignore_errors=True)
    elif folder.exists():
        for file in sorted(temporary.iterdir(), key=lambda p: p.name == INDEX):
            file.replace(folder / file.name)
    else:
        temporary.rename(folder)
