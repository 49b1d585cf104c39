"""Reasons of results that several missions share, in terms of each one's own files."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class SharedReason:
    """A reason, and the files that it names.

    Attributes
    ----------
    text : str
        As the mission that was diagnosed met it.
    named : tuple[tuple[str, int], ...]
        Each file as the text names it, and its place in the mission's list of files.
    """

    text: str
    named: tuple[tuple[str, int], ...]

    def of(self, shown: Sequence[str]) -> str:
        """The reason for a mission whose files are shown like this."""
        text = self.text
        for said, place in self.named:
            if place < len(shown):
                text = _as_word(said).sub(lambda _, own=shown[place]: own, text)  # type: ignore[misc]
        return text


def shared_reason(reason: str, theirs: Iterable[Sequence[str]], folder: str) -> SharedReason:
    """Find which of the missions' files a reason names.

    Parameters
    ----------
    reason : str
        Of the result that they share.
    theirs : Iterable[Sequence[str]]
        Files of each mission with that result, as the store holds them.
    folder : str
        Real path of the store's folder.
    """
    named: dict[str, int] = {}
    for files in theirs:
        for place, path in enumerate(files):
            if "://" in path or os.path.basename(path) not in reason:  # noqa: PTH119
                continue
            whole = whole_path(folder, path)
            for said in (whole, os.path.relpath(whole)):
                if said in reason and _as_word(said).search(reason):
                    named.setdefault(said, place)
    return SharedReason(reason, tuple(named.items()))


def whole_path(folder: str, path: str) -> str:
    """A path as the store holds it, from the root on; URLs stay."""
    return path if "://" in path else os.path.normpath(os.path.join(folder, path))  # noqa: PTH118


def _as_word(path: str) -> re.Pattern[str]:
    return re.compile(rf"(?<![\w./\\-]){re.escape(path)}(?![\w/\\-]|\.\w)")
