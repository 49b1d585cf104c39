"""Texts of one topic while a log is read: frame ids, log messages, names of states, where they are asked for.

The diagnosis needs none, so that they are left out unless a log is to be given as it was recorded.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype

from replay.readers.messages.cdr_layout import Layout, layout_of
from replay.readers.messages.definitions import MessageType
from replay.readers.messages.encodings import LayoutError
from replay.readers.messages.tables import Cells, Rows

Texts = NDArray[np.object_]

MAX_PATHS = 20_000
GIVE_UP = 200
_KNOWN, _WORDS = 64, 100_000
_GATHERED = 32 << 20


@dataclass
class TextStore:
    """Texts of one topic.

    Attributes
    ----------
    skipped : set[str]
        Arrays too long to become channels, and what is left out beyond `MAX_PATHS` fields.
    """

    skipped: set[str] = field(default_factory=set)
    _parts: dict[str, list[tuple[Rows, Texts]]] = field(default_factory=dict)
    _words: dict[str, str] = field(default_factory=dict)

    def add(self, rows: Rows, columns: Mapping[str, Sequence[str]]) -> None:
        """Add texts of some rows of the topic, shape (m,) each, by path."""
        for path, texts in columns.items():
            self.add_words(rows, path, texts, None)

    def add_words(self, rows: Rows, path: str, words: Sequence[str], which: Rows | None) -> None:
        """Add texts of some rows, shape (m,): the words themselves, or those of the given numbers."""
        if path not in self._parts and len(self._parts) >= MAX_PATHS:
            self.skipped.add(path)
            return
        values = np.empty(len(words), object)
        values[:] = [self._word(text) for text in words]
        self._parts.setdefault(path, []).append((rows, values if which is None else values[which]))

    def _word(self, text: str) -> str:
        """The text itself, the same object wherever it occurs again."""
        return self._words.setdefault(text, text) if len(self._words) < _WORDS else self._words.get(text, text)

    def finish(self, count: int) -> dict[str, Cells]:
        """Rows (None for all `count` messages) and texts by path, in recorded order; the store is empty then."""
        out: dict[str, Cells] = {}
        for path, parts in self._parts.items():
            rows = np.concatenate([r for r, _ in parts])
            values = np.concatenate([v for _, v in parts])
            order = np.argsort(rows, kind="stable")
            out[path] = None if len(rows) == count else rows[order], values[order]
        self._parts = {}
        return out


def has_texts(kind: MessageType) -> bool:
    """Whether a message type holds texts."""
    for fields in kind.fields.values():
        for _, (node, value) in fields:
            inner = value[0] if node in (Nodetype.ARRAY, Nodetype.SEQUENCE) else (node, value)
            if inner[0] == Nodetype.BASE and inner[1][0] == "string":
                return True
    return False


@dataclass
class TextDecoder:
    """Takes the texts out of serialised messages of one type: those that lie alike together.

    Attributes
    ----------
    kind : MessageType
        The type of all payloads.
    store : TextStore
        Takes the texts.
    bad : int
        Payloads that do not fit the definition; beyond `GIVE_UP` of them no others are tried.
    """

    kind: MessageType
    store: TextStore
    bad: int = 0
    _known: dict[int, list[Layout]] = field(default_factory=dict)

    def decode(self, data: NDArray[np.uint8], starts: Rows, lengths: Rows, rows: Rows) -> None:
        """Take the texts of payloads.

        Parameters
        ----------
        data : NDArray[np.uint8], shape (b,)
            Bytes that hold all payloads; nothing keeps them.
        starts, lengths : NDArray[np.int64], shape (n,)
            Place of each payload in `data`.
        rows : NDArray[np.int64], shape (n,)
            Rows of the topic that they are.
        """
        inside = (starts >= 0) & (lengths > 0) & (starts + lengths <= len(data))
        for size in np.unique(lengths[inside]).tolist():
            left = np.flatnonzero(inside & (lengths == size))
            for layout in self._known.get(size, ()):
                left = self._take(layout, data, starts, rows, left)
            while len(left) and self.bad <= GIVE_UP:
                first = int(starts[left[0]])
                try:
                    layout = layout_of(self.kind, data[first : first + size].tobytes())
                except LayoutError:
                    self.bad += 1
                    left = left[1:]
                    continue
                if len(self._known) < _KNOWN and len(self._known.setdefault(size, [])) < _KNOWN:
                    self._known[size].append(layout)
                left = self._take(layout, data, starts, rows, left)

    def _take(self, layout: Layout, data: NDArray[np.uint8], starts: Rows, rows: Rows, left: Rows) -> Rows:
        """Take the texts of payloads that lie as a layout says; give those that do not."""
        if not len(left):
            return left
        same = np.ones(len(left), np.bool_)
        for at, content in _joined(layout.checks):
            same &= (_cells(data, starts[left] + at, len(content)) == np.frombuffer(content, np.uint8)).all(axis=1)
        mine = left[same]
        if len(mine):
            self.store.skipped.update(layout.long)
            for path, at, size in layout.texts:
                self.store.add_words(rows[mine], path, *_texts(data, starts[mine] + at, size))
        return left[~same]


def _joined(checks: Sequence[tuple[int, bytes]]) -> list[tuple[int, bytes]]:
    """Checked bytes, those that follow each other as one piece."""
    out: list[tuple[int, bytes]] = []
    for at, content in sorted(checks):
        if out and at <= out[-1][0] + len(out[-1][1]):
            first, held = out[-1]
            out[-1] = first, held[: at - first] + content + held[at - first + len(content) :]
        else:
            out.append((at, content))
    return out


def _cells(data: NDArray[np.uint8], starts: Rows, size: int) -> NDArray[np.uint8]:
    """Bytes at some places, shape (n, size)."""
    return sliding_window_view(data, size)[starts]


def _texts(data: NDArray[np.uint8], starts: Rows, size: int) -> tuple[list[str], Rows]:
    """Distinct texts of one size [bytes] at some places, and which of them stands at each, shape (n,)."""
    if size <= 0:
        return [""], np.zeros(len(starts), np.int64)
    if len(starts) * size > _GATHERED:
        return [_decoded(data[at : at + size].tobytes()) for at in starts.tolist()], np.arange(len(starts))
    cells = _cells(data, starts, size)
    if (cells == cells[0]).all():
        return [_decoded(cells[0].tobytes())], np.zeros(len(starts), np.int64)
    unique, which = np.unique(cells, axis=0, return_inverse=True)
    return [_decoded(row.tobytes()) for row in unique], which.ravel()


def _decoded(raw: bytes) -> str:
    return raw.decode("utf-8", "replace")
