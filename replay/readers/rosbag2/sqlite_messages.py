"""Messages of one rosbag2 database, batch by batch in the order of their rows, and what of them is lost."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from replay.log.raw_log import Window
from replay.log.reading_notes import Report
from replay.readers.messages.connection import Connection
from replay.readers.rosbag2 import sqlite_kernel as scan
from replay.readers.rosbag2.sqlite_file import Image, Table
from replay.readers.rosbag2.sqlite_index_kernel import stamped_rows

_PAGES = 8 << 20
_BYTES = 32 << 20
_LAYOUT = ["id", "topic_id", "timestamp", "data"]
_STAMPS = re.compile(r"""\bon\s+["'`\[]?messages["'`\]]?\s*\(\s*["'`\[]?timestamp""", re.IGNORECASE)
_PARTLY = re.compile(r"\b(desc|where)\b", re.IGNORECASE)


@dataclass
class Rows:
    """Some messages in the order of their rows; `data` is valid until the next batch."""

    topic: NDArray[np.int64]
    stamp: NDArray[np.int64]
    data: NDArray[np.uint8]
    start: NDArray[np.int64]
    length: NDArray[np.int64]


@dataclass
class Database:
    """One database that is being read.

    Attributes
    ----------
    image : Image
        Its pages.
    connections : dict[int, Connection]
        Topics by number.
    counts : dict[int, int]
        Messages by topic number, as far as they were met.
    bounds : list[int]
        First and last stamps of batches [ns].
    stated : dict[str, int] or None
        Messages per topic as a database that is a recording of its own states them.
    """

    image: Image
    report: Report
    tables: dict[str, Table] = field(default_factory=dict)
    connections: dict[int, Connection] = field(default_factory=dict)
    counts: Counter[int] = field(default_factory=Counter)
    bounds: list[int] = field(default_factory=list)
    stated: dict[str, int] | None = None
    broken: Counter[int] = field(default_factory=Counter)
    other: int = 0
    damaged: int = 0
    met: int = 0
    spread: int = 0
    buffer: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, np.uint8))

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.image.path.name

    def messages(self, topics: Collection[str] | None, window: Window | None, payloads: bool) -> Iterator[Rows]:
        """Read messages; counts and losses are complete once all were taken.

        Parameters
        ----------
        topics : Collection[str] or None
            Wanted topics.
        window : tuple[int, int] or None
            Wanted stamps [ns]; the index of the stamps is used where there is one.
        payloads : bool
            Whether payloads are wanted at all, or counts only.
        """
        wanted = None
        if topics is not None:
            wanted = np.array(sorted(i for i, c in self.connections.items() if c.topic in topics), np.int64)
        leaves = self._leaves(window)
        at, batch = 0, max(1, _PAGES // self.image.page)
        first, last = None, 0
        while at < len(leaves):
            for first_row, last_row, rows in self._batch(leaves[at : at + batch], wanted, window, payloads):
                first = first_row if first is None else first
                last = last_row
                if rows is not None:
                    yield rows
            at += batch
        self._say(first, last, window is None)

    def _leaves(self, window: Window | None) -> NDArray[np.int64]:
        """Leaves of the table of messages that may hold stamps of the window."""
        table = self.tables.get("messages")
        if table is None or "timestamp" not in table.columns():
            return self._stray(np.empty(0, np.int64))
        if window is not None:
            seen = self.image.seen.copy()
            rows = self._stamped(window)
            if rows is not None:
                found = self.image.leaves(table.root, np.sort(rows))
                if not self.image.suspects:
                    return found
            self.image.seen[:] = seen
        found = self.image.leaves(table.root)
        return self._stray(found) if self.image.suspects else found

    def _index(self) -> Table | None:
        """Return the index of the stamps, if it holds all of them in rising order."""
        return next((t for t in self.tables.values() if _STAMPS.search(t.sql) and not _PARTLY.search(t.sql)), None)

    def _stamped(self, window: Window) -> NDArray[np.int64] | None:
        """Rows that the index places in the window; None without a sound index."""
        index, image = self._index(), self.image
        if index is None:
            return None
        rows = np.empty(1 << 16, np.int64)
        low, high = (min(max(w, -(2**63)), 2**63 - 1) for w in window)
        while True:
            n, _ = stamped_rows(image.data, image.page, index.root, np.zeros_like(image.seen), low, high, rows)
            if n <= len(rows):
                return rows[:n] if n >= 0 else None
            rows = np.empty(n, np.int64)

    def _stray(self, leaves: NDArray[np.int64]) -> NDArray[np.int64]:
        """Add pages of messages that the damaged table does not lead to, in the order of their first rows."""
        image = self.image
        image.mark_free()
        kept = {int(t.root) for n, t in self.tables.items() if n != "messages"}
        for root in kept:
            if 1 <= root < len(image.seen) and not image.seen[root]:
                image.leaves(root)
        starts = np.arange(len(image.seen) - 1) * image.page
        starts = starts[starts < len(image.data)]
        pages = np.flatnonzero((image.data[starts] == scan.LEAF) & (image.seen[1 : len(starts) + 1] == 0)) + 1
        pages = np.union1d(pages, np.array([p for p in set(image.suspects) if p > 1], np.int64))
        held, _ = self._judge(pages)
        stray = pages[held]
        if len(stray):
            image.seen[stray] = 1
            self.report.lost(
                f"{self.name}: the tree of its messages is damaged; {len(stray)} pages of messages were found beside it "
                "and read"
            )
        every = np.concatenate((leaves, stray))
        return every[np.argsort(self._judge(every)[1], kind="stable")]

    def _judge(self, pages: NDArray[np.int64]) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Whether most rows of each page are messages of topics that exist, and the first row of each page."""
        held, first = np.zeros(len(pages), np.bool_), np.zeros(len(pages), np.int64)
        batch = max(1, _PAGES // self.image.page)
        for at in range(0, len(pages), batch):
            some = pages[at : at + batch]
            row, *_, topic, _, _, _, status = self._parse(some)
            owner = np.repeat(np.arange(len(some)), scan.cells_of(self.image.data, self.image.page, some))
            whole, fine = status != scan.DAMAGED, status == scan.OK
            if self.connections:
                fine &= np.isin(topic, list(self.connections))
            good = np.bincount(owner[fine], minlength=len(some))
            held[at : at + batch] = 2 * good > np.bincount(owner[whole], minlength=len(some))
            own, places = np.unique(owner[whole], return_index=True)
            first[at + own] = row[whole][places]
        return held, first

    def _parse(self, leaves: NDArray[np.int64]) -> tuple[NDArray[np.int64], ...]:
        """Row number, place, local and whole length, topic, stamp, start, length and status of rows."""
        image = self.image
        table = self.tables.get("messages")
        names = table.columns() if table is not None else _LAYOUT
        columns = np.array([names.index(n) if n in names else -1 for n in _LAYOUT[1:]], np.int64)
        row, place, local, total, status = scan.locate(image.data, image.page, image.usable, leaves)
        found = scan.messages_of(image.data, image.page, image.usable, place, local, total, status, columns)
        return row, place, local, total, *found, status

    def _batch(
        self, leaves: NDArray[np.int64], wanted: NDArray[np.int64] | None, window: Window | None, payloads: bool
    ) -> Iterator[tuple[int, int, Rows | None]]:
        row, place, local, _, topic, stamp, start, length, status = self._parse(leaves)
        fine = (status == scan.OK) & (stamp >= 0) & (length <= len(self.image.data))
        self.other += int(np.count_nonzero((status == scan.OTHER_TYPES) | ((status == scan.OK) & (stamp < 0))))
        self.damaged += int(np.count_nonzero(status == scan.DAMAGED))
        self.met += int(np.count_nonzero(status != scan.DAMAGED))
        rows = row[status != scan.DAMAGED]
        if not len(rows):
            return
        self.spread += int(np.count_nonzero(np.diff(rows) <= 0))
        if window is None:
            numbers, repeats = np.unique(topic[fine], return_counts=True)
            self.counts.update(dict(zip(numbers.tolist(), repeats.tolist(), strict=True)))
            if fine.any():
                self.bounds += [int(stamp[fine].min()), int(stamp[fine].max())]
        else:
            fine &= (stamp >= window[0]) & (stamp < window[1])
        if wanted is not None:
            fine &= np.isin(topic, wanted)
        pick = np.flatnonzero(fine) if payloads else np.empty(0, np.int64)
        edge = int(rows[0]), int(rows[-1])
        yield *edge, None
        while len(pick):
            total = np.cumsum(length[pick])
            n = max(1, int(np.searchsorted(total, _BYTES, "right")))
            mine, pick = pick[:n], pick[n:]
            yield *edge, self._gather(place[mine], local[mine], topic[mine], stamp[mine], start[mine], length[mine])

    def _gather(
        self, place: NDArray[np.int64], local: NDArray[np.int64], topic: NDArray[np.int64], stamp: NDArray[np.int64],
        start: NDArray[np.int64], length: NDArray[np.int64],
    ) -> Rows:  # fmt: skip
        """Copy the payloads of rows to one buffer."""
        image = self.image
        into = np.cumsum(length) - length
        size = int(length.sum())
        if len(self.buffer) < size:
            self.buffer = np.empty(max(size, min(2 * size, _BYTES)), np.uint8)
        out = self.buffer[:size]
        status = np.zeros(len(place), np.uint8)
        scan.gather(image.data, image.page, image.usable, place, local, start, length, out, into, status)
        whole = status == scan.OK
        if not whole.all():
            numbers, repeats = np.unique(topic[~whole], return_counts=True)
            self.broken.update(dict(zip(numbers.tolist(), repeats.tolist(), strict=True)))
            topic, stamp, into, length = topic[whole], stamp[whole], into[whole], length[whole]
        return Rows(topic, stamp, out, into, length)

    def _say(self, first: int | None, last: int, whole: bool) -> None:
        """Report what was lost."""
        report = self.report
        if self.damaged:
            report.lost(f"{self.name}: {self.damaged} rows of messages are damaged and were left out")
        if self.other:
            report.lost(f"{self.name}: {self.other} rows hold no message with a proper stamp")
        for number, count in sorted(self.broken.items()):
            topic = self.connections[number].topic[:80] if number in self.connections else f"topic {number}"
            report.lost(f"{self.name}: {count} messages on {topic} are on pages that are missing or damaged")
            self.counts[number] -= count
        bad = [p for p in self.image.suspects if p]
        if self.image.suspects:
            where = f" (the first is page {bad[0]})" if bad else ""
            report.lost(
                f"{self.name}: {len(self.image.suspects)} pages that its tables name are damaged, missing or named "
                f"twice{where}"
            )
        for number, count in sorted(self.counts.items()):
            if number not in self.connections and count > 0:
                report.lost(f"{self.name}: {count} messages belong to topic {number}, which is not named")
        if whole and first is not None:
            self._say_gaps(last)

    def _say_gaps(self, last: int) -> None:
        """Recorders number rows without gaps from 1: say how many are missing, unless the index misses them too."""
        missing = last - self.met - self.damaged
        if missing <= 0 or self.spread:
            return
        index = self._index()
        held = -1
        if index is not None:
            image = self.image
            _, held = stamped_rows(
                image.data,
                image.page,
                index.root,
                np.zeros_like(image.seen),
                -(2**63),
                2**63 - 1,
                np.empty(0, np.int64),
            )
        text = f"{self.name}: {missing} of the row numbers up to {last} are missing"
        if held == self.met:
            self.report.note(f"{text}; its index does not name them either, so they were deleted")
        else:
            self.report.lost(f"{text}; these messages are lost")
