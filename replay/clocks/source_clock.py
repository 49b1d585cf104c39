"""How the clock of one source relates to the mission's, and the sentence that says so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Literal

from replay.number_words import told

Method = Literal["reference", "estimated", "common", "as recorded", "given"]


@dataclass(frozen=True)
class SourceClock:
    """How the clock of one source relates to the mission's.

    Attributes
    ----------
    source : str
        The file.
    reference : str
        File with whose signals it was compared; empty where it was not.
    method : str
        ``reference`` (its clock is the mission's), ``estimated`` (offset and drift were applied), ``common`` (measured, and
        too small to be told from none: stamps are unchanged), ``given`` (applied as the machine file says), ``as recorded``
        (unchanged: asked for, or nothing to compare, see `reason`).
    offset_s : float
        Seconds that a stamp at the source's first sample gets, or for ``common`` would have got.
    drift_ppm : float
        Change of the offset [microseconds per second].
    uncertainty_s : float or None
        95 % bound of the error of the offset anywhere in the source [s]; None where nothing was measured.
    signals : tuple[str, ...]
        Signals that were compared.
    overlap_s : float
        Time that both files cover after that [s].
    reason : str
        Why nothing was estimated; else empty.
    """

    source: str
    reference: str
    method: Method
    offset_s: float = 0.0
    drift_ppm: float = 0.0
    uncertainty_s: float | None = None
    signals: tuple[str, ...] = ()
    overlap_s: float = 0.0
    reason: str = ""

    @property
    def sentence(self) -> str:
        """What was found and done, for the report; empty for the reference."""
        name, base = PurePath(self.source).name, PurePath(self.reference).name
        change = f"{_seconds(self.offset_s)} at its start and {told(self.drift_ppm, '+.1f')} ppm"
        if self.method == "estimated":
            return (
                f"{name}: its stamps were moved onto the clock of {base} by {change} (95 % within ±{_size(self.uncertainty_s)} "
                f"throughout), from {some(self.signals)}, recorded in both for {self.overlap_s:.0f} s"
            )
        if self.method == "common":
            return (
                f"{name} and {base} share one clock: {change} is no more than the ±{_size(self.uncertainty_s)} that "
                f"{some(self.signals)} leave open; stamps are unchanged"
            )
        if self.method == "given":
            return f"{name}: its stamps were moved by {change}, as the machine file says"
        if self.reason:
            return (
                f"{name}: its clock could not be compared with {base}: {self.reason}. "
                "Set clock_offset and clock_drift in the machine file's [sources] if they are known, or clock = "
                '"as recorded" if the clocks are common'
            )
        return f"{name}: its stamps are taken as recorded, as the machine file says" if self.reference else ""


def _seconds(value: float) -> str:
    size = abs(value)
    if size < 0.9995:
        return f"{told(value * 1e3, '+.2f')} ms"
    return f"{told(value, '+.4f')} s" if size < 1000 else f"{told(value, '+.3f')} s ({told(value / 3600, '+.3f')} h)"


def _size(value: float | None) -> str:
    return "?" if value is None else f"{value * 1e3:.2g} ms" if value < 0.9995 else f"{value:.2g} s"


def some(names: Sequence[str]) -> str:
    """Return the first names and how many more there are."""
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
