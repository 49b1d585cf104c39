"""What a mission would have shown: the smallest fault of each part that could not have stayed unseen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from diagnosis.results.clearing_rows import DetectabilityRow, DetectabilityTable, DetectabilityTrace
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Kind
from replay.faults import Side


class Deviation(StrEnum):
    """How a part deviates: the rows of the fault tables, and what lies beside them."""

    INEFFICIENT = "inefficient"
    NO_SIGNAL = "no_signal"
    STUCK = "stuck"
    EXCESS = "excess"
    OFFSET = "offset"
    NOISY = "noisy"
    DELAY = "delay"


@dataclass(frozen=True)
class Detectable:
    """How large a fault must be to be found.

    Attributes
    ----------
    kind, component, side
        The part.
    deviation : Deviation
        What is wrong with it.
    for_s : float or None
        How long [s], beginning anywhere while the part is driven; None: over the whole mission.
    size : float or None
        Smallest size that the mission would have shown at 95 % of such places, in `unit`; None: it would not.
    unit : str
        ``1``: share of the true value; else m/s (of joints their unit of speed, in documents), rad or s.
    share : float or None
        Share of the places [1] at which a fault of the size that counts, a signal that is lost or one that stays at its last
        value would have been found; None for what has no such size.
    places : int
        Places that were tried; 0: the part is never driven for so long.
    told : Side
        The side that such a fault would be ascribed to; the union where the evidence tells only that one of both failed.
    """

    kind: Kind
    component: str
    side: Side
    deviation: Deviation
    for_s: float | None
    size: float | None
    unit: str
    share: float | None
    places: int
    told: Side


class Power(NamedTuple):
    """What a family of evidence says of one side of a part that it has judged; fields as in `Detectable`."""

    deviation: Deviation
    for_s: float | None
    size: float | None
    unit: str
    share: float | None
    places: int


class Powers(NamedTuple):
    """All that a family says of one side.

    Attributes
    ----------
    rows : tuple[Power, ...]
        By deviation and length.
    told : Side
        The side that such a fault would be ascribed to.
    start_s, loss : tuple
        As in `Trace`.
    """

    rows: tuple[Power, ...]
    told: Side
    start_s: tuple[float, ...] = ()
    loss: tuple[float | None, ...] = ()


@dataclass(frozen=True)
class Trace:
    """Over time, the smallest loss of ten seconds that would have been found.

    Attributes
    ----------
    kind, component, side
        The part.
    start_s : tuple[float, ...]
        When such a loss begins [s].
    loss : tuple[float | None, ...]
        The smallest loss [1]; None: none would have been.
    """

    kind: Kind
    component: str
    side: Side
    start_s: tuple[float, ...]
    loss: tuple[float | None, ...]


@dataclass(frozen=True)
class Detectability:
    """All rows and traces of a mission."""

    rows: tuple[Detectable, ...]
    traces: tuple[Trace, ...]


def detectability_table(found: Detectability, words: MachineWords) -> DetectabilityTable:
    """For ``report.json``."""
    return {"rows": [_row(d, words) for d in found.rows], "traces": [_trace(t) for t in found.traces]}


def _row(d: Detectable, words: MachineWords) -> DetectabilityRow:
    return {
        "component": d.component,
        "side": d.side,
        "deviation": d.deviation,
        "for_s": d.for_s,
        "size": d.size,
        "unit": words.unit(d.unit),
        "share": d.share,
        "places": d.places,
        "told": d.told,
    }


def _trace(t: Trace) -> DetectabilityTrace:
    return {"component": t.component, "side": t.side, "start_s": list(t.start_s), "loss": list(t.loss)}


def of_part(rows: Sequence[DetectabilityRow], component: str, side: str) -> list[DetectabilityRow]:
    """Rows of one part."""
    return [r for r in rows if (r["component"], r["side"]) == (component, side)]
