"""Machine files of missions that have none in or above their folder: those of copies of them, and of their machine; and what is said of the rest."""

from __future__ import annotations

import hashlib
import os
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from diagnosis.audit.discovery.identity import fallback_id
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.discovery.missions import MACHINE_FILE

_SHOWN = 3
_PIECE = 1 << 20


def with_machine_files(
    missions: Sequence[MissionSource], machine_id: str = ""
) -> tuple[tuple[MissionSource, ...], tuple[str, ...]]:
    """Missions with the machine file that each is judged by, and one sentence for each kind of those that have none of their own.

    A copy of a log, such as one in a folder of backups, has machine file and machine of the log that it is a copy of. Any other one has
    the machine file of its machine's logs, where these have one and the same.

    Parameters
    ----------
    missions : Sequence[MissionSource]
        As found.
    machine_id : str
        Identity of all missions; empty: their own.
    """
    own = [m for m in missions if m.machine_file is not None]
    bare = [m for m in missions if m.machine_file is None]
    if not bare:
        return tuple(missions), ()
    of_machine: dict[str, set[str]] = defaultdict(set)
    for m in own:
        of_machine[machine_id or m.machine_id or fallback_id(m)].add(str(m.machine_file))
    originals = dict(_copied(bare, own))
    lent = {name: str(original.machine_file) for name, original in originals.items()}
    for m in bare:
        known = of_machine.get(machine_id or m.machine_id or fallback_id(m), set())
        if m.name not in lent and len(known) == 1:
            lent[m.name] = next(iter(known))
    out = tuple(
        _as_original(m, originals[m.name])
        if m.name in originals
        else replace(m, machine_file=lent.get(m.name, m.machine_file))
        for m in missions
    )
    return out, tuple(_sentences([m for m in out if m.machine_file is None and not m.problem], lent))


def _as_original(copy: MissionSource, original: MissionSource) -> MissionSource:
    """A copy with the machine file and the machine of its original."""
    machine = copy.machine_id or original.machine_id
    return replace(copy, machine_file=original.machine_file, machine_id=machine, folder=fallback_id(original))


def _sentences(bare: Sequence[MissionSource], lent: dict[str, str]) -> Iterable[str]:
    """What is to be known of missions without a machine file of their own."""
    if bare:
        one = len(bare) == 1
        yield (
            f"no machine file: {_few([m.files[0] for m in bare])} {'is' if one else 'are'} judged as the paper's Haulotte, as there is no "
            f"{MACHINE_FILE} in or above {'its folder' if one else 'their folders'} and -m is not given; "
            f"mfhca config init --log LOG -o FOLDER/{MACHINE_FILE} writes one"
        )
    for file in dict.fromkeys(lent.values()):
        names = [name for name, of in lent.items() if of == file]
        have, their = ("has", "its") if len(names) == 1 else ("have", "their")
        yield f"{_few(names)} {have} no {MACHINE_FILE} in or above {their} folder and {have} that of the same machine: {file}"


def _few(names: Sequence[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more


def _copied(bare: Sequence[MissionSource], own: Sequence[MissionSource]) -> Iterable[tuple[str, MissionSource]]:
    """Names of missions that are byte for byte others, and these, where all of them have one machine file; only files of the same sizes are read."""
    sizes = {m.sizes for m in bare}
    alike: dict[tuple[int, ...], list[MissionSource]] = defaultdict(list)
    for m in own:
        if m.sizes in sizes:
            alike[m.sizes].append(m)
    for m in bare:
        if not (others := alike.get(m.sizes)) or not (content := _content(m)):
            continue
        same = [other for other in others if _content(other) == content]
        if same and len({other.machine_file for other in same}) == 1:
            yield m.name, same[0]


def _content(mission: MissionSource) -> str:
    """SHA-256 of all that is in a mission's files; empty where they are remote or cannot be read."""
    if any("://" in name for name in mission.files):
        return ""
    digest = hashlib.sha256()
    try:
        for name in mission.files:
            path = Path(name)
            inside = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
            for file in inside:
                digest.update(os.fsencode(file.relative_to(path)) if path.is_dir() else b"")
                with file.open("rb") as opened:
                    while piece := opened.read(_PIECE):
                        digest.update(piece)
    except OSError:
        return ""
    return digest.hexdigest()
