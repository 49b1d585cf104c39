"""Reasons of results that several missions share, in terms of each one's own files."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence


def whole_path(folder: str, path: str) -> str:
    """A path as the store holds it, from the root on; URLs stay."""
    return path if "://" in path else os.path.normpath(os.path.join(folder, path))  # noqa: PTH118


def own_reason(
    reason: str, theirs: Iterable[Sequence[str]], own: Sequence[str], shown: Sequence[str], folder: str
) -> str:
    """Reason of a result for one of the missions that share it: it names that mission's files, not its copies'.

    Parameters
    ----------
    reason : str
        As the mission that was diagnosed met it.
    theirs : Iterable[Sequence[str]]
        Files of each mission with that result, as the store holds them.
    own, shown : Sequence[str]
        Files of this mission, as the store holds them and as they are to be shown.
    folder : str
        Real path of the store's folder.
    """
    for files in theirs:
        for path, mine, name in zip(files, own, shown, strict=False):
            if "://" in path or path == mine:
                continue
            whole = whole_path(folder, path)
            for said in dict.fromkeys((whole, os.path.relpath(whole))):
                at = re.compile(rf"(?<![\w./\\-]){re.escape(said)}(?![\w/\\-]|\.\w)")
                reason = at.sub(lambda _, name=name: name, reason)  # type: ignore[misc]
    return reason
