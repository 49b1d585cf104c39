"""Whose log it may be that names no machine itself: the machine that alone has judged missions around it.

Where nothing states a machine, a result holds the name of its log's folder. Of a log that was not judged this says
something only where folders bear machines' names: where the judged missions around it are of machines named so.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator

from diagnosis.audit.discovery.identity import telling_folder
from diagnosis.audit.fleet.read import Mission, Result
from diagnosis.audit.store.reason_template import whole_path
from diagnosis.results.vocabulary import Verdict

Owner = tuple[str, str]


def owner_of(result: Result) -> Owner:
    """Identity of a machine; its name where it has none."""
    return result.machine_id, "" if result.machine_id else result.machine_name


class Owners:
    """Machine of each mission of a store.

    Parameters
    ----------
    missions : Iterable[Mission]
        All of them.
    folder : str
        Folder of the store.
    """

    def __init__(self, missions: Iterable[Mission], folder: str) -> None:
        self._store = os.path.realpath(folder)
        self._around: dict[str, dict[Owner, bool]] = {}
        self._entered: set[tuple[str, Owner, bool]] = set()
        self._names: dict[str, tuple[str, ...]] = {}
        self._found: dict[str, tuple[Owner | None, bool]] = {}
        missions = list(missions)
        self._by_copy = {m.result.id for m in missions if m.result is not None and self._by_folder(m)}
        sure, doubtful, others = list[Mission](), list[Mission](), list[Mission]()
        for m in missions:
            if m.result is None or not m.result.judged:
                others.append(m)
            else:
                (doubtful if self._doubtful(m) else sure).append(m)
        for found in (sure, doubtful, others):  # each with what the ones before tell
            self._found |= {m.name: self._seek(m) for m in found}
            for m in found:
                self._enter(m)

    def of(self, mission: Mission) -> tuple[Owner | None, bool]:
        """Its machine, None where that is not known; and whether it may be of another one."""
        return self._found[mission.name]

    def _seek(self, m: Mission) -> tuple[Owner | None, bool]:
        own = owner_of(m.result) if m.result is not None and (m.result.machine_id or m.result.judged) else None
        if own and not self._doubtful(m):
            return own, False
        place = next((f for f in _folders(m) if f in self._around), None)
        owners = self._around[place] if place is not None else {}
        if own and all(owners.values()) and (own in owners or place != next(_folders(m), "")):
            return own, False
        if len(owners) == 1:
            return next(iter(owners)), False
        return own if own in owners else None, True

    def _doubtful(self, m: Mission) -> bool:
        """Whether a result's machine is no more than the name of the folder of a log that was not judged."""
        return m.result is not None and m.result.verdict in (None, Verdict.NOT_ASSESSED) and self._by_folder(m)

    def _enter(self, m: Mission) -> None:
        """Let a judged mission of a known machine tell of the folders around it."""
        owner, _ = self._found[m.name]
        if owner is None or m.result is None or not m.result.judged:
            return
        named = owner == owner_of(m.result) and (self._by_folder(m) or m.result.id in self._by_copy)
        told = next(_folders(m), ""), owner, named
        if told in self._entered:
            return
        self._entered.add(told)
        for folder in _folders(m):
            owners = self._around.setdefault(folder, {})
            owners[owner] = owners.get(owner, True) and named

    def _by_folder(self, m: Mission) -> bool:
        """Whether a result's machine is called as `diagnosis.audit.discovery.identity.fallback_id` calls it, or as its folder."""
        place = next(_folders(m), "")
        names = self._names.get(place)
        if names is None:
            path = whole_path(self._store, m.files[0]) if m.files else ""
            folders = path.replace(os.sep, "/").split("/")[:-1]
            names = self._names[place] = (telling_folder(folders), *folders[-1:])
        return m.result is not None and m.result.machine_id in names


def _folders(mission: Mission) -> Iterator[str]:
    """Folders of a mission's first file, closest first, the last without a name."""
    path = mission.files[0] if mission.files else ""
    while path:
        path = path.rpartition("/")[0]
        yield path
