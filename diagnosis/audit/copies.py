"""Copies of a mission under other names: found before anything is diagnosed, so that each content is diagnosed once."""

from __future__ import annotations

import hashlib
import os
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from diagnosis.audit.plan import Planned, known_hashes
from diagnosis.audit.store.store import Store
from diagnosis.audit.task import key_of
from replay.errors import LogError
from replay.log.content_hash import content_hash

_END_BYTES = 1 << 16


def without_copies(planned: Sequence[Planned], store: Store) -> tuple[list[Planned], list[Planned]]:
    """Part missions that are to be diagnosed from copies of them.

    Only missions whose files have the size, first and last bytes of others' are read for it.

    Parameters
    ----------
    planned : Sequence[Planned]
        Missions without a result.
    store : Store
        Takes the hashes of what was read.

    Returns
    -------
    tuple[list[Planned], list[Planned]]
        The first mission of each content, and the others: once the first has a result, it is theirs too. What is a copy
        of a mission that the store holds has that one's result at once.
    """
    sizes = {row[0] for row in store.database.rows("SELECT DISTINCT size FROM file")}
    alike: dict[tuple[object, ...], list[Planned]] = defaultdict(list)
    for one in planned:
        alike[one.config_hash, one.mission.sizes].append(one)
    for group in list(alike.values()):
        held = all(size in sizes for size in group[0].mission.sizes)
        if held or len(group) > 1:
            for same in _by_fingerprint(group).values():
                for one in same if held or len(same) > 1 else ():
                    _hash(one, store)
    first: dict[tuple[object, ...], Planned] = {}
    copies = []
    for one in planned:
        hashes = known_hashes(one, store)
        key = key_of(one.mission, hashes, one.machine, one.config_hash) if hashes else one.mission.name
        if first.setdefault((key,), one) is not one:
            copies.append(one)
    return list(first.values()), copies


def _by_fingerprint(group: Sequence[Planned]) -> dict[object, list[Planned]]:
    """Missions by the first and last bytes of their files; those that cannot be read each by itself."""
    out: dict[object, list[Planned]] = defaultdict(list)
    for one in group:
        try:
            out[tuple(_fingerprint(Path(name)) for name in one.mission.files)].append(one)
        except OSError:
            out[one.mission.name].append(one)
    return out


def _fingerprint(path: Path) -> str:
    if path.is_dir():
        names = sorted((p.relative_to(path).as_posix(), p.stat().st_size) for p in path.rglob("*") if p.is_file())
        return repr(names)
    digest = hashlib.sha256()
    with path.open("rb") as file:
        digest.update(file.read(_END_BYTES))
        file.seek(max(0, file.seek(0, os.SEEK_END) - _END_BYTES))
        digest.update(file.read(_END_BYTES))
    return digest.hexdigest()


def _hash(one: Planned, store: Store) -> None:
    """Hash a mission's files; one that cannot be read is left to its attempt, which says why."""
    mission = one.mission
    if known_hashes(one, store) or any("://" in name for name in mission.files):
        return
    try:
        hashes = [content_hash(Path(name))[0] for name in mission.files]
    except LogError:
        return
    for name, size, stamp, sha256 in zip(mission.files, mission.sizes, mission.stamps, hashes, strict=True):
        store.remember_hash(name, size, stamp, sha256)
