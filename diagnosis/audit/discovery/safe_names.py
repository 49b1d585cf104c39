"""Names of missions: safe as names of folders everywhere, unique, and as close to what was found as that allows."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence

_MOST_BYTES = 100
_UNSAFE = re.compile(r"[^\w.+@=-]+")
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
_MARK = 6


def safe_name(path: str) -> str:
    """One folder name for a relative path: its parts joined by ``__``, other signs than letters, digits and ``._+@=-`` replaced.

    Long names keep their end, which tells missions apart, behind a mark of the whole.
    """
    parts = [_UNSAFE.sub("_", unicodedata.normalize("NFC", part)).strip("_ ") for part in re.split(r"[/\\]", path)]
    name = "__".join(part for part in parts if part.strip("._")).lstrip(".-").rstrip(".")
    name = name or f"mission-{_digest(path)}"
    if len(name.encode()) > _MOST_BYTES:
        end = name.encode()[_MARK + 2 - _MOST_BYTES :].decode(errors="ignore")
        name = f"{_digest(path)}__{end.lstrip('._-')}"
    return f"_{name}" if _RESERVED.fullmatch(name) else name


def is_safe(name: str) -> bool:
    """Whether a text is a name such as these functions give: one part of a path, nothing hidden or reserved."""
    return (
        not _UNSAFE.search(name)
        and bool(name.strip("._"))
        and not name.startswith((".", "-"))
        and not name.endswith(".")
        and not _RESERVED.fullmatch(name)
        and len(name.encode()) <= 2 * _MOST_BYTES
    )


def unique_names(paths: Sequence[tuple[str, str]]) -> list[str]:
    """Safe names of missions, unique also where letter case does not count.

    Parameters
    ----------
    paths : Sequence[tuple[str, str]]
        Relative path without ending, and with it. All those whose names would be the same get their ending, and where that
        does not help a mark of the path, so that none depends on the others' order.
    """
    names = [safe_name(stem) for stem, _ in paths]
    for marked in (False, True):
        count = Counter(name.casefold() for name in names)
        names = [
            name if count[name.casefold()] == 1 else f"{name}-{_digest(path)}" if marked else safe_name(path)
            for name, (_, path) in zip(names, paths, strict=True)
        ]
    taken: set[str] = set()
    for i, (_, path) in enumerate(paths):  # a marked name may be what another mission is called by itself
        while names[i].casefold() in taken:
            names[i] = f"{names[i]}-{_digest(f'{names[i]}/{path}')}"
        taken.add(names[i].casefold())
    return names


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()[:_MARK]
