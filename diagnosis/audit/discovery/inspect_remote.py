"""Logs behind URLs for `mfhca inspect`: of an MCAP file only its index is fetched, others are copied whole."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from diagnosis.audit.discovery.discover import discover
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.discovery.remote import file_system
from diagnosis.audit.discovery.remote_mcap import fetched_index
from diagnosis.audit.discovery.staging import stage
from replay.errors import LogError
from replay.inspection.mcap_index import mcap_index
from replay.inspection.report import InspectReport
from replay.log.file_types import split_ending


def logs_at(urls: Sequence[str]) -> tuple[list[MissionSource], list[str], int]:
    """Logs behind URLs, each by itself; why there is none behind some; and how many objects are no logs.

    Raises
    ------
    ConfigError
        Where the kind of URL is not known, or its package is not installed.
    """
    found = discover(urls)
    logs = [
        replace(mission, files=(file,), stamps=(stamp,), sizes=(size,), bytes=size)
        for mission in found.missions
        for file, stamp, size in zip(mission.files, mission.stamps, mission.sizes, strict=True)
    ]
    return logs, list(found.problems), found.left_aside


def inspect_remotely(log: MissionSource, inspect: Callable[[Path], InspectReport], clock: str | None) -> InspectReport:
    """Inspect a log behind a URL.

    Parameters
    ----------
    log : MissionSource
        From `logs_at`.
    inspect : Callable[[Path], InspectReport]
        Inspects a local log.
    clock : str or None
        Clock that a full reading would use, where the index suffices; None: read the log whole.

    Raises
    ------
    LogError
        Where it cannot be read.
    """
    (url,) = log.files
    seen = _by_index(url, log.bytes, clock) if clock is not None and split_ending(url)[1] == ".mcap" else None
    if seen is None:
        with tempfile.TemporaryDirectory(prefix="mfhca-") as folder:
            (local,) = stage(log, Path(folder)).paths
            try:
                seen = inspect(local)
            except LogError as error:
                raise LogError(str(error).replace(str(local), url)) from error
    return replace(seen, source=url)


def _by_index(url: str, size: int, clock: str) -> InspectReport | None:
    system, path = file_system(url)
    try:
        with fetched_index(system, path, size) as local:
            return mcap_index(local, clock)
    except LogError:  # reading it whole tells why
        return None
