"""Walk through folders and collect their missions, by the rule of `diagnosis.audit.discovery.missions`."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Sequence
from dataclasses import replace

from diagnosis.audit.discovery.folder_contents import Unnamed
from diagnosis.audit.discovery.listing import Entry, LocalPlace, Place
from diagnosis.audit.discovery.missions import MACHINE_FILE, is_log, is_mission, missions_in, missions_of
from replay.log.file_types import LOG_ENDINGS


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
    packed : list[str]
        Files among those left aside that may hold logs, such as archives.
    bases : list[str]
        Folders to which missions' names are relative.
    """

    def __init__(self, exclude: str) -> None:
        self.problems: list[str] = []
        self.roots: list[str] = []
        self.notes: list[str] = []
        self.bases: list[str] = []
        self.left_aside = 0
        self.packed: list[str] = []
        self._machines: dict[str, str] = {}
        self._around: dict[str, str | None] = {}
        self._exclude = exclude
        self._found: list[Unnamed] = []
        self._links: list[Entry] = []
        self._seen: set[str] = set()
        self._unlisted: list[str] = []
        self._linked = False

    def missions(self) -> list[Unnamed]:
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
                self.bases += [os.path.realpath(_fixed(word))] if hits else []
            if not hits:
                self.problems.append(f"{word}: matches no file")
            for hit in hits:
                self._sort_out(place, hit, typed, files, folders)
        self.search(place, files, folders)

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
            elif is_mission(place, parent):
                folders.append(parent)
            elif typed or is_log(place, entry):
                files.append(entry)
            else:
                self.left_aside += 1

    def search(self, place: Place, files: Sequence[Entry], folders: Sequence[Entry]) -> None:
        """Search folders, then take single files."""
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
            machine = self._machine_around(place, home)
            self._add(replace(one, machine=machine) for one in missions_of(place, home, list(held.values())))

    def _machine_around(self, place: Place, folder: str) -> str | None:
        """Path of the ``machine.toml`` in a folder or the closest one around it, searched or not; None where there is none."""
        passed, found = list[str](), None
        while folder:
            if folder in self._around:
                found = self._around[folder]
                break
            passed.append(folder)
            beside = place.beside(folder, MACHINE_FILE)
            if beside is not None:
                found = beside.path
                break
            above = place.parent(folder)
            folder = above if above != folder else ""
        self._around.update(dict.fromkeys(passed, found))
        return found

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
                    f"{link.path}: skipped: the link leads to {link.real}, which is outside of the given folders; give that too"
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
                self.problems.append(f"{folder.path}: cannot be listed ({error.strerror or error})")
                self._unlisted.append(folder.real)
                continue
            alone = alone or (one and folder is top)
        return alone

    def _enter(self, place: Place, folder: Entry, waiting: list[Entry]) -> bool:
        """Take the missions of one folder; whether it is itself one."""
        files, folders = place.listed(folder)
        self.problems += place.lost(folder)
        found = missions_in(place, folder, files, folders, self._exclude)
        self.problems += found.problems
        self.notes += found.notes
        self.left_aside += found.left_aside
        self.packed += found.packed
        above = self._machines.get(place.parent(folder.path)) or self._machine_around(place, place.parent(folder.real))
        machine = found.machine or above
        if machine is not None:
            self._machines[folder.path] = machine
        self._unlisted += found.unread
        self._links += found.links
        waiting += found.below
        self._add(replace(one, machine=machine) for one in found.missions)
        return found.is_mission

    def _add(self, missions: Iterable[Unnamed]) -> None:
        """Take missions; of those behind a link to a folder, with the name of the folder that their files are in."""
        for one in missions:
            home = os.path.basename(os.path.dirname(one.files[0].path)) if self._linked else ""  # noqa: PTH119, PTH120
            self._found.append(replace(one, linked=home))


def _fixed(pattern: str) -> str:
    """The folder in front of the first part of a pattern that is one."""
    folder = pattern
    while glob.has_magic(folder):
        folder = os.path.dirname(folder)  # noqa: PTH120
    return folder or os.curdir


def _below(path: str, folder: str) -> bool:
    """Whether a real path is a folder or in it."""
    return path == folder or path.startswith(folder.rstrip(os.sep) + os.sep)
