"""What was read from an MCAP file, held against what its statistics, its index and its checksums say."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import release
from replay.readers.mcap import format as fmt
from replay.readers.mcap import scan
from replay.readers.mcap.chunk import name_channels, open_chunk, take_names
from replay.readers.mcap.file import McapFile
from replay.readers.mcap.records import Statistics
from replay.readers.mcap.walk import walk_file

_PRIVATE = range(fmt.PRIVATE, fmt.SHORT)
_NEVER = (-1, -1)
_AT_ONCE = 64 << 20


def expected(file: McapFile) -> tuple[dict[int, int], str]:
    """Messages per channel that should be there, and who says so: the statistics, or the message indexes."""
    stated = file.statistics
    if stated is not None and _consistent(file, stated):
        return {c: n for c, n in stated.channel_message_counts.items() if n}, "statistics count"
    heads = np.concatenate((file.indexes[:, 1:], file.orphans))
    indexed = _sums(heads[:, 0], heads[:, 1])
    for channel in np.flatnonzero(file.loose.counts).tolist():
        indexed[channel] = indexed.get(channel, 0) + int(file.loose.counts[channel])
    return indexed, "message indexes count"


def _consistent(file: McapFile, stated: Statistics) -> bool:
    """Whether statistics can be believed: a sound summary, or at least one sum that is right."""
    sound = file.summary is not None and file.summary.sound
    return sound or sum(stated.channel_message_counts.values()) == stated.message_count


def _sums(channels: NDArray[np.int64], counts: NDArray[np.int64]) -> dict[int, int]:
    known = counts > 0
    sums = np.bincount(channels[known], counts[known], 1).astype(np.int64)
    return {int(c): int(sums[c]) for c in np.flatnonzero(sums)}


def account(
    file: McapFile, tally: scan.Tally, topics: Collection[str] | None, skipped: set[int], opened: bool = True
) -> list[int]:
    """Say what is missing, channel by channel.

    Parameters
    ----------
    file : McapFile
        A walked file whose chunks were read, but for those skipped.
    tally : Tally
        What was found.
    topics : Collection[str] or None
        What was wanted.
    skipped : set[int]
        Rows of chunks that were not opened because they hold no wanted message.
    opened : bool
        Whether the other chunks were opened; else their indexes were believed.

    Returns
    -------
    list[int]
        Chunks to open after all, because messages are missing that only they can hold; nothing was said then.
    """
    due, who = expected(file)
    found = tally.counts
    wanted = {n for n, c in file.names.channels.items() if topics is None or c.topic in topics}
    if topics is None:
        wanted |= due.keys()
    short = [n for n in sorted(wanted) if found[n] != due.get(n, 0) and (due or found[n])]
    if skipped and any(found[n] < due.get(n, 0) for n in short):
        return sorted(skipped)
    if file.statistics is not None or not file.runs:
        for n in short:
            if file.statistics is None and found[n] > due.get(n, 0):
                continue  # not every chunk has indexes
            file.lost(
                "count",
                f"{file.names.topic(n)}: {found[n]} of {due.get(n, 0)} messages that the log's {who} were found",
            )
    _say_missing_schemas(file)
    _say_unknown(file, bool(short))
    if file.statistics is not None and file.summary is not None and file.summary.sound:
        _compare(file, file.statistics, names=opened and not skipped)
        if topics is None and not skipped and not short:
            _compare_stamps(file, tally, file.statistics)
    return []


def _say_missing_schemas(file: McapFile) -> None:
    for topic in file.names.without_schema():
        file.lost("schema", f"{topic}: its schema is missing or damaged")


def _say_unknown(file: McapFile, short: bool) -> None:
    """Records of unknown type: a loss, but for private ones in a log in which nothing is missing."""
    if not file.unknown:
        return
    count = sum(n for _, _, n in file.unknown)
    text = f"{count} records of unknown type (first at byte {file.unknown[0][1]}) were left out"
    if not short and file.statistics is not None and all(code in _PRIVATE for code, _, _ in file.unknown):
        file.report.note(f"{file.path.name}: {text}")
    else:
        file.lost("record", text)


def _compare(file: McapFile, stated: Statistics, names: bool) -> None:
    """Hold the other counts against what was found; names may stand in chunks that were not opened."""
    found = [
        ("chunks", stated.chunk_count, len(file.chunks)),
        ("attachments", stated.attachment_count, len(file.attachments)),
        ("metadata records", stated.metadata_count, file.metadata_count),
    ]
    for what, said, count in found:
        if count > said:
            file.report.note(f"{file.path.name}: {count} {what} were found, its statistics count {said}")
    if names:  # some writers count only those with messages
        found.append(("schemas", stated.schema_count, file.names.schema_count))
        found.append(("channels", stated.channel_count, len(file.names.channels)))
    for what, said, count in found:
        if count < said:
            file.lost("count", f"{count} of {said} {what} that the log's statistics count were found")


def _compare_stamps(file: McapFile, tally: scan.Tally, stated: Statistics) -> None:
    """Hold the time bounds against what was found; a difference is the writer's where checksums cover the messages."""
    first, last = (int(b) for b in tally.bounds)
    if last < 0 or (first, last) == (stated.message_start_time, stated.message_end_time):
        return
    text = (
        f"its log stamps reach from {first} to {last} ns, its statistics say {stated.message_start_time} to "
        f"{stated.message_end_time}"
    )
    if (file.bare or file.runs) and first:  # some writers take a first stamp of 0 for none
        file.lost("stamps", text)
    else:
        file.report.note(f"{file.path.name}: {text}")


