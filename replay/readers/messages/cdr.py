"""Columnar decoding of serialised messages (CDR of both byte orders, ROS 1).

One payload is walked; every payload that agrees with it in length and in all bytes that fix the layout is then copied
into columns by a compiled loop. Where layouts hardly repeat, for strings and sequences change their lengths, a compiled
program walks over each payload. What is left after many shapes is decoded message by message.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from replay.readers.messages.cdr_layout import MAX_ELEMENTS, Layout, layout_of
from replay.readers.messages.cdr_program import Compiler, Program, Spec, TooWide
from replay.readers.messages.cdr_rows import BAD, FREE, FixedLayout, Payloads, Steps, views
from replay.readers.messages.definitions import MessageType
from replay.readers.messages.encodings import LayoutError, width_of
from replay.readers.messages.fields import Place
from replay.readers.messages.tables import SIZES
from replay.readers.messages.topic_store import Part, Store

__all__ = ["Decoder", "Outcome", "Part"]

MAX_LAYOUTS = 6
MAX_PROGRAMS = 64
GIVE_UP = 500
PATIENCE = 2_000_000
_WORTH = 0.25
_TRIES = 4


@dataclass
class Outcome:
    """What could not be decoded, or not in columns."""

    bad: int = 0
    reason: str = ""
    slow: int = 0


class _Fixed:
    """The layout of payloads whose bytes lie alike."""

    def __init__(self, layout: Layout, store: Store) -> None:
        self.layout, self.skipped = layout, layout.skipped
        specs = [Spec(s.path, s.dtype) for s in layout.slots]
        self.table = store.table(specs)
        columns: list[NDArray[np.int64]] = []
        for size in SIZES:
            mine = [(slot.offset, spec) for slot, spec in zip(layout.slots, specs, strict=True) if slot.size == size]
            columns += [
                np.array([at for at, _ in mine], np.int64),
                np.array([self.table.place[spec] for _, spec in mine], np.int64),
            ]
        self.rows = FixedLayout(layout.size, layout.dialect.order == ">", *layout.words(), *columns)

    def take(self, payloads: Payloads, store: Store) -> tuple[int, int]:
        """Decode the rows that fit; return how many, and the first that nobody owns or −1."""
        from replay.readers.messages.cdr_kernel import take_fixed

        taken, left = take_fixed(payloads, self.rows, store.open(self.table))
        return int(taken), int(left)


class _Walked:
    """A program for payloads whose strings and sequences have any length."""

    def __init__(self, program: Program, skipped: tuple[str, ...], store: Store) -> None:
        self.program, self.skipped = program, skipped
        self.table = store.table(program.specs)
        dialect = program.dialect
        self.steps = Steps(
            program.ops,
            program.names,
            np.frombuffer(dialect.head, np.uint8),
            dialect.order == ">",
            dialect.align,
            dialect.slack,
            np.array([self.table.place[s] for s in program.specs], np.int64),
            np.array([i for i, s in enumerate(program.specs) if s.dtype == "#"], np.int64),
        )

    def take(self, payloads: Payloads, store: Store) -> tuple[int, int, int, int]:
        """Decode the rows that fit; return how many fit, how many are damaged, the first left and the first damaged."""
        from replay.readers.messages.cdr_program_kernel import take_program

        taken, bad, left, first_bad = take_program(payloads, self.steps, store.open(self.table))
        return int(taken), int(bad), int(left), int(first_bad)


@dataclass
class Decoder:
    """Decodes payloads of one message type; remembers the layouts it has met.

    Parameters
    ----------
    kind : MessageType
        The type of all payloads.
    outcome : Outcome
        Counts of undecodable and slowly decoded messages, added to.
    store : Store
        Takes the numbers; the caller begins and ends its batches.
    """

    kind: MessageType
    outcome: Outcome
    store: Store
    fixed: list[_Fixed] = field(default_factory=list)
    walked: list[_Walked] = field(default_factory=list)
    room: dict[Place, int] = field(default_factory=dict)
    tried: int = 0
    spent: int = 0
    wide: int = 0
    count: NDArray[np.int64] = field(default_factory=lambda: np.arange(0))

    def decode(
        self,
        data: NDArray[np.uint8],
        starts: NDArray[np.int64],
        lengths: NDArray[np.int64],
        slots: NDArray[np.int64] | None = None,
    ) -> None:
        """Decode payloads into the store's batch.

        Parameters
        ----------
        data : NDArray[np.uint8], shape (b,)
            Bytes that hold all payloads; nothing keeps them.
        starts, lengths : NDArray[np.int64], shape (n,)
            Place of each payload in `data`.
        slots : NDArray[np.int64], shape (n,) or None
            Rows of the batch that they are; None: the first to the last.
        """
        if slots is None:
            if len(self.count) < len(starts):
                self.count = np.arange(len(starts))
            slots = self.count[: len(starts)]
        batch = Payloads(
            *views(data), len(data), np.ascontiguousarray(starts, np.int64), np.ascontiguousarray(lengths, np.int64),
            np.ascontiguousarray(slots, np.int64),
        )  # fmt: skip
        left = 0 if len(starts) else -1
        for fixed in self.fixed:
            left = self._fixed(fixed, batch)[1] if left >= 0 else left
        for walked in self.walked:
            left = self._walked(walked, batch)[1] if left >= 0 else left
        while left >= 0 and not self._hopeless():
            left = self._learn(batch, left)
        if left >= 0:
            rest = self.store.owner[batch.slots] == FREE
            self.outcome.bad += int(np.count_nonzero(rest))
            self.store.owner[batch.slots[rest]] = BAD

    def _hopeless(self) -> bool:
        """Whether so many payloads failed and none fitted that the definition is not theirs, or so many parts were read."""
        hopeless = self.outcome.bad >= GIVE_UP and not self.fixed and not self.walked
        return hopeless or self.spent > PATIENCE

    def _fixed(self, plan: _Fixed, batch: Payloads) -> tuple[int, int]:
        taken, left = plan.take(batch, self.store)
        if taken:
            self.store.skipped.update(plan.skipped)
        return taken, left

    def _walked(self, plan: _Walked, batch: Payloads) -> tuple[int, int]:
        taken, bad, left, first_bad = plan.take(batch, self.store)
        if taken:
            self.store.skipped.update(plan.skipped)
        if bad:
            self.outcome.bad += bad
            if not self.outcome.reason:
                self.outcome.reason = self._why(batch.payload(first_bad))
        return taken, left

    def _why(self, payload: bytes) -> str:
        try:
            layout_of(self.kind, payload)
        except LayoutError as error:
            return str(error)
        return "a message has too many parts"

    def _learn(self, batch: Payloads, row: int) -> int:
        """Learn the layout of one payload and decode what is like it; return the first row left, or −1."""
        try:
            payload = batch.payload(row)
            layout = layout_of(self.kind, payload)
        except LayoutError as error:
            if self.fixed and not self.walked and (known := self._compile(self.fixed[0].layout)):
                return self._walked(known, batch)[1]  # tells damaged payloads without walking over each here
            self.outcome.bad += 1
            self.outcome.reason = self.outcome.reason or str(error)
            self.spent += error.steps
            self.store.owner[batch.slots[row]] = BAD
            return self._next(batch, row)
        for place, count in layout.counts.items():
            if count <= MAX_ELEMENTS:
                site = tuple(p for p in place if isinstance(p, str))
                self.room[site] = max(self.room.get(site, 0), 1 << (count - 1).bit_length() if count else 0)
        waiting = int(np.count_nonzero(self.store.owner[batch.slots] == FREE))
        left = row
        if self.tried < MAX_LAYOUTS and layout.size >= 8:
            self.tried += 1
            plan = _Fixed(layout, self.store)
            taken, left = self._fixed(plan, batch)
            if taken >= _WORTH * waiting:
                self.fixed.append(plan)
                return left
            if left < 0:
                return left
        return self._program(layout, payload, batch, row, left)

    def _compile(self, layout: Layout) -> _Walked | None:
        """Compile a program and put it before all others; None where there are too many or it would be too wide."""
        if len(self.walked) >= MAX_PROGRAMS or self.wide >= _TRIES:
            return None
        try:
            program = Compiler(self.kind, layout, self.room).run()
        except TooWide:
            self.wide += 1
            return None
        plan = _Walked(program, layout.skipped, self.store)
        self.walked = [plan, *(w for w in self.walked if w.program.shape != program.shape)]
        return plan

    def _program(self, layout: Layout, payload: bytes, batch: Payloads, row: int, left: int) -> int:
        """Compile a program for a payload's shape and decode what follows it."""
        plan = self._compile(layout)
        if plan is not None:
            left = self._walked(plan, batch)[1]
        if self.store.owner[batch.slots[row]] == FREE:  # slow fallback: shapes that hardly repeat
            self._single(layout, payload, int(batch.slots[row]))
            self.store.owner[batch.slots[row]] = BAD
            return self._next(batch, row)
        return left

    def _single(self, layout: Layout, payload: bytes, slot: int) -> None:
        self.outcome.slow += 1
        columns = {}
        for s in layout.slots:
            order = "" if width_of(s.dtype) == 1 else layout.dialect.order
            value = np.frombuffer(payload, f"{order}{s.dtype}".replace("?", "u1"), 1, s.offset)
            columns[s.path] = value.astype(value.dtype.newbyteorder("="))
            if s.dtype == "?":
                columns[s.path] = np.minimum(columns[s.path], 1)
        self.store.add(Part(np.array([slot]), columns, layout.skipped))

    def _next(self, batch: Payloads, row: int) -> int:
        """Return the first row behind `row` that nobody owns, or −1."""
        rest = np.flatnonzero(self.store.owner[batch.slots[row + 1 :]] == FREE)
        return row + 1 + int(rest[0]) if len(rest) else -1
