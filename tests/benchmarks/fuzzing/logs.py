"""Read a log in all the ways that users read it, and hold what comes out to what every log holds to."""

from __future__ import annotations

import random
import tempfile
from pathlib import Path

from replay.border import UnforeseenContent
from replay.errors import ConfigError, LogError, OutputError
from replay.export.raw_log import write_raw
from replay.inspection.inspect_log import inspect_log
from replay.inspection.mcap_index import mcap_index
from replay.log.open_loop import is_open_loop_table
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.readers.common.protocol import Reader
from replay.readers.registry import open_log
from tests.benchmarks.fuzzing.case import Finding, Reading

OPTIONS = SourceOptions()
_LONGEST = 2000


def read(path: Path, source: random.Random) -> Reading:
    """Summarise and read a log; now and then also a part of it, on another clock.

    Raises
    ------
    Finding
        Where an error is none of the project's, or does not name the file.
    """
    try:
        reader = open_log(path)
        reader.summarise(path, OPTIONS)
        if reader.format == "mcap":
            mcap_index(path, "header")
        if path.is_file():
            is_open_loop_table(path)
        log = reader.read(path, OPTIONS)
        _shape(log)
        if log.summary.topics and log.summary.topics[0].encoding == "table" and source.random() < 0.2:
            _again(reader, path, source)
        if source.random() < 0.05:
            inspect_log(path, OPTIONS)
        if source.random() < 0.1:
            _converted(path)
        if source.random() < 0.2:
            first = next(iter(log.channels.values()), None)
            start = int(first.stamps[0]) if first is not None and len(first.stamps) else 0
            topics = [t.name for t in log.summary.topics][:1]
            window = (start, min(start + source.choice((0, 10**8, 10**12)), 2**63 - 1))
            _shape(reader.read(path, OPTIONS, topics or None, source.choice(("header", "log", "publish")), window))
    except UnforeseenContent as error:
        raise Finding("foreign", str(error)) from error
    except LogError as error:
        text = str(error)
        if path.name not in text or "\n" in text or len(text) > _LONGEST:
            raise Finding("shape", f"a message that names no file, or is long: {text[:300]!r}") from error
        return Reading("refused", None, (text,))
    if long := next((text for text in (*log.summary.damage, *log.summary.notes) if len(text) > _LONGEST), ""):
        raise Finding("shape", f"a sentence of {len(long)} characters: {long[:300]!r}")
    said = (*log.summary.damage, *log.summary.notes, *(f"{t.name}: {t.note}" for t in log.summary.topics if t.note))
    return Reading("degraded" if log.summary.damage else "whole", log, said)


def _converted(path: Path) -> None:
    """Convert a log, texts too; nothing but the folder that is named may be written."""
    with tempfile.TemporaryDirectory() as place:
        try:
            write_raw(path, Path(place) / "out", OPTIONS)
        except UnforeseenContent:
            raise
        except (LogError, OutputError):
            pass
        if names := {p.name for p in Path(place).iterdir()} - {"out"}:
            raise Finding("shape", f"conversion left {sorted(names)[:5]}")


def _again(reader: Reader, path: Path, source: random.Random) -> None:
    """Read a table with its clock stated otherwise; being refused is all right."""
    unit = source.choice(("s", "ms", "us", "ns", "filetime", "iso", "dc", "dc32", "dt"))
    epoch = source.choice((None, None, "2024-05-01T10:00:00Z", "1601-01-01", "9999-12-31"))
    column = source.choice((None, "t", "v", "a", "when", "s"))
    try:
        options = SourceOptions(time=column, time_unit=unit, epoch=epoch, decimal=source.choice((None, ",", ".")))
        reader.summarise(path, options)
        _shape(reader.read(path, options))
    except UnforeseenContent:
        raise
    except (LogError, ConfigError):
        pass


def _shape(log: RawLog) -> None:
    for name, channel in log.channels.items():
        if len(channel.stamps) != len(channel.values):
            raise Finding("shape", f"{name}: {len(channel.stamps)} stamps, {len(channel.values)} values")
        if channel.stamps.dtype.kind != "i":
            raise Finding("shape", f"{name}: stamps of {channel.stamps.dtype}")


def counts(log: RawLog) -> dict[str, int]:
    """Messages of each topic."""
    out: dict[str, int] = {}
    for topic in log.summary.topics:
        out[topic.name] = out.get(topic.name, 0) + topic.count
    return out
