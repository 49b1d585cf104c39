"""Reasons of results that copies of a mission share: the files that a reason names are replaced by each copy's own."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class ReasonTemplate:
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

    def for_files(self, shown: Sequence[str]) -> str:
        """The reason for a mission whose files are shown like this."""
        text = self.text
        for path, place in self.named:
            if place < len(shown):
                text = _as_word(path).sub(lambda _, own=shown[place]: own, text)  # type: ignore[misc]
        return text


def reason_template(reason: str, theirs: Iterable[Sequence[str]], folder: str) -> ReasonTemplate:
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
            for name in (whole, os.path.relpath(whole)):
                if name in reason and _as_word(name).search(reason):
                    named.setdefault(name, place)
    return ReasonTemplate(reason, tuple(named.items()))


def whole_path(folder: str, path: str) -> str:
    """A path as the store holds it, from the root on; URLs stay."""
    return path if "://" in path else os.path.normpath(os.path.join(folder, path))  # noqa: PTH118


def _as_word(path: str) -> re.Pattern[str]:
    return re.compile(rf"(?<![\w./\\-]){re.escape(path)}(?![\w/\\-]|\.\w)")
