"""What one folder holds, as `diagnosis.audit.discovery.missions` finds it: missions without their final names, and the rest."""

from __future__ import annotations

from dataclasses import dataclass, field

from diagnosis.audit.discovery.listing import Entry
from diagnosis.audit.discovery.mission_file import MissionFile


@dataclass(frozen=True)
class Unnamed:
    """A mission before it has its name.

    Attributes
    ----------
    folder, stem : str
        The folder its name is made of, and its stem there.
    files : tuple[Entry, ...]
        Its files.
    stated : MissionFile
        What ``mission.toml`` says.
    home : str
        Name of the folder with the ``mission.toml``.
    problem : str
        What is wrong with that; empty where nothing is.
    linked : str
        Name of the folder its files are in, where a link to a folder leads to them.
    machine : str or None
        Path of the closest ``machine.toml``.
    """

    folder: str
    stem: str
    files: tuple[Entry, ...]
    stated: MissionFile = field(default_factory=MissionFile)
    home: str = ""
    problem: str = ""
    linked: str = ""
    machine: str | None = None


@dataclass
class FolderContents:
    """What one folder holds.

    Attributes
    ----------
    missions : list[Unnamed]
        Its missions.
    is_mission : bool
        Whether it is itself one.
    below, links : list[Entry]
        Folders, and links to folders, that are still to be looked through.
    left_aside : int
        Files that are no logs, or results of earlier runs.
    notes, problems : list[str]
        What is to be known, and recordings that cannot be read, one sentence each.
    unread : list[str]
        Real paths of these recordings.
    packed : list[str]
        Files among those left aside that may hold logs, such as archives.
    machine : str or None
        Path of its ``machine.toml``.
    """

    missions: list[Unnamed] = field(default_factory=list)
    is_mission: bool = False
    below: list[Entry] = field(default_factory=list)
    links: list[Entry] = field(default_factory=list)
    left_aside: int = 0
    notes: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)
    packed: list[str] = field(default_factory=list)
    machine: str | None = None