def check_data(file: McapFile, whole: bool) -> None:
    """Check the checksum of the data section where all of it was read, and note what no checksum covers."""
    place, stated = file.data_end
    right = False
    if whole and place >= 0 and stated:
        crc = 0
        for at in range(0, place, _AT_ONCE):
            crc = zlib.crc32(file.data[at : min(at + _AT_ONCE, place)].data, crc)
            release(file.data)
        right = crc == stated
        if not right:
            file.lost("data", f"the checksum of its data section (bytes 0 to {place}) differs; its content was changed")
    if right:
        file.bare = False


def counts_of(file: McapFile) -> tuple[Mapping[int, int], tuple[int, int]]:
    """Messages per channel and their first and last log stamp: as read, where that was done, else as stated.

    A channel that was not read counts what the statistics or indexes say of it. A damaged file that was not read is
    surveyed: message indexes are believed where there are some, chunks without are opened.
    """
    if file.read_whole and file.read_topics is None:
        return _held(file.found)
    told = name_channels(file)
    summary, stated = file.summary, file.statistics
    checked = summary is not None and summary.sound and summary.checked
    if stated is not None:
        told = all(file.names.named[c] for c in stated.channel_message_counts)
    if checked and told and stated is not None and (not file.walked or file.read_whole):
        _look_for_checksums(file)
        counts = dict(stated.channel_message_counts)
        bounds = (stated.message_start_time, stated.message_end_time) if stated.message_count else _NEVER
    elif told and not file.walked and (known := _index_counts(file)) is not None:
        _look_for_checksums(file)
        counts, bounds = known
    else:
        walk_file(file)
        tally = _survey(file)
        if not file.read_whole:
            account(file, tally, None, set(), opened=False)
        counts, bounds = _held(tally)
    if file.read_whole and file.read_topics is not None:
        for number, connection in file.names.channels.items():
            if connection.topic in file.read_topics:
                counts[number] = int(file.found.counts[number])
    return counts, bounds


def _held(tally: scan.Tally) -> tuple[dict[int, int], tuple[int, int]]:
    counts = {n: int(tally.counts[n]) for n in np.flatnonzero(tally.counts).tolist()}
    return counts, (int(tally.bounds[0]), int(tally.bounds[1])) if counts else _NEVER


def _index_counts(file: McapFile) -> tuple[dict[int, int], tuple[int, int]] | None:
    """Counts from the heads of the message indexes to which the summary points; None where some are missing."""
    summary, size = file.summary, len(file.data)
    if summary is None or len(np.unique(summary.indexes[:, 0])) < len(summary.chunks):
        return None
    places = summary.indexes[:, 2]
    if ((places < 0) | (places + 15 > size)).any() or (file.data[places] != fmt.MESSAGE_INDEX).any():
        return None
    rows = np.stack((places, places, places + 15), axis=1)
    heads = scan.index_counts(file.data, rows)
    if (heads[:, 0] != summary.indexes[:, 1]).any():
        return None
    if not len(file.chunks):
        return {}, _NEVER
    return _sums(heads[:, 0], heads[:, 1]), (int(file.chunks[:, 2].min()), int(file.chunks[:, 3].max()))


def _survey(file: McapFile) -> scan.Tally:
    """Count a walked file's messages from its message indexes, opening chunks that have none or are cut off."""
    tally = scan.Tally()
    tally.counts += file.loose.counts
    tally.bounds[:] = file.loose.bounds
    np.add.at(tally.counts, file.indexes[:, 1], file.indexes[:, 2])
    indexed = set(file.indexes[:, 0].tolist())
    if file.runs:
        file.bare = True
    for row, (start, _, first, last) in enumerate(file.chunks.tolist()):
        if row in indexed and start != file.cut:
            _widen(tally, first, last)
            continue
        if row in indexed:
            mine = file.indexes[file.indexes[:, 0] == row]
            np.subtract.at(tally.counts, mine[:, 1], mine[:, 2])
        chunk = open_chunk(file, row)
        if chunk is None:
            continue
        take_names(file, row, chunk)
        for at, stop in chunk.runs:
            census = file.scanner.census(chunk.data, at, stop)
            np.add.at(tally.counts, census.channels, census.counts)
            _widen(tally, *census.bounds)
    return tally


def _widen(tally: scan.Tally, first: int, last: int) -> None:
    if 0 <= first <= last:
        tally.bounds[0], tally.bounds[1] = min(tally.bounds[0], first), max(tally.bounds[1], last)


def _look_for_checksums(file: McapFile) -> None:
    """Look at the first chunk alone: whether this log has checksums."""
    if not file.walked:
        start = int(file.chunks[0, 0]) if len(file.chunks) else -1
        file.bare |= start < 0 or not file.data[start + 33 : start + 37].any()
