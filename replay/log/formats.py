"""The table of log formats: one row each, from which endings, readers and messages follow. Light to import."""

from __future__ import annotations

from typing import Literal, NamedTuple


class LogFormatRow(NamedTuple):
    """One format of logs that can be read.

    Attributes
    ----------
    name : str
        As results name it.
    words : str
        As messages name it.
    reader : str
        Module and class that read it; see `replay.readers.common.protocol.Reader`.
    kind : str
        Whether it holds messages or one table.
    endings : tuple[str, ...]
        Endings of its files' names that no other format has first, with their dots.
    certainty : int
        How sure a reader is of what it recognises: 2 by first bytes, 1 by a header of text, 0 by rows of text.
    """

    name: str
    words: str
    reader: str
    kind: Literal["messages", "table"]
    endings: tuple[str, ...]
    certainty: int = 2


_TABLES = "replay.readers.tables"
LOG_FORMATS = (
    LogFormatRow("mcap", "MCAP", "replay.readers.mcap.reader:McapReader", "messages", (".mcap",)),
    LogFormatRow("bag", "ROS 1 bag", "replay.readers.rosbag1.reader:Ros1BagReader", "messages", (".bag", ".bag.active")),
    LogFormatRow(
        "rosbag2", "rosbag2 (folder, .db3)", "replay.readers.rosbag2.reader:Rosbag2Reader", "messages",
        (".db3", ".mcap.zstd", ".db3.zstd"),
    ),
    LogFormatRow(
        "csv", "CSV (also .gz, .zst)", f"{_TABLES}.csv_reader:CsvReader", "table", (".csv", ".csv.gz", ".csv.zst"), 0
    ),
    LogFormatRow(
        "twincat", "TwinCAT Scope export (CSV, TXT)", "replay.readers.twincat.text_reader:TwincatCsvReader", "table",
        (".txt",), 1,
    ),
    LogFormatRow("parquet", "Parquet", f"{_TABLES}.parquet_reader:ParquetReader", "table", (".parquet",)),
    LogFormatRow(
        "svdx", "TwinCAT Scope recording (.svdx)", "replay.readers.twincat.svdx_reader:SvdxReader", "table", (".svdx",)
    ),
    LogFormatRow("tdms", "TDMS", f"{_TABLES}.tdms_reader:TdmsReader", "table", (".tdms",)),
)  # fmt: skip
