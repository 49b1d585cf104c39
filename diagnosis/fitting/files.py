"""Which of the logs given to a fit are files of one mission."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from replay.errors import LogError
from replay.log.file_types import TABLE_ENDINGS, split_ending
from replay.log.source_options import SourceOptions
from replay.readers.registry import summarise_log
from replay.signals.together import Extent, are_together


def missions_of_files(paths: Sequence[Path]) -> list[list[Path]]:
    """Files by mission, in their order: tables of one folder that begin and end together and hold other columns are of one.

    Parameters
    ----------
    paths : Sequence[Path]
        Logs of one machine.
    """
    out: list[list[Path]] = []
    extents: list[list[Extent]] = []
    for path in paths:
        own = _extent(path)
        place = None
        if own is not None:
            place = next(
                (k for k, e in enumerate(extents) if e and out[k][0].parent == path.parent and are_together([*e, own])),
                None,
            )
        if place is None:
            out.append([path])
            extents.append([] if own is None else [own])
        else:
            assert own is not None
            out[place].append(path)
            extents[place].append(own)
    return out


def _extent(path: Path) -> Extent | None:
    """When a table begins and ends; None for other logs, and for one that cannot be read: reading it says why."""
    if split_ending(path.name)[1] not in TABLE_ENDINGS or path.is_dir():
        return None
    try:
        summary = summarise_log(path, SourceOptions())
    except LogError:
        return None
    columns = frozenset(f for t in summary.topics for f in t.fields)
    return Extent(summary.start_ns, summary.stop_ns, columns)
