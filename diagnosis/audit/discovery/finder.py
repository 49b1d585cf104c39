"""Look through folders for missions; see `diagnosis.audit.discovery.discover`."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

from diagnosis.audit.discovery.grouping import Group, group, holes
from diagnosis.audit.discovery.listing import Entry, LocalPlace, Place
from diagnosis.audit.discovery.mission_file import NAME as MISSION_FILE
from diagnosis.audit.discovery.mission_file import MissionFile, read_mission_file, stated_machine
from replay.errors import ConfigError
from replay.log.file_types import LOG_ENDINGS, split_ending

_METADATA = "metadata.yaml"
_AUDIT = "fleet.sqlite"
_AUDIT_FOLDERS = ("missions", "results")
_AUDIT_FILES = ("fleet.csv", "failures.txt")
_REPORT = {"report.json", "report.parquet"}
_TABLES = ("report.parquet", "report.windows.parquet")
_CLIPS = "clips"


@dataclass(frozen=True)
class Found:
    """A mission before it has its name.

    Attributes
    ----------
    folder, stem : str
        The folder its name is made of, and its stem there.
    files : tuple[Entry, ...]
        Its files.
    told : MissionFile
        What ``mission.toml`` says.
    home : str
        Name of the folder with the ``mission.toml``.
    problem : str
        What is wrong with that; empty where nothing is.
    linked : str
        Name of the folder its files are in, where a link to a folder leads to them.
    """

    folder: str
    stem: str
    files: tuple[Entry, ...]
    told: MissionFile
    home: str = ""
    problem: str = ""
    linked: str = ""


class Finder:
    """Collects missions.

    Parameters
    ----------
    exclude : str
        Real path of the folder of the audit's own results; empty: none.

    Attributes
    ----------
    problems, roots, notes : list[str]
        As in `Discovery`.
    left_aside : int
        As in `Discovery`.
    bases : list[str]
        Folders to which missions' names are relative.
    """

    def __init__(self, exclude: str) -> None:
        self.problems: list[str] = []
        self.roots: list[str] = []
        self.notes: list[str] = []
        self.bases: list[str] = []
        self.left_aside = 0
        self._exclude = exclude
        self._found: list[Found] = []
        self._links: list[Entry] = []
        self._seen: set[str] = set()
        self._unlisted: list[str] = []
        self._linked = False

    def missions(self) -> list[Found]:
        """Missions found so far: each file in the first of them, where links stand behind what they lead to."""
        taken: set[str] = set()
        out = []
        for found in sorted(self._found, key=lambda f: any(e.link for e in f.files)):
            files = {e.real: e for e in reversed(found.files) if e.real not in taken}
            if files:
                out.append(replace(found, files=tuple(e for e in found.files if files.get(e.real) is e)))
                taken.update(files)
        return out

    def local(self, words: Sequence[str]) -> None:
        """Find what local words stand for."""
        place = LocalPlace()
        files, folders = list[Entry](), list[Entry]()
        for word in words:
            hits, typed = [word], True
            if not os.path.lexists(word) and glob.has_magic(word):
                hits, typed = sorted(glob.glob(word, recursive=True)), False  # noqa: PTH207 - absolute patterns too
            if not hits:
                self.problems.append(f"{word}: matches no file")
            for hit in hits:
                self._sort_out(place, hit, typed, files, folders)
        self.look(place, files, folders)

    def _sort_out(self, place: LocalPlace, path: str, typed: bool, files: list[Entry], folders: list[Entry]) -> None:
        """Put a path to the files or folders to look at; a file of a recording's folder stands for the folder."""
        try:
            entry = place.entry(path)
        except FileNotFoundError:
            self.problems.append(f"{path}: no such file")
        except (OSError, ValueError) as error:
            self.problems.append(f"{path}: {getattr(error, 'strerror', None) or error}")
        else:
            parent = place.entry(place.parent(path))
            if place.is_folder(entry):
                folders.append(entry)
            elif not place.is_file(entry):
                self.problems.append(f"{path}: is not a regular file; save it as a file and give that")
            elif self._has(place, parent, _METADATA) or self._has(place, parent, MISSION_FILE):
                folders.append(parent)
            elif typed or self._is_log(place, entry):
                files.append(entry)
            else:
                self.left_aside += 1

    def look(self, place: Place, files: Sequence[Entry], folders: Sequence[Entry]) -> None:
        """Look through folders, then at single files."""
        empty = set()
        for folder in dict.fromkeys(folders):
            before = len(self._found), len(self.problems)
            alone = self._walk(place, folder)
            self.bases.append(place.parent(folder.real) if alone else folder.real)
            if (len(self._found), len(self.problems)) == before:
                empty.add(folder)
        self._follow(place, [folder.real for folder in folders])
        reals = [e.real for found in self._found for e in found.files] if empty else []
        for folder in dict.fromkeys(folders):
            if folder in empty and not any(_below(real, folder.real) for real in reals):
                self.problems.append(f"{folder.path}: holds no log ({', '.join(LOG_ENDINGS)} or a rosbag2 folder)")
            elif not any(_below(real, folder.real) for real in self._unlisted):
                self.roots.append(folder.path)
        together: dict[str, dict[str, Entry]] = {}
        for file in files:
            together.setdefault(place.home(file), {}).setdefault(file.real, file)
        for home, held in together.items():
            self.roots += [file.path for file in held.values()]
            self.bases.append(home)
            self._add(home, group(place, list(held.values())))

    def _follow(self, place: Place, roots: Sequence[str]) -> None:
        """Look through what links to folders lead to, within the given folders, and only what was not looked through."""
        self._linked = True
        while self._links:
            link = self._links.pop(0)
            if link.real in self._seen or (self._exclude and _below(link.real, self._exclude)):
                continue
            if any(_below(link.real, root) for root in roots):
                self._walk(place, link)
            else:
                self.notes.append(
                    f"{link.path}: left aside, as the link leads to {link.real}, which is outside of what was given; give that too"
                )
        self._linked = False

    def _walk(self, place: Place, top: Entry) -> bool:
        """Look through a folder and those below; whether it is itself one mission."""
        waiting, alone = [top], False
        while waiting:
            folder = waiting.pop()
            if self._linked and folder.real in self._seen:
                continue
            self._seen.add(folder.real)
            try:
                one = self._enter(place, folder, waiting)
            except OSError as error:
                self.problems.append(f"{folder.path}: cannot be looked through ({error.strerror or error})")
                self._unlisted.append(folder.real)
                continue
            alone = alone or (one and folder is top)
        return alone

    def _enter(self, place: Place, folder: Entry, waiting: list[Entry]) -> bool:
        """Take the missions of one folder; whether it is itself one."""
        files, found = place.listed(folder)
        folders = [child for child in found if not child.link]
        self.problems += place.lost(folder)
        names = {f.name: f for f in files}
        if MISSION_FILE in names:
            self._stated(place, folder, names[MISSION_FILE], files, folders)
            return True
        if _METADATA in names:
            self._add(place.parent(folder.real), [Group(folder.name, (place.whole(folder),))])
            return True
        recordings = []
        for child in found:
            if child.name.startswith(".") or self._own(folder, names, child):
                continue
            if child.link:
                self._links.append(child)
            elif self._has(place, child, _METADATA) and not self._has(place, child, MISSION_FILE):
                recordings += self._whole(place, child)
            else:
                waiting.append(child)
        logs = self._logs(place, folder, files)
        self.notes += holes(logs)
        self._add(folder.real, group(place, logs, recordings))
        return False

    def _own(self, folder: Entry, names: dict[str, Entry], child: Entry) -> bool:
        """Whether a folder holds results: of this audit, of another one, or clips of a report."""
        if _AUDIT in names or folder.real == self._exclude:
            return child.name in _AUDIT_FOLDERS
        return child.real == self._exclude or (child.name == _CLIPS and names.keys() >= _REPORT)

    def _logs(self, place: Place, folder: Entry, files: Sequence[Entry]) -> list[Entry]:
        """Logs among the files of a folder; counts the others."""
        names = {f.name for f in files}
        own = _AUDIT_FILES if _AUDIT in names or folder.real == self._exclude else ()
        logs = []
        for file in files:
            result = file.name in own or (file.name in _TABLES and names >= _REPORT)
            if not result and self._is_log(place, file):
                logs.append(file)
            else:
                self.left_aside += 1
        return logs

    def _is_log(self, place: Place, file: Entry) -> bool:
        ending = split_ending(file.name)[1]
        return bool(ending) and not file.name.startswith(".") and (ending != ".txt" or place.is_log(file))

    def _has(self, place: Place, folder: Entry, name: str) -> bool:
        found = place.inside(folder, name)
        return found is not None and not place.is_folder(found)

    def _stated(
        self, place: Place, folder: Entry, file: Entry, files: Sequence[Entry], folders: Sequence[Entry]
    ) -> None:
        """Take the mission that a ``mission.toml`` describes; one that is off makes a mission with a problem."""
        told, problem = MissionFile(), ""
        try:
            told = read_mission_file(place, folder, file)
        except ConfigError as error:
            told, problem = MissionFile(machine_id=stated_machine(place, file)), str(error)
        logs = list(told.files)
        if not logs and self._has(place, folder, _METADATA):
            logs = self._whole(place, folder)
        elif not logs:
            recordings = [e for c in folders if self._has(place, c, _METADATA) for e in self._whole(place, c)]
            logs = [e for g in group(place, self._logs(place, folder, files), recordings) for e in g.files]
        if not logs:
            problem = problem or f"{file.path}: there is no log beside it; name the mission's files in it"
        if problem:
            logs.append(file)
        found = Found(place.parent(folder.real), told.name or folder.name, tuple(logs), told, folder.name, problem)
        self._found.append(replace(found, linked=self._folder_of(found.files)))

    def _whole(self, place: Place, folder: Entry) -> list[Entry]:
        """A recording's folder as one log, if all that is in it can be looked at."""
        try:
            return [place.whole(folder)]
        except OSError as error:
            self.problems.append(f"{folder.path}: the recording cannot be looked through ({error.strerror or error})")
            self._unlisted.append(folder.real)
            return []

    def _folder_of(self, files: Sequence[Entry]) -> str:
        return os.path.basename(os.path.dirname(files[0].path)) if self._linked else ""  # noqa: PTH119, PTH120

    def _add(self, folder: str, groups: Sequence[Group]) -> None:
        self._found += [
            Found(folder, found.stem, found.files, MissionFile(), linked=self._folder_of(found.files))
            for found in groups
        ]


def _below(path: str, folder: str) -> bool:
    """Whether a real path is a folder or in it."""
    return path == folder or path.startswith(folder.rstrip(os.sep) + os.sep)
