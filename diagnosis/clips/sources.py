"""The MCAP logs of a mission, from which clips copy messages, and how their log stamps lie against the mission's clock."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.export.clips.source import ClipSource
from replay.log.reading_notes import Report
from replay.mission import Mission, MissionFile
from replay.readers.rosbag2.parts import find_parts
from replay.signals.signal import Signals

Stamps = NDArray[np.int64]
APART_S = 0.1
UNREADABLE = "Without original messages:"


@dataclass(frozen=True)
class Source:
    """One log of a mission.

    Attributes
    ----------
    parts : tuple[ClipSource, ...]
        Its files.
    mission_ns, log_ns : NDArray[np.int64], each of shape (n,)
        Moments on the mission's clock, and the log stamps of the messages that hold them; empty where not known.
    """

    parts: tuple[ClipSource, ...]
    mission_ns: Stamps
    log_ns: Stamps

    def places(self, ns: Stamps) -> Stamps:
        """Log stamps of moments of the mission; beyond both ends the clocks run alike. Both in ns, shape (k,)."""
        a, b = self.mission_ns, self.log_ns
        if not a.size:
            return ns
        inside = np.interp((ns - a[0]).astype(np.float64), (a - a[0]).astype(np.float64), b - b[0])
        inner = b[0] + np.round(inside).astype(np.int64)
        out: Stamps = np.where(ns < a[0], ns - a[0] + b[0], np.where(ns > a[-1], ns - a[-1] + b[-1], inner))
        return out

    @property
    def apart_s(self) -> float:
        """How far the log's clock is from the mission's [s]."""
        return float(np.median(self.log_ns - self.mission_ns)) * 1e-9 if self.mission_ns.size else 0.0


def open_sources(mission: Mission, scratch: Path, notes: list[str]) -> Iterator[Source]:
    """Open the logs of a mission whose messages can be copied; `notes` takes what cannot.

    Parameters
    ----------
    mission : Mission
        The mission.
    scratch : Path
        Folder for expanded files; must stay as long as the sources are used.
    notes : list[str]
        Takes one sentence per log that is left out or whose clock differs from the mission's.
    """
    for file in mission.files:
        try:
            paths = _mcap_files(file, scratch)
            if not paths:
                notes.append(
                    f"{file.path.name}: its messages cannot be copied into MCAP; its clips hold the mapped signals alone."
                )
                continue
            stamps, topic = _longest(mission.signals, str(file.path))
            parts = tuple(ClipSource(path, topic) for path in paths)
        except LogError as error:
            notes.append(f"{UNREADABLE} {error}")
            continue
        source = Source(parts, *_paired(stamps, np.sort(np.concatenate([p.log_stamps for p in parts]))))
        if abs(source.apart_s) >= APART_S:
            notes.append(
                f"{file.path.name}: its log stamps are {source.apart_s:+.3f} s from the mission's clock; the clips keep them."
            )
        yield source


def _mcap_files(file: MissionFile, scratch: Path) -> list[Path]:
    """MCAP files of a log; none where it is of another format, or its messages are compressed one by one."""
    if file.format == "mcap":
        return [file.path]
    if file.format != "rosbag2":
        return []
    paths, meta = find_parts(file.path, Report(), scratch)
    copied = meta.facts.get("compression_mode") != "message" and all(p.suffix == ".mcap" for p in paths)
    return paths if copied else []


def _longest(signals: Signals, source: str) -> tuple[Stamps, str]:
    """Stamps and topic of a file's signal with the most samples."""
    own = [s for s in signals.items.values() if s.source == source and s.origin.topic is not None]
    if not own:
        return np.empty(0, np.int64), ""
    best = max(own, key=lambda s: s.stamps.size)
    return best.stamps, str(best.origin.topic)


def _paired(stamps: Stamps, log: Stamps) -> tuple[Stamps, Stamps]:
    """Messages of a topic in order of either clock; where some were left out, the rest is spread evenly."""
    count = min(stamps.size, log.size)
    if count < 2:
        return stamps[:0], stamps[:0]
    if stamps.size == log.size:
        return stamps, log
    a, b = (np.linspace(0, x.size - 1, count).round().astype(np.int64) for x in (stamps, log))
    return stamps[a], log[b]
