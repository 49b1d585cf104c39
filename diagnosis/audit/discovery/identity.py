"""Which machine a mission belongs to: stated, in the log, in the machine file, else the folder's name."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from diagnosis.audit.discovery.missions import MissionSource

if TYPE_CHECKING:
    from replay.machine.config import Machine


def given_id(option: str | None, mission: MissionSource) -> str | None:
    """Identity by ``--machine-id``, else by ``mission.toml``; None: what `diagnose` finds in log and machine file."""
    return option or mission.machine_id or None


def fallback_id(mission: MissionSource) -> str:
    """Name of the folder that the mission was found in: the identity where nothing else states one."""
    first = mission.files[0].rstrip("/")
    url = "://" in first
    folder = PurePosixPath(first.partition("://")[2]).parent if url else Path(first).parent.resolve()
    return (mission.folder or folder.name).encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def stated_id(option: str | None, mission: MissionSource, machine: Machine) -> str:
    """What a mission's key (`diagnosis.audit.store.keys.config_hash`) holds of its machine's identity.

    The log's own statement is part of its content, and the machine file's of that.
    """
    given = given_id(option, mission)
    return f"given:{given}" if given else "" if machine.id else f"folder:{fallback_id(mission)}"
