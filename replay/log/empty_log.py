"""Logs that hold no sample at all: a recording that ended before its first, or topics on which nothing was published."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from replay.errors import LogError
from replay.log.raw_log import LogSummary, RawLog

_SHOWN = 4
#: Ends of the reason of a signal that is missing although its channel is there.
NO_NUMBER = "holds no number"


def require_messages(summaries: Sequence[LogSummary], logs: Sequence[RawLog]) -> None:
    """Raise where no file holds a message, or a row.

    Parameters
    ----------
    summaries : Sequence[LogSummary]
        By the files' own indices.
    logs : Sequence[RawLog]
        The same files, decoded.

    Raises
    ------
    LogError
        With what to do.
    """
    every = [*summaries, *(log.summary for log in logs)]
    if any(t.count for s in every for t in s.topics) or any(
        c.stamps.size for log in logs for c in log.channels.values()
    ):
        return
    names = ", ".join(dict.fromkeys(s.source for s in summaries))
    topics = list(dict.fromkeys(t.name for s in every for t in s.topics))
    listed = ", ".join(topics[:_SHOWN]) + (", …" if len(topics) > _SHOWN else "")
    what = f"no message on its topics ({listed})" if topics else "no message and no topic"
    damage = next((text for s in every for text in s.damage), "")
    raise LogError(
        f"{names} holds {what}: it was closed before anything was recorded, or nothing was published; look with `ros2 topic hz TOPIC` (ROS 1: "
        f"`rostopic hz TOPIC`) whether messages come, and record again{f' (the log is damaged: {damage})' if damage else ''}"
    )


def without_numbers(missing: Mapping[str, str], names: Iterable[str] | None = None) -> str:
    """What is said of signals whose channels are there and hold no number; empty where there is none.

    Parameters
    ----------
    missing : Mapping[str, str]
        Reason of each signal that is missing.
    names : Iterable[str] or None
        Beginnings of the signals that count; None: all.
    """
    starts = ("",) if names is None else tuple(names)
    empty = [
        why.removesuffix(NO_NUMBER).strip()
        for n, why in missing.items()
        if why.endswith(NO_NUMBER) and n.startswith(starts)
    ]
    empty = list(dict.fromkeys(empty))
    if not empty:
        return ""
    listed = ", ".join(empty[:_SHOWN]) + (", …" if len(empty) > _SHOWN else "")
    return f"{listed} {'is' if len(empty) == 1 else 'are'} in the log, but without one number: look whether the source publishes values, and record again"


def silent_topics(summaries: Iterable[LogSummary]) -> str:
    """Topics of a log on which nothing was published, to follow another sentence; empty where there is none."""
    names = list(dict.fromkeys(t.name for s in summaries for t in s.topics if t.count == 0 and t.encoding != "table"))
    if not names:
        return ""
    listed = ", ".join(names[:_SHOWN]) + (", …" if len(names) > _SHOWN else "")
    return f"; on {listed} nothing was published: look with `ros2 topic hz TOPIC` (ROS 1: `rostopic hz TOPIC`), and record again where the speeds are there"
