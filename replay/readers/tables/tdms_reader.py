"""TDMS files of LabVIEW and the like, through npTDMS, which is an extra."""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.log.raw_log import Channel, Clock, LogSummary, RawLog, TopicInfo, Window
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.tables.columns import compressed, pick
from replay.readers.tables.time_cells import TimeBase, epoch_ns
from replay.readers.tables.time_column import rises

MISSING_LIBRARY = "npTDMS is not installed, which reads TDMS; install it with: pip install 'mfhca-replay[tdms]'"
_TIME = ("time", "timestamp", "time stamp", "t", "zeit")


class TdmsReader:
    """Reader of TDMS files."""

    format = "tdms"

    def matches(self, path: Path) -> bool:
        """Whether the file starts with the tag of a TDMS segment."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(4) == b"TDSm"

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List groups and channels from the metadata; time channels alone are looked at.

        Raises
        ------
        LogError
            Where npTDMS is absent or the file cannot be read.
        """
        return self._log(path, options, "header", None, Report(), decode=False).summary

    def read(
        self,
        path: Path,
        options: SourceOptions,
        topics: Collection[str] | None = None,
        clock: Clock = "header",
        window: Window | None = None,
        store: ColumnStore | None = None,
        texts: bool = False,
    ) -> RawLog:
        """Read all channels of numbers.

        Raises
        ------
        LogError
            Where npTDMS is absent, the file cannot be read, or none of its channels has a time.
        """
        report = Report(store=store or ColumnStore())
        return self._log(path, options, clock, window, report, decode=True, texts=texts)

    def _log(
        self,
        path: Path,
        options: SourceOptions,
        clock: Clock,
        window: Window | None,
        report: Report,
        decode: bool,
        texts: bool = False,
    ) -> RawLog:
        channels: dict[str, Channel] = {}
        topics: list[TopicInfo] = []
        ends: list[int] = []
        untimed: list[str] = []
        with _opened(path, report) as file:
            size, cut = path.stat().st_size, bool(report.damage)
            for group in file.groups():
                times = _GroupTimes(path, group, options, report)
                members, count = [], 0
                for channel in group.channels():
                    label = f"{group.name}/{channel.name}"
                    if channel is times.channel or not (_is_number(channel) or (texts and _is_text(channel))):
                        continue
                    if len(channel) * channel.dtype.itemsize > 16 * size:
                        raise LogError(
                            f"{path}: {label} declares {len(channel)} samples, far more than its {size} bytes can hold; the "
                            "file is damaged, copy or record it again"
                        )
                    stamps = times.of(channel)
                    if stamps is None:
                        untimed.append(label)
                        continue
                    members.append(label)
                    count = max(count, len(stamps))
                    if len(stamps):
                        ends += [int(stamps.min()), int(stamps.max())]
                    if decode:
                        channels[label] = _channel(label, channel, stamps, window, times)
                if cut:
                    _tell_short(path, group, report)
                topics.append(TopicInfo(group.name, "table", count, "table", tuple(members)))
        if untimed:
            report.lost(
                f"{path.name}: {len(untimed)} channels have no time (neither wf_increment nor a time channel of the same "
                f"length in their group) and were left out: {', '.join(untimed[:6])}"
            )
        if not any(t.fields for t in topics) and report.damage and not untimed:
            raise LogError(f"{path} holds no whole samples: {report.damage[0]}; copy or record it again")
        if not any(t.fields for t in topics):
            raise LogError(
                f"{path}: none of its channels has a time; give [sources] time = the name of the time channel, or record "
                "waveforms"
            )
        if decode:
            ends = [f(c.stamps) for c in channels.values() if len(c.stamps) for f in (_least, _most)]
        said = tuple(report.notes), tuple(report.damage)
        start, stop = (min(ends), max(ends)) if ends else (0, 0)
        summary = LogSummary(str(path), self.format, start, stop, tuple(topics), *said)
        return RawLog(str(path), self.format, clock, channels, summary, report.store)


def _tell_short(path: Path, group: Any, report: Report) -> None:
    """Name the channels of a group that a file which was cut off holds in part or not at all."""
    numbers = [c for c in group.channels() if c.dtype is not None and c.dtype.kind in "iufb"]
    longest = max((len(c) for c in numbers), default=0)
    none = [c.name for c in numbers if not len(c)]
    short = [f"{c.name} ({len(c)} of {longest} samples)" for c in numbers if 0 < len(c) < longest]
    for names, what in ((none, "lost"), (short, "shorter than others of the group")):
        if names:
            more = f" and {len(names) - 12} more" if len(names) > 12 else ""
            report.lost(
                f"{path.name}, group {group.name!r}: {len(names)} channels are {what}: {', '.join(names[:12])}{more}"
            )


def _least(stamps: NDArray[np.int64]) -> int:
    return int(stamps.min())


def _most(stamps: NDArray[np.int64]) -> int:
    return int(stamps.max())


class _Warnings(logging.Handler):
    """Takes what npTDMS would print: a file that was cut off is read as far as it goes, and said here alone."""

    def __init__(self, path: Path, report: Report) -> None:
        super().__init__(logging.WARNING)
        self.path, self.report = path, report

    def emit(self, record: logging.LogRecord) -> None:
        """Report a warning as a loss."""
        said = " ".join(record.getMessage().split())[:160]
        self.report.lost(f"{self.path.name} is cut off or damaged; npTDMS reports: {said}")


