"""Files that can be read more than once, and what cannot; light to import."""

from __future__ import annotations

from pathlib import Path

from replay.errors import LogError


def check_regular(path: Path) -> None:
    """Raise a `LogError` where a path is there, but neither a file nor a folder: reading it might never end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        kinds = {"a pipe": Path.is_fifo, "a socket": Path.is_socket}
        found = next((name for name, holds in kinds.items() if holds(path)), "a device")
        raise LogError(
            f"{path} is not a regular file (found {found}); a log is read more than once, so save it as a file and give that"
        )
