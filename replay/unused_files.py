"""Files that add nothing to a mission, with what to do about them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from replay.errors import LogError, NoLog
from replay.log.empty_log import without_numbers
from replay.log.raw_log import LogSummary
from replay.signals.signal import Signals

_SHOWN = 6
#: What is said of tables that hold nothing of a machine and are too slow to be the log of one.
NO_LOG = "no log of a machine: "
_SLOWEST_S = 10.0  # between two rows of a log
_FEWEST = 20  # rows of a log in which anything could show


class ReadFile(Protocol):
    """What is asked of a file of a mission: see `replay.mission.MissionFile`."""

    @property
    def path(self) -> Path:
        """As given."""

    @property
    def format(self) -> str:
        """As in `LogSummary`."""

    @property
    def summary(self) -> LogSummary:
        """Contents after decoding."""

    @property
    def strange(self) -> bool:
        """Whether it is known to hold nothing of the machine."""

    @property
    def joined(self) -> bool:
        """Whether it is a further part of another file's table."""


def require_use(files: Sequence[ReadFile], signals: Signals) -> None:
    """Raise where no file of a mission holds a signal, or one of several adds none.

    Parameters
    ----------
    files : Sequence[ReadFile]
        All files, after decoding.
    signals : Signals
        What was found in them.

    Raises
    ------
    NoLog
        Where tables that hold no signal are no machine's log.
    LogError
        With the channels that hold no number, the columns of tables that hold no signal, or the file that adds none.
    """
    if not signals.items and (empty := without_numbers(signals.missing)):
        raise LogError(f"{', '.join(str(f.path) for f in files)}: {empty}")
    if not signals.items and all(t.encoding == "table" for f in files for t in f.summary.topics):
        columns = [c for f in files for t in f.summary.topics for c in t.fields if c.strip()]
        shown = f" ({', '.join(columns[:_SHOWN])}{' …' if len(columns) > _SHOWN else ''})" if columns else ""
        if all(_is_slow(f.summary) for f in files):
            raise NoLog(
                f"{', '.join(str(f.path) for f in files)}: {NO_LOG}no column{shown} is called like a signal of a machine, and rows are "
                f"{_SLOWEST_S:g} s and more apart"
            )
        if all(0 < max((t.count for t in f.summary.topics), default=0) < _FEWEST for f in files):
            raise NoLog(
                f"{', '.join(str(f.path) for f in files)}: {NO_LOG}no column{shown} is called like a signal of a machine, and there "
                f"are fewer than {_FEWEST} rows"
            )
        if signals.named_elsewhere:
            raise LogError(f"{', '.join(str(f.path) for f in files)}: no wheel signal: {signals.named_elsewhere}")
        raise LogError(
            f"{', '.join(str(f.path) for f in files)}: no wheel signal: no column{shown} is called like a signal of a machine "
            "or stands in the machine file's [signals]; name them there (`mfhca config init --log LOG` proposes what it can, `mfhca channels "
            "LOG --all` lists them all), or leave the file out where it is no machine's log (an audit takes patterns: 'logs/**/*.mcap')"
        )
    used = {signal.source for signal in signals.items.values()}
    idle = [file for file in files if str(file.path) not in used and not file.strange and not file.joined]
    if len(files) < 2 or not idle or not used:
        return
    raise LogError(
        f"{idle[0].path}: none of its channels is used, all signals were found in the other files; diagnose it by itself, "
        "or name its signals with source = in the machine file's [signals]"
    )


def _is_slow(summary: LogSummary) -> bool:
    """Whether a table's rows are so far apart that no motion shows in them."""
    rows = max((t.count for t in summary.topics), default=0)
    return rows > 1 and (summary.stop_ns - summary.start_ns) * 1e-9 >= _SLOWEST_S * (rows - 1)
