"""Numbers of the MCAP format, and of the walks over it."""

from __future__ import annotations

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = 1, 2, 3, 4, 5, 6, 7, 8
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = 9, 10, 11, 12, 13, 14, 15
PRIVATE = 128  # records from here on belong to whoever wrote them
HOLE = 0  # bytes that hold no complete record
SOUND, MENDED = 0, 1  # a record's opcode and lengths agree, or one was wrong and something else told it
SHORT = 256  # added to the opcode of a message too short to be one
MESSAGE_HEAD = 22
CHANNELS = 1 << 16
