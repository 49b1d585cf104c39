"""From the words of a command line to the logs behind them."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from replay.log.file_types import LOG_ENDINGS, is_result, words_of


@dataclass
class FoundLogs:
    """Logs behind the words of a command line.

    Attributes
    ----------
    paths : list[Path]
        Files and rosbag2 folders, each once, in the given order; those in folders sorted.
    missing : list[str]
        Words behind which nothing was found, with the reason.
    left_aside : int
        Files in given folders that are no logs.
    urls : list[str]
        Words that are URLs, as given.
    """

    paths: list[Path]
    missing: list[str]
    left_aside: int = 0
    urls: list[str] = field(default_factory=list)


def find_logs(words: Iterable[str], *, urls: bool = False) -> FoundLogs:
    """Expand files, folders, globs and ``-`` (paths on stdin, one per line); URLs are taken as they are where asked for."""
    found = FoundLogs([], [])
    seen: set[Path] = set()
    for word in words_of(words):
        path = Path(word)
        if "://" in word:
            if urls:
                found.urls.append(word)
            else:
                found.missing.append(f"{word}: only audit and inspect read URLs; copy the log here and give the copy")
            continue
        if path.exists():
            hits = [path]
        elif glob.has_magic(word):
            hits = [Path(p) for p in sorted(glob.glob(word, recursive=True))]  # noqa: PTH207 - absolute patterns too
        else:
            hits = []
        logs = [log for hit in hits for log in _logs_at(hit, found)]
        if not hits:
            found.missing.append(f"{word}: no such file" if not glob.has_magic(word) else f"{word}: matches no file")
        elif not logs:
            found.missing.append(f"{word}: holds no log ({', '.join(LOG_ENDINGS)} or a rosbag2 folder)")
        for log in logs:
            if (real := log.resolve()) not in seen:
                seen.add(real)
                found.paths.append(log)
    return found


def _logs_at(path: Path, found: FoundLogs) -> Iterator[Path]:
    """Yield a file itself, a rosbag2 folder as one log, or the logs in a folder and below; links to folders are not followed."""
    if not path.is_dir() or (path / "metadata.yaml").is_file():
        yield path
        return
    for child in sorted(path.iterdir()):
        if child.is_dir():
            if not child.is_symlink() and not child.name.startswith("."):
                yield from _logs_at(child, found)
        elif child.name.lower().endswith(LOG_ENDINGS) and not child.name.startswith(".") and not is_result(child):
            yield child
        else:
            found.left_aside += 1