@contextmanager
def _opened(path: Path, report: Report) -> Iterator[Any]:
    try:
        import nptdms  # type: ignore[import-untyped,import-not-found,unused-ignore]
        from nptdms.log import log_manager  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError as error:
        raise LogError(f"{path}: {MISSING_LIBRARY}") from error
    logger, handler = logging.getLogger("nptdms"), _Warnings(path, report)
    level = log_manager.console_handler.level
    log_manager.console_handler.setLevel(logging.CRITICAL + 1)
    logger.addHandler(handler)
    try:
        with path.open("rb") as file, nptdms.TdmsFile.open(file) as tdms:
            yield tdms
    except LogError:
        raise
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error
    except Exception as error:  # npTDMS raises anything on damaged files, even bare exceptions
        said = " ".join(str(error).split())[:200]
        raise LogError(f"{path} is a damaged TDMS file ({said}); copy or record it again") from error
    finally:
        logger.removeHandler(handler)
        log_manager.console_handler.setLevel(level)


def _is_number(channel: Any) -> bool:
    kind = channel.dtype
    return kind is not None and kind.kind in "iufb" and len(channel) > 0


class _GroupTimes:
    """Stamps of the channels of one group: from waveform properties, else from the group's time channel."""

    def __init__(self, path: Path, group: Any, options: SourceOptions, report: Report) -> None:
        self.path, self.options, self.report = path, options, report
        self.label = f"{path.name}, group {group.name!r}"
        self.channel = self._find(group)
        self._found: NDArray[np.int64] | None = None
        self._kept: dict[int, tuple[NDArray[np.int64], NDArray[np.bool_]]] = {}
        self._waves: dict[tuple[int, float, float, int], NDArray[np.int64]] = {}

    def _find(self, group: Any) -> Any:
        channels = group.channels()
        if self.options.time is not None:
            wanted = self.options.time.strip()
            return next((c for c in channels if wanted in (c.name, f"{group.name}/{c.name}")), None)
        dated = [c for c in channels if c.dtype is not None and c.dtype.kind == "M"]
        named = [c for c in channels if _is_number(c) and c.name.strip().lower().split(" [")[0].split(" (")[0] in _TIME]
        return next((c for c in dated + named if len(c) and (c in dated or rises(c[: min(len(c), 2000)]))), None)

    def of(self, channel: Any) -> NDArray[np.int64] | None:
        """Stamps of a channel [ns], `MISSING` where a row has none; None where it has no time at all."""
        step = channel.properties.get("wf_increment")
        if isinstance(step, (int, float)) and np.isfinite(step) and step > 0:
            return self._wave(channel, float(step))
        if self.channel is None or len(self.channel) != len(channel):
            return None
        if self._found is None:
            self._found = self._of_channel()
        return self._found

    def _wave(self, channel: Any, step: float) -> NDArray[np.int64]:
        begin = channel.properties.get("wf_start_time")
        if begin is None:
            self.report.note(f"{self.label} states no wf_start_time; its stamps count from zero")
        zero = 0 if begin is None else int(np.datetime64(begin, "ns").astype(np.int64))
        offset = channel.properties.get("wf_start_offset")
        ahead = float(offset) if isinstance(offset, (int, float)) and np.isfinite(offset) else 0.0
        key = zero, step, ahead, len(channel)
        if key[3] * step > 2.0**32 or abs(ahead) > 2.0**32:
            raise LogError(
                f"{self.label}: wf_increment = {step} s over {len(channel)} samples is not a time step; record it again"
            )
        if key not in self._waves:
            stamps = self.report.store.column(np.int64)
            for s in blocks(len(channel)):
                stamps.append(zero + np.rint((np.arange(s.start, s.stop) * step + ahead) * 1e9).astype(np.int64))
            self._waves[key] = stamps.finish()
        return self._waves[key]

    def kept(self, stamps: NDArray[np.int64], window: Window | None) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Stamps that are there and lie in the window, and which these are; the same array for the same stamps."""
        if id(stamps) not in self._kept:
            keep = pick(stamps, window)
            self._kept[id(stamps)] = compressed(stamps, keep, self.report.store), keep
        return self._kept[id(stamps)]

    def _of_channel(self) -> NDArray[np.int64]:
        given = self.options.time is not None or self.options.time_unit != "s"
        unit = self.options.time_unit if given else "s"
        dated = self.channel.dtype.kind == "M"
        epoch = epoch_ns(self.options, str(self.path))
        base = TimeBase(
            "iso" if dated else unit, 0 if dated else epoch, f"{self.label}, {self.channel.name!r}", self.report
        )
        stamps = self.report.store.column(np.int64)
        for s in blocks(len(self.channel)):
            cells = self.channel[s.start : s.stop]
            stamps.append(base.stamps(cells.astype("M8[ns]").astype(np.int64) if dated else cells))
        base.finish()
        if not self.options.time:
            self.report.note(f"{self.label}: time is channel {self.channel.name!r} in {base.unit}")
        return stamps.finish()


def _is_text(channel: Any) -> bool:
    kind = channel.dtype
    return kind is not None and kind.kind == "O" and len(channel) > 0


def _channel(label: str, channel: Any, stamps: NDArray[np.int64], window: Window | None, times: _GroupTimes) -> Channel:
    store = times.report.store
    if _is_text(channel):
        at, keep = times.kept(stamps, window)
        words = np.empty(len(channel), object)
        words[:] = [str(text) for text in channel[:]]
        return Channel(label, "", label, at, words[keep], None, "text")
    values = store.column(channel.dtype)
    for s in blocks(len(channel)):
        values.append(np.asarray(channel[s.start : s.stop], channel.dtype))
    at, keep = times.kept(stamps, window)
    unit = channel.properties.get("unit_string")
    found = compressed(values.finish(), keep, store)
    return Channel(label, "", channel.name, at, found, str(unit).strip() or None if unit else None, str(channel.dtype))
