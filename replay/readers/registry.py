"""One table of readers, and the pick among them by a log's content."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.log.file_types import check_regular
from replay.log.raw_log import Clock, LogSummary, RawLog, Window
from replay.log.source_options import SourceOptions
from replay.readers.common.protocol import Reader
from replay.readers.mcap.reader import McapReader
from replay.readers.rosbag1.reader import Ros1BagReader
from replay.readers.rosbag2.reader import Rosbag2Reader
from replay.readers.tables.csv_reader import CsvReader
from replay.readers.tables.parquet_reader import ParquetReader
from replay.readers.tables.tdms_reader import TdmsReader
from replay.readers.twincat.svdx_reader import SvdxReader
from replay.readers.twincat.text_reader import TwincatCsvReader

# In order of certainty: magic bytes first, text tables last.
READERS: tuple[Reader, ...] = (
    McapReader(),
    Ros1BagReader(),
    Rosbag2Reader(),
    ParquetReader(),
    TdmsReader(),
    SvdxReader(),
    TwincatCsvReader(),
    CsvReader(),
)
FORMATS = (
    "MCAP, ROS 1 bag, rosbag2 (folder, .db3), TwinCAT Scope export (CSV, TXT) and recording (.svdx), TDMS, CSV (also .gz, "
    ".zst) and Parquet"
)


def open_log(path: Path) -> Reader:
    """Pick the reader of a log by its content.

    Parameters
    ----------
    path : Path
        File or rosbag2 folder.

    Raises
    ------
    LogError
        Where the path does not exist, is empty, is neither file nor folder, or no reader knows its content.
    """
    try:
        if not path.exists():
            raise LogError(f"{path} does not exist; expected a log file or a rosbag2 folder")
        if path.is_file() and path.stat().st_size == 0:
            raise LogError(f"{path} is empty (0 bytes); the recording was not written, copy or record it again")
        check_regular(path)
        for reader in READERS:
            if reader.matches(path):
                return reader
        raise LogError(f"{path} is not a log that can be read: found {_found(path)}; expected {FORMATS}")
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error


def _found(path: Path) -> str:
    if path.is_dir():
        names = sorted(p.name for p in path.iterdir())
        return f"a folder with {', '.join(names[:5]) if names else 'nothing in it'}"
    with path.open("rb") as file:
        head = file.read(12)
    return f"the extension {path.suffix or '(none)'} and the first bytes {head!r}"


def summarise_log(path: Path, options: SourceOptions) -> LogSummary:
    """List a log's contents from its index.

    Raises
    ------
    LogError
        Where nothing in the log can be read.
    """
    return open_log(path).summarise(path, options)


def read_log(
    path: Path,
    options: SourceOptions,
    topics: Collection[str] | None = None,
    clock: Clock | None = None,
    window: Window | None = None,
    store: ColumnStore | None = None,
) -> RawLog:
    """Decode a log, or the given topics and time of it, with its long columns in the store (None: one of its own).

    The clock is that of the options unless given.

    Raises
    ------
    LogError
        Where nothing in the log can be read.
    """
    return open_log(path).read(path, options, topics, clock or options.stamp, window, store)
