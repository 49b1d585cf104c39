"""Recorded channels under their canonical names, in SI, still at their own stamps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore
from replay.log.source_options import SignalSource

#: Begin of the reason why a signal is missing whose channel, as the machine file names it, no file holds.
FILE_NAMES = "the machine file names"


@dataclass(frozen=True)
class Signal:
    """One canonical signal at its recorded stamps.

    Attributes
    ----------
    name : str
        Canonical name (``wheel.FR.v``).
    stamps : NDArray[np.int64], shape (n,)
        Nanoseconds since 1970, strictly increasing.
    values : NDArray[np.float64], shape (n,)
        SI values; NaN where NaN was recorded.
    origin : SignalSource
        The channel and conversion it came from.
    source : str
        The file it came from.
    guessed : bool
        Whether the mapping was found automatically rather than given.
    recorded_with : str
        For channels of a table file: the first one that stands on the same time column; else empty.
    """

    name: str
    stamps: NDArray[np.int64]
    values: NDArray[np.float64]
    origin: SignalSource
    source: str
    guessed: bool
    recorded_with: str = ""

    @property
    def group(self) -> str:
        """What is lost together: a topic's messages; of a table's rows, which hold what came apart, one quantity."""
        if self.origin.topic is not None:
            return f"{self.source} {self.origin.topic}"
        return f"{self.source} {self.recorded_with} {quantity_kind(self.name)}"


def quantity_kind(name: str) -> str:
    """Canonical name without wheel or axle: ``wheel.v`` for ``wheel.FR.v``."""
    parts = name.split(".")
    return f"{parts[0]}.{parts[-1]}"


@dataclass(frozen=True)
class Signals:
    """All mapped signals of one mission.

    Attributes
    ----------
    items : Mapping[str, Signal]
        By canonical name.
    missing : Mapping[str, str]
        Canonical names that were looked for and not found, with the reason.
    notes : tuple[str, ...]
        Guesses made and doubts about them, one sentence each.
    questions : tuple[str, ...]
        Values that the machine cannot have, each with the line of the machine file that would mend it: nothing is judged
        before they are answered.
    open_loop : bool
        Whether faults were written into the recording, so that its controller never met them.
    other_wheels : tuple[str, ...]
        Wheels that the log names and the machine does not have.
    store : ColumnStore
        Where long columns stand.
    """

    items: Mapping[str, Signal]
    missing: Mapping[str, str]
    notes: tuple[str, ...] = ()
    questions: tuple[str, ...] = ()
    open_loop: bool = False
    other_wheels: tuple[str, ...] = ()
    store: ColumnStore = field(default_factory=ColumnStore, repr=False, compare=False)

    @property
    def named_elsewhere(self) -> str:
        """The first signal that the machine file names in a channel that no file holds, and what to do about it; may be empty."""
        named = [f"{name}: {why}" for name, why in self.missing.items() if why.startswith(FILE_NAMES)]
        if not named:
            return ""
        more = f" ({len(named) - 1} more signals likewise)" if len(named) > 1 else ""
        return (
            f"{named[0]}{more}; correct its [signals], have `mfhca config init --log LOG` write them from the log, or leave [signals] out "
            "of a machine file for logs of several formats: signals are then found by their names"
        )

    def without_samples(self) -> Signals:
        """The same signals with no sample left in them."""
        items = {n: replace(s, stamps=np.empty(0, np.int64), values=np.empty(0)) for n, s in self.items.items()}
        return replace(self, items=items)
