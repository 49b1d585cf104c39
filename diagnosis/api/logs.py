"""A log's channels as pandas tables, exactly as recorded: each topic on its own clock, texts as text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Literal

from diagnosis.api.errors import stated
from diagnosis.api.inputs import MachineLike, StrPath, check_times, machine_given, path_of
from diagnosis.pages.labels import visible
from replay.errors import ConfigError

if TYPE_CHECKING:
    import pandas as pd

    from replay.log.raw_log import RawLog

CLOCKS = ("header", "log", "publish")
_SHOWN = 40


class Log(Mapping[str, "pd.DataFrame"]):
    """A recorded log: a table per topic, by its name; of a table file, one per set of stamps (``group 1``, …).

    Each table has shape (samples, fields). It is indexed by ``time`` (UTC, the log's nanoseconds) in recorded order; its
    columns are fields as recorded (``velocity[fr_wheel]``), numbers in the recorded type, texts as text. ``attrs["units"]`` has
    the units that the log states, ``attrs["type"]`` the message type. A field that a message does not hold is missing (NaN).
    """

    def __init__(self, log: RawLog) -> None:
        self._log = log

    @cached_property
    def _frames(self) -> dict[str, pd.DataFrame]:
        from replay.frames import log_frames

        return log_frames(self._log)

    def __getitem__(self, topic: str) -> pd.DataFrame:
        return self._frames[topic]

    def __iter__(self) -> Iterator[str]:
        return iter(self._frames)

    def __len__(self) -> int:
        return len(self._frames)

    @property
    def format(self) -> str:
        """Container: ``mcap``, ``bag``, ``rosbag2``, ``twincat``, ``csv``, ``parquet``, ``tdms``."""
        return self._log.format

    @property
    def damage(self) -> tuple[str, ...]:
        """What was lost and why, one sentence each; empty where the log is whole."""
        return self._log.summary.damage

    @property
    def notes(self) -> tuple[str, ...]:
        """Unusual but harmless facts, such as topics that cannot be decoded, one sentence each."""
        return self._log.summary.notes

    @property
    def metadata(self) -> dict[str, str]:
        """Key-value pairs that the log holds."""
        return dict(self._log.summary.metadata)

    @cached_property
    def topics(self) -> pd.DataFrame:
        """What the log holds, shape (topics, 4), indexed by ``name``: ``type``, ``messages``, ``encoding``, ``note``."""
        import pandas as pd

        infos = self._log.summary.topics
        rows = [(t.type_name, t.count, t.encoding, t.note) for t in infos]
        index = pd.Index([t.name for t in infos], name="name", dtype="object")
        return pd.DataFrame(rows, index=index, columns=["type", "messages", "encoding", "note"])

    @property
    def channels(self) -> pd.DataFrame:
        """Every channel, shape (channels, 6), indexed by ``name``: ``topic``, ``field``, ``type``, ``unit``, ``samples``, ``dtype``."""
        import pandas as pd

        found = self._log.channels.values()
        rows = [(c.topic, c.field, c.type_name, c.unit, len(c.stamps), str(c.values.dtype)) for c in found]
        index = pd.Index([c.name for c in found], name="name", dtype="object")
        return pd.DataFrame(rows, index=index, columns=["topic", "field", "type", "unit", "samples", "dtype"])

    def __repr__(self) -> str:
        state = "degraded" if self.damage else "whole"
        return f"<Log {self._log.source}: {self.format}, {len(self._log.channels)} channels in {len(self)} tables, {state}>"

    def _repr_html_(self) -> str:
        """What a notebook shows: the tables, and what was lost."""
        rows = [
            f"<tr><td style='text-align: left'>{escape(visible(name))}</td><td>{len(frame)}</td><td>{frame.shape[1]}</td></tr>"
            for name, frame in list(self._frames.items())[:_SHOWN]
        ]
        more = f"<div>… and {len(self) - _SHOWN} more</div>" if len(self) > _SHOWN else ""
        lost = "".join(f"<li>{escape(visible(text))}</li>" for text in self.damage)
        damage = f"<div><b>Degraded</b>: the log is damaged</div><ul>{lost}</ul>" if lost else ""
        head = "<tr><th style='text-align: left'>table</th><th>samples</th><th>fields</th></tr>"
        name = escape(visible(self._log.source))
        return f"<div><b>{name}</b> ({self.format})</div>{damage}<table>{head}{''.join(rows)}</table>{more}"


@stated
def read_log(
    path: StrPath,
    *,
    topics: Iterable[str] | None = None,
    start_s: float | None = None,
    stop_s: float | None = None,
    clock: Literal["header", "log", "publish"] | None = None,
    machine: MachineLike = None,
) -> Log:
    """Read a log as it was recorded, of any format that `mfhca` reads.

    Parameters
    ----------
    path : str or Path
        File or rosbag2 folder.
    topics : Iterable[str] or None
        Topics to decode; None: all. Tables have none and ignore it.
    start_s, stop_s : float or None
        Part of the log [s from its first stamp].
    clock : str or None
        Stamps of messages: ``header``, ``log`` (when they were recorded) or ``publish``; None: the machine file's, else header.
    machine : str, Path, Machine or None
        Machine whose ``[sources]`` say how a file that does not describe itself is read.

    Returns
    -------
    Log
        Tables by topic, with `Log.damage` and `Log.notes`.

    Raises
    ------
    LogError
        Where nothing in the log can be read; damage to a part is in `Log.damage` instead.
    ConfigError
        Where an option is wrong, or a topic is not in the log.
    """
    from replay.mission import source_options
    from replay.readers.registry import read_log as read
    from replay.readers.registry import summarise_log

    place = path_of(path)
    check_times(start_s, stop_s, ("start_s", "stop_s"))
    if clock is not None and clock not in CLOCKS:
        raise ConfigError(f"clock = {clock!r} is not known; expected one of {', '.join(CLOCKS)}")
    options = source_options(place, machine_given(machine)[0])
    wanted = None if topics is None else [topics] if isinstance(topics, str) else list(topics)
    window = None
    if wanted is not None or start_s is not None or stop_s is not None:
        summary = summarise_log(place, options)
        known = {t.name for t in summary.topics}
        missing = [t for t in wanted or () if t not in known]
        if missing and not any(t.encoding == "table" for t in summary.topics):
            raise ConfigError(f"{place}: holds no topic {missing[0]!r}; it has {', '.join(sorted(known)) or 'none'}")
        if start_s is not None or stop_s is not None:
            last = summary.stop_ns + 1 if stop_s is None else summary.start_ns + round(stop_s * 1e9)
            window = summary.start_ns + round((start_s or 0.0) * 1e9), last
    return Log(read(place, options, wanted, clock, window, texts=True))
