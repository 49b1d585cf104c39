"""The parts of a split ROS 1 bag: which there are, and their summaries as one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from pathlib import Path

from replay.border import bordered
from replay.errors import LogError
from replay.log.file_types import part_of
from replay.log.raw_log import LogSummary, TopicInfo

_MOST_GAPS = 5


def parts_in(folder: Path) -> list[Path]:
    """Parts of the one split bag that a folder holds, in their order; empty where it holds anything else."""
    if (folder / "metadata.yaml").is_file():
        return []
    files = [p for p in folder.iterdir() if p.name.lower().endswith(".bag") and p.is_file()]
    named = [(part_of(p.name), p) for p in files]
    parts = sorted((n[1], p) for n, p in named if n is not None)
    bases = {n[0] if n else "" for n, _ in named}
    return [p for _, p in parts] if len(bases) == 1 and len(parts) == len(files) else []


def over_parts(folder: Path, read: Callable[[Path], LogSummary]) -> LogSummary:
    """Read part after part; a part that cannot be read, or is missing, is damage to the whole.

    Raises
    ------
    LogError
        Where no part can be read.
    """
    found: list[LogSummary] = []
    lost: list[str] = []
    parts = parts_in(folder)
    numbers = [n[1] for p in parts if (n := part_of(p.name)) is not None]
    gaps = islice((n for a, b in pairwise(numbers) for n in range(a + 1, b)), _MOST_GAPS)
    lost += [f"{folder.name}: part {number} of the split bag is missing" for number in gaps]
    for part in parts:
        try:
            with bordered(part, "bag"):
                found.append(read(part))
        except LogError as error:
            lost.append(str(error))
    if not found:
        raise LogError(f"{folder} holds no part that can be read: {'; '.join(lost[:3])}")
    filled = [s for s in found if s.stop_ns] or found
    return replace(
        found[0],
        source=str(folder),
        start_ns=min(s.start_ns for s in filled),
        stop_ns=max(s.stop_ns for s in filled),
        topics=_topics(found),
        notes=tuple(dict.fromkeys(text for s in found for text in s.notes)),
        damage=(*lost, *(text for s in found for text in s.damage)),
    )


def _topics(summaries: Sequence[LogSummary]) -> tuple[TopicInfo, ...]:
    """Topics of all parts with their messages added up."""
    topics: dict[tuple[str, str, str], TopicInfo] = {}
    for info in (t for s in summaries for t in s.topics):
        known = topics.get(key := (info.name, info.type_name, info.encoding))
        topics[key] = replace(info, count=info.count + known.count) if known else info
    return tuple(topics.values())
