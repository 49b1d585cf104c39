"""Where a number stands in a message: fields, elements of arrays, and the names that elements have."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TypeAlias


@dataclass
class Scope:
    """Arrays of names inside one message, which key the arrays beside them."""

    parent: Scope | None
    keys: list[tuple[bool, list[str]]] = field(default_factory=list)

    def add(self, fixed: bool, raw: tuple[bytes, ...]) -> None:
        """Take an array of names; `fixed` where its length is part of the definition."""
        self.keys.append((fixed, [r.rstrip(b"\0").decode("utf-8", "replace").strip() for r in raw]))


@dataclass(frozen=True)
class Index:
    """One element of an array; arrays of one length and kind share names."""

    number: int
    length: int
    fixed: bool
    scope: Scope

    def label(self) -> str:
        """Return the element's name in brackets, or its number where none names it."""
        scope: Scope | None = self.scope
        while scope is not None:
            for fixed, names in scope.keys:
                if fixed == self.fixed and len(names) == self.length and len(set(names)) == len(names) and all(names):
                    return f"[{names[self.number]}]"
            scope = scope.parent
        return f"[{self.number}]"


Path: TypeAlias = tuple[str | Index, ...]
Place: TypeAlias = tuple[str | int, ...]


def place_of(path: Path) -> Place:
    """Return a path with plain numbers."""
    return tuple(p.number if isinstance(p, Index) else p for p in path)


def text_of(path: Path) -> str:
    """Return a path as users write it."""
    parts = [p.label() if isinstance(p, Index) else f".{p}" for p in path]
    return "".join(parts).removeprefix(".")


_KEYS = re.compile(r"(^|_)(names?|joints?|labels?|symbols?|keys?)$|Names?$|Symbols?$", re.ASCII)


def is_key_list(label: str) -> bool:
    """Whether a field of this name, an array of text, names elements: ``name``, ``joint_names``, ``varNames``."""
    return _KEYS.search(label) is not None
