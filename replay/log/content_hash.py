"""What tells the content of files and folders apart: their SHA-256."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

from replay.errors import LogError

_BLOCK = 1 << 22


def content_hash(path: Path) -> tuple[str, int]:
    """SHA-256 and size of a file, or of a folder's relative file names, sizes and contents in order of name.

    Raises
    ------
    LogError
        Where it cannot be read.
    """
    digest = hashlib.sha256()
    try:
        if not path.is_dir():
            size = _feed(digest, path)
            return digest.hexdigest(), size
        total = 0
        for name, file in sorted(_files_below(path)):
            digest.update(name.encode("utf-8", "surrogateescape") + b"\0" + file.stat().st_size.to_bytes(8, "big"))
            total += _feed(digest, file)
        return digest.hexdigest(), total
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error


def _files_below(folder: Path) -> Iterator[tuple[str, Path]]:
    return ((p.relative_to(folder).as_posix(), p) for p in folder.rglob("*") if p.is_file())


def _feed(digest: hashlib._Hash, path: Path) -> int:
    size = 0
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
            size += len(block)
    return size
