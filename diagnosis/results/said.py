"""What is said of the machine as a whole together with when it was so: finders hand both on, and sentences are drawn from the times."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from diagnosis.results.machine_event import MachineEvent

#: Begin and end of a time [s]; the end is infinite where it goes on to the end of the log.
Span = tuple[float, float]


class Stated(NamedTuple):
    """A time as a sentence states it: its ends are rounded, so that the spans of a report are those that its reader reads.

    Attributes
    ----------
    start_s, stop_s : float
        Its ends [s]; `stop_s` is infinite where it goes on to the end of the log.
    digits : int
        Decimal places of both.
    """

    start_s: float
    stop_s: float
    digits: int

    @classmethod
    def of(cls, start_s: float, stop_s: float = math.inf, *, digits: int = 1) -> Stated:
        """The time [start_s, stop_s) [s], rounded to so many decimal places; without an end, on to the end of the log."""
        start, stop = (float(f"{x:.{digits}f}") for x in (start_s, stop_s))
        return cls(start, stop, digits)

    @property
    def start(self) -> str:
        """Its begin without a unit, as "12.0"."""
        return f"{self.start_s:.{self.digits}f}"

    @property
    def stop(self) -> str:
        """Its end without a unit, as "14.5"."""
        return f"{self.stop_s:.{self.digits}f}"

    @property
    def span(self) -> Span:
        """Both ends [s]."""
        return self.start_s, self.stop_s

    def __str__(self) -> str:
        """As "12.0–14.5 s"."""
        return f"{self.start}–{self.stop} s"


class Said(NamedTuple):
    """A sentence, or a part of one, on the machine as a whole, and when it was so.

    Attributes
    ----------
    text : str
        The words.
    spans : tuple[Span, ...]
        Begin and end of each time at which it was so [s], by time; empty where it was so throughout.
    """

    text: str
    spans: tuple[Span, ...] = ()

    def event(self, kind: Callable[[str], MachineEvent]) -> MachineEvent:
        """As an event of a kind, one of the functions of `machine_event` that make one of a text."""
        return kind(self.text).at(self.spans)
