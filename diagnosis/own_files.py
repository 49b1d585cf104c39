"""Files that another program, or a person, put where a result is to stand: they are not replaced."""

from __future__ import annotations

from pathlib import Path

from replay.errors import ConfigError

_MARKS = {"report.html": b"mfhca", "report.json": b"mfhca-report", "report.parquet": b"PAR1"}
_READ = 1 << 20  # bytes in which the mark of a file of this tool stands


def check_replaced(folder: Path) -> None:
    """Raise where a result would replace a file that this tool did not write.

    Parameters
    ----------
    folder : Path
        Where a result is to be written.

    Raises
    ------
    ConfigError
        Where a file of a result's name is none of this tool's.
    """
    for name, mark in _MARKS.items():
        path = folder / name
        try:
            with path.open("rb") as file:
                start = file.read(_READ)
        except OSError:
            continue  # not there, or said by whoever writes
        if start and mark not in start:
            raise ConfigError(
                f"{path}: was not written by mfhca and was not replaced; move it away, or give another folder with -o"
            )
