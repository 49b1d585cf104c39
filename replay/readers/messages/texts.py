"""Texts of one topic while a log is read: frame ids, log messages, names of states, where they are asked for.

The diagnosis needs none, so that they are left out unless a log is to be given as it was recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
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
            if path not in self._parts and len(self._parts) >= MAX_PATHS:
                self.skipped.add(path)
                continue
            values = np.empty(len(texts), object)
            values[:] = [self._word(text) for text in texts]
            self._parts.setdefault(path, []).append((rows, values))

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
        at = np.concatenate([np.arange(a, a + len(c)) for a, c in layout.checks]) if layout.checks else np.arange(0)
        content = np.frombuffer(b"".join(c for _, c in layout.checks), np.uint8)
        same = np.ones(len(left), np.bool_)
        for offset, byte in zip(at.tolist(), content.tolist(), strict=True):
            same &= data[starts[left] + offset] == byte
        mine = left[same]
        if len(mine):
            self.store.skipped.update(layout.long)
            self.store.add(rows[mine], {p: _texts(data, starts[mine] + a, n) for p, a, n in layout.texts})
        return left[~same]


def _texts(data: NDArray[np.uint8], starts: Rows, size: int) -> list[str]:
    """Texts of one size [bytes] at some places; each distinct one is decoded once."""
    if size <= 0:
        return [""] * len(starts)
    read: Callable[[int], str] = lambda at: _decoded(data[at : at + size].tobytes())  # noqa: E731
    if len(starts) * size > _GATHERED:
        return [read(at) for at in starts.tolist()]
    cells: NDArray[Any] = np.ascontiguousarray(data[starts[:, None] + np.arange(size)])
    if (cells == cells[0]).all():
        return [read(int(starts[0]))] * len(starts)
    unique, which = np.unique(cells, axis=0, return_inverse=True)
    words = [_decoded(row.tobytes()) for row in unique]
    return [words[i] for i in which.ravel().tolist()]


def _decoded(raw: bytes) -> str:
    return raw.decode("utf-8", "replace")
