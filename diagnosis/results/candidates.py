"""What a fault may be called: its row where that row has half of the probability, else *faulty* with the candidates.

A word for one row of two that are as probable would be a coin toss. Headings, tables and sentences all ask here.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from diagnosis.results.document import IntervalRow
from diagnosis.results.fault_rows import mode_words, state_label
from replay.faults import Side, State

#: What a fault is called that has no such row.
UNCLEAR = "faulty, kind unclear"
_MAJORITY = 0.5  # of the probability of any fault of the part: a row that gives its name
_CANDIDATE = 0.15  # one that is named beside others
_ROUNDED = (
    1e-6  # what documents round probabilities by, and more: sentences are made before, headings from the document
)

#: Side, mode and probability of one explanation.
Weighted = tuple[str, str, float]


def candidates(side: str, hypotheses: Iterable[Weighted]) -> tuple[str, ...]:
    """Modes that come into question, the likeliest first; empty where one of them has the majority.

    Parameters
    ----------
    side : str
        Of the fault.
    hypotheses : Iterable[Weighted]
        Its explanations.
    """
    rows: dict[str, float] = {}
    for own, mode, p in hypotheses:
        if mode != State.HEALTHY and (own == side or side == Side.SENSOR_OR_ACTUATOR):
            rows[mode] = rows.get(mode, 0.0) + p
    ranked = sorted(rows, key=lambda mode: -rows[mode])
    total = sum(rows.values())
    if len(ranked) < 2 or rows[ranked[0]] >= _MAJORITY * total - _ROUNDED:
        return ()
    return tuple(mode for mode in ranked if rows[mode] >= _CANDIDATE * total - _ROUNDED)


def candidates_of(fault: IntervalRow) -> tuple[str, ...]:
    """The same of a fault of ``report.json``."""
    return candidates(fault["side"], ((h["side"], h["mode"], h["p"]) for h in fault["hypotheses"]))


def label_of(fault: IntervalRow) -> str:
    """Heading of a fault: ``Stuck``, or ``Faulty, kind unclear``."""
    return UNCLEAR.capitalize() if candidates_of(fault) else state_label(fault["mode"], fault["side"])


def symbol_of(fault: IntervalRow) -> str:
    """Mode whose symbol and colour a fault has; ``warning`` where its kind is unclear, for a symbol is a word, too."""
    return "warning" if candidates_of(fault) else fault["mode"]


def unclear_words(side: str, modes: Sequence[str]) -> str:
    """Candidates in words, to follow *was*: ``faulty, kind unclear (stuck or inefficient)``."""
    words = [mode_words(side, mode) for mode in modes]
    return f"{UNCLEAR} ({', '.join(words[:-1])} or {words[-1]})" if len(words) > 1 else UNCLEAR
