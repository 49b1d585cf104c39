"""Compiled kernels on disk: those that the sources beside them no longer stand for are removed.

numba keeps what it compiled beside the source and looks at that one file only. A kernel calls others, and takes
named tuples and constants, of other modules of its folder and of those that it imports from; after an update, what was compiled
from the former ones would be run, or could not be loaded at all.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

_KERNELS = (".nbi", ".nbc")
_IMPORTED = re.compile(r"^\s*(?:from|import)\s+([\w.]+)", re.MULTILINE)


def drop_stale_kernels(packages: Iterable[Path], stamp: Path) -> list[str]:
    """Remove compiled kernels of folders whose modules, or those that their kernels take something of, have changed since they were compiled.

    Parameters
    ----------
    packages : Iterable[Path]
        Folders to look through, with all below them.
    stamp : Path
        Small file that remembers the modules; it is written where it is missing or anything has changed.

    Returns
    -------
    list[str]
        Folders whose kernels were removed. Where nothing can be written, everything stays as it is.
    """
    try:
        known = json.loads(stamp.read_bytes())
    except (OSError, ValueError):
        known = {}
    packages = list(packages)
    now = {folder: _digest(folder) for package in packages for folder in _folders(str(package))}
    if known == now:
        return []
    changed = {folder for folder, digest in now.items() if known.get(folder) != digest}
    changed = _and_users(changed, set(now), {Path(package).parent for package in packages})
    with suppress(OSError):
        stamp.parent.mkdir(exist_ok=True)  # Python may be told to write no bytecode
        stamp.write_text(json.dumps(now), "utf-8")  # first: where nothing is remembered, nothing is removed each time
        return [folder for folder in now if folder in changed and _removed(folder)]
    return []


@cache
def drop_own_stale_kernels() -> None:
    """Do so for this installation, once in a process and before the first kernel is loaded."""
    root = Path(__file__).parents[2]
    drop_stale_kernels([root / "replay", root / "diagnosis"], root / "replay" / "__pycache__" / "kernels.json")


def _folders(top: str) -> Iterator[str]:
    yield top
    for entry in os.scandir(top):
        if entry.is_dir() and entry.name != "__pycache__":
            yield from _folders(entry.path)


def _and_users(changed: set[str], folders: set[str], tops: set[Path]) -> set[str]:
    """Changed folders, and those whose kernels import from them or from such a folder."""
    if not changed or changed == folders:
        return changed  # nothing, or all of a new installation
    uses = {folder: _imported(folder, folders, tops) for folder in folders}
    found = set(changed)
    while more := {folder for folder, used in uses.items() if folder not in found and used & found}:
        found |= more
    return found


def _imported(folder: str, folders: set[str], tops: set[Path]) -> set[str]:
    """Folders that the modules with kernels of a folder import from."""
    found = set()
    for path in Path(folder).glob("*.py"):
        text = path.read_text("utf-8", "replace")
        for name in _IMPORTED.findall(text) if "njit" in text else []:
            places = [top.joinpath(*name.split(".")) for top in tops]
            found |= {str(place if str(place) in folders else place.parent) for place in places}
    return found & folders


def _digest(folder: str) -> str:
    """Digest of names, sizes and times of a folder's modules."""
    digest = sha256()
    for entry in sorted(os.scandir(folder), key=lambda e: e.name):
        if entry.name.endswith(".py"):
            found = entry.stat()
            digest.update(f"{entry.name} {found.st_size} {found.st_mtime_ns}\n".encode("utf-8", "surrogateescape"))
    return digest.hexdigest()


def _removed(folder: str) -> bool:
    """Whether a folder had compiled kernels, which are gone now."""
    cache = Path(folder, "__pycache__")
    kernels = [path for path in cache.iterdir() if path.suffix in _KERNELS] if cache.is_dir() else []
    for path in kernels:
        path.unlink(missing_ok=True)
    return bool(kernels)
