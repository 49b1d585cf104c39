"""Folders that rosbag2 made and that lost their ``metadata.yaml``: one recording, and no machine of its own.

Recorders write it when they stop, so that it is missing where power was cut; copying single files loses it too.
"""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.audit.discovery.listing import Entry, Place
from replay.log.file_types import part_of, split_ending

_SQLITE = (".db3", ".db3.zstd")
_MCAP = (".mcap", ".mcap.zstd")
_OWN = ("mission.toml", "machine.toml")


def is_unlisted_bag(
    place: Place, folder: Entry, files: Sequence[Entry], folders: Sequence[Entry], *, beside: bool = False
) -> bool:
    """Whether all that a folder holds are parts of one rosbag2 recording (``run7/run7_0.db3``).

    Parameters
    ----------
    place : Place
        Where it is.
    folder : Entry
        The folder.
    files, folders : Sequence[Entry]
        What is in it.
    beside : bool
        Whether the folders beside it are recordings: then it may be called otherwise than its parts.
    """
    seen = [f for f in files if not f.name.startswith(".")]
    if not seen or any(not f.name.startswith(".") for f in folders) or any(f.name in _OWN for f in seen):
        return False
    logs = [f for f in seen if split_ending(f.name)[1]]
    parts = [part_of(f.name) for f in logs]
    named = {(p[0], p[2]) for p in parts if p is not None}
    if None in parts or len(named) != 1:
        return False
    stem, ending = next(iter(named))
    if ending not in (*_SQLITE, *_MCAP) or not (beside or stem == folder.name):
        return False
    return ending in _SQLITE or len(logs) == 1 or place.continuous(logs)


def lost_metadata(place: Place, folder: Entry, *, beside: bool = False) -> bool:
    """Whether a folder that was not listed yet is one; one that cannot be listed is left to the search, which says so."""
    try:
        files, folders = place.listed(folder)
    except OSError:
        return False
    return is_unlisted_bag(place, folder, files, folders, beside=beside)


def unlisted_note(folder: Entry) -> str:
    """What is said of such a folder."""
    return (
        f"{folder.path}: taken for one ROS 2 bag without metadata.yaml, of the machine of the folder around it; "
        "if the folder is a machine itself, put a mission.toml with its machine_id into it (`ros2 bag reindex` writes metadata.yaml)"
    )
