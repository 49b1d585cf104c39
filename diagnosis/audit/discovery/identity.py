"""Which machine a mission belongs to: stated, in the log, in the machine file, else the name of the folder that tells machines apart."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from diagnosis.audit.discovery.mission_source import MissionSource

if TYPE_CHECKING:
    from replay.machine.config import Machine

_YEAR = r"(19|20)\d\d"
_CLOCK = r"([T _-]+\d{1,2}([-_.:h]?\d\d){0,2}Z?)?"
_DATE = re.compile(
    rf"{_YEAR}|{_YEAR}[-_.]?\d\d([-_.]?\d\d)?{_CLOCK}|\d\d?[-_.]\d\d?[-_.]{_YEAR}{_CLOCK}|{_YEAR}[-_. ]?(kw|w|week)[-_ ]?\d\d?",
    re.I,
)
_PART_OF_DATE = re.compile(r"\d\d?|(kw|w|week|day)[-_ ]?\d\d?|[a-z]{3,9}", re.I)  # below a date: a month, a week, a day
_MONTHS = frozenset(
    ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec", "mrz", "mai", "okt", "dez")
)
_USUAL = frozenset(
    (
        *(
            "log",
            "logs",
            "bag",
            "bags",
            "rosbag",
            "rosbags",
            "data",
            "raw",
            "recording",
            "recordings",
            "records",
            "export",
        ),
        *(
            "exports",
            "csv",
            "mcap",
            "missions",
            "drives",
            "runs",
            "daten",
            "messungen",
            "aufnahmen",
            "fahrten",
            "messdaten",
        ),
    )
)


def given_id(option: str | None, mission: MissionSource) -> str | None:
    """Identity by ``--machine-id``, else by ``mission.toml``; None: what `diagnose` finds in log and machine file."""
    return option or mission.machine_id or None


def fallback_id(mission: MissionSource) -> str:
    """Name of the closest folder around the mission that tells machines apart: the identity where nothing else states one."""
    first = mission.files[0].rstrip("/")
    url = "://" in first
    folder = PurePosixPath(first.partition("://")[2]).parent if url else Path(first).parent.resolve()
    if mission.folder and not _says_nothing((folder.parent.name, mission.folder)):
        return _plain(mission.folder)
    return _plain(telling_folder(folder.parts))


def telling_folder(folders: Sequence[str]) -> str:
    """The last of some nested folders that is no date (``2026-03-01``, ``2026/03``) and no usual word (``bags``, ``logs``).

    Where all are, it is the last one. Numbers alone may be machines, unless they stand below a year.

    Parameters
    ----------
    folders : Sequence[str]
        Names from the outermost to that of the mission's folder.
    """
    names = [name for name in folders if name.strip("/\\")]
    for end in range(len(names), 0, -1):
        if not _says_nothing(names[:end]):
            return names[end - 1]
    return names[-1] if names else ""


def _says_nothing(names: Sequence[str]) -> bool:
    """Whether the last of some nested folders is called as any folder of logs is, or by a date."""
    return names[-1].casefold() in _USUAL or _dated(names)


def _dated(names: Sequence[str]) -> bool:
    """Whether the last of some nested folders is called by a date, or below one by a part of it: ``03`` in ``2026``."""
    *above, last = names
    if _DATE.fullmatch(last):
        return True
    part = _PART_OF_DATE.fullmatch(last) and (not last.isalpha() or last[:3].casefold() in _MONTHS)
    return bool(part) and bool(above) and _dated(above)


def _plain(name: str) -> str:
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def stated_id(option: str | None, mission: MissionSource, machine: Machine) -> str:
    """What a mission's key (`diagnosis.audit.store.keys.config_hash`) holds of its machine's identity.

    The log's own statement is part of its content, and the machine file's of that.
    """
    given = given_id(option, mission)
    return f"given:{given}" if given else "" if machine.id else f"folder:{fallback_id(mission)}"
