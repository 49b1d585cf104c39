"""A mission as an audit found it, and its name: unique, safe as a folder's, and as short as that allows."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.audit.discovery.folder_contents import Unnamed
from diagnosis.audit.discovery.safe_names import unique_names

_URL = re.compile(r"([A-Za-z][A-Za-z0-9+.:-]*)://")


@dataclass(frozen=True)
class MissionSource:
    """One mission as found.

    Attributes
    ----------
    name : str
        Safe as the name of a folder, and unique in the audit also where letter case does not count.
    files : tuple[str, ...]
        Local paths (files, rosbag2 folders) or URLs, in the order in which they are to be read.
    bytes : int
        Size of all files together.
    stamps : tuple[str, ...]
        Of each file: modification time [ns], or the object's ETag or version.
    machine_id : str
        From ``mission.toml``; may be empty.
    machine_file : str or None
        From ``mission.toml``, or the closest ``machine.toml``: the machine file's path.
    sizes : tuple[int, ...]
        Of each file [bytes].
    problem : str
        Why it cannot be audited, of a folder whose ``mission.toml`` is wrong; empty where it can.
    folder : str
        Name of the folder it was found in, where that is not the one of its files' real paths; else empty.
    """

    name: str
    files: tuple[str, ...]
    bytes: int
    stamps: tuple[str, ...]
    machine_id: str = ""
    machine_file: str | None = None
    sizes: tuple[int, ...] = ()
    problem: str = ""
    folder: str = ""


def named_missions(found: Sequence[Unnamed], bases: Sequence[str]) -> list[MissionSource]:
    """Missions with their names, in the order of these.

    Parameters
    ----------
    found : Sequence[Unnamed]
        All missions of an audit.
    bases : Sequence[str]
        Folders that were searched: names begin below what they share, local ones and each kind of URL by themselves.
    """
    base = {scheme: _shared([b for b in bases if _scheme(b) == scheme]) for scheme in map(_scheme, bases)}
    paths = [_paths(one) for one in found]
    names = unique_names([(_below(a, base[_scheme(a)]), _below(b, base[_scheme(b)])) for a, b in paths])
    missions = [
        MissionSource(
            name=name,
            files=tuple(e.path for e in one.files),
            bytes=sum(e.size for e in one.files),
            stamps=tuple(e.stamp for e in one.files),
            machine_id=one.stated.machine_id,
            machine_file=one.stated.machine or one.machine,
            sizes=tuple(e.size for e in one.files),
            problem=one.problem,
            folder=one.linked,
        )
        for one, name in zip(found, names, strict=True)
    ]
    return sorted(missions, key=lambda m: (m.name.casefold(), m.name))


def _paths(one: Unnamed) -> tuple[str, str]:
    """Path of a mission's name, and of the longer one where the first is another mission's too."""
    longer = f"{one.stated.name}-{one.home}" if one.stated.name else one.files[0].name
    return f"{one.folder}/{one.stem}", f"{one.folder}/{longer}"


def _scheme(path: str) -> str:
    """Kind of a URL; empty for local paths, also where a mission's name in them looks like a URL."""
    found = _URL.match(path)
    return found[1] if found else ""


def _shared(bases: Sequence[str]) -> list[str]:
    """Parts of the path that all bases share."""
    parts = [base.replace(os.sep, "/").split("/") for base in bases]
    shared = min(parts, key=len, default=[])
    while any(p[: len(shared)] != shared for p in parts):
        shared = shared[:-1]
    return shared


def _below(path: str, base: Sequence[str]) -> str:
    return "/".join(path.replace(os.sep, "/").split("/")[len(base) :])
