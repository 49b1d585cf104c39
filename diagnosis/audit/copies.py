"""Copies of a mission under other names: found before anything is diagnosed, so that each content is diagnosed once."""

from __future__ import annotations

import hashlib
import os
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from diagnosis.audit.discovery.identity import fallback_id
from diagnosis.audit.discovery.missions import MissionSource
from diagnosis.audit.plan import Planned, hashes_of, known_hashes
from diagnosis.audit.store.store import Store
from diagnosis.audit.task import key_of
from replay.errors import LogError
from replay.mission import content_hash

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
            for same in _by_fingerprint([one.mission for one in group]).values():
                for mission in same if held or len(same) > 1 else ():
                    _hash(mission, store)
    first: dict[tuple[object, ...], Planned] = {}
    copies = []
    for one in planned:
        hashes = known_hashes(one, store)
        key = key_of(one.mission, hashes, one.machine, one.config_hash) if hashes else one.mission.name
        if first.setdefault((key,), one) is not one:
            copies.append(one)
    return list(first.values()), copies


def with_originals_machines(
    missions: Sequence[MissionSource], store: Store, *, read: bool = True
) -> list[MissionSource]:
    """Let copies of a log in other folders belong to one machine: that of the folder with the most logs.

    Only missions whose machine no file states are looked at, and only those whose files have the size, first and last bytes of
    others' are read for it.

    Parameters
    ----------
    missions : Sequence[MissionSource]
        All missions of an audit.
    store : Store
        Holds hashes, and takes those of what was read.
    read : bool
        Whether files are read; else only what the store knows counts.
    """
    owners = Counter(fallback_id(m) for m in missions)
    alike: dict[tuple[int, ...], list[MissionSource]] = defaultdict(list)
    for m in missions:
        if m.bytes and not m.machine_id and not m.problem and not any("://" in name for name in m.files):
            alike[m.sizes].append(m)
    moved: dict[str, tuple[str, str | None]] = {}
    for group in alike.values():
        if len({fallback_id(m) for m in group}) < 2:
            continue
        contents: dict[tuple[str, ...], list[MissionSource]] = defaultdict(list)
        for same in _by_fingerprint(group).values():
            for m in same if len(same) > 1 else ():
                if read:
                    _hash(m, store)
                contents[hashes_of(m, store) or (m.name,)].append(m)
        for copies in contents.values():
            owner = max(sorted({fallback_id(m) for m in copies}), key=lambda name: owners[name])
            original = next(m for m in copies if fallback_id(m) == owner)
            moved |= {m.name: (owner, original.machine_file) for m in copies if fallback_id(m) != owner}
    return [_moved(m, *moved[m.name]) if m.name in moved else m for m in missions]


def _moved(mission: MissionSource, folder: str, machine_file: str | None) -> MissionSource:
    """A copy with its original's folder and machine file."""
    return replace(mission, folder=folder, machine_file=mission.machine_file or machine_file)


def _by_fingerprint(group: Sequence[MissionSource]) -> dict[object, list[MissionSource]]:
    """Missions by the first and last bytes of their files; those that cannot be read each by itself."""
    out: dict[object, list[MissionSource]] = defaultdict(list)
    for mission in group:
        try:
            out[tuple(_fingerprint(Path(name)) for name in mission.files)].append(mission)
        except OSError:
            out[mission.name].append(mission)
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


def _hash(mission: MissionSource, store: Store) -> None:
    """Hash a mission's files; one that cannot be read is left to its attempt, which says why."""
    if hashes_of(mission, store) or any("://" in name for name in mission.files):
        return
    try:
        hashes = [content_hash(Path(name))[0] for name in mission.files]
    except LogError:
        return
    for name, size, stamp, sha256 in zip(mission.files, mission.sizes, mission.stamps, hashes, strict=True):
        store.remember_hash(name, size, stamp, sha256)
