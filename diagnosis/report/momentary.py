"""Which row is the most probable from moment to moment of a fault, where that is not the one that it is stated as.

The plot of mode probabilities weighs each moment by what came until then, the explanations of a fault the whole of it: a valve that is off
by a constant is fitted by one row after another.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.pages.labels import grouped
from diagnosis.report.rows import Columns
from diagnosis.results.document import IntervalRow
from diagnosis.results.fault_rows import state_label
from replay.faults import DECIDED, Side, State

_MOSTLY = 0.9  # of a fault, in which its row is the most probable: no word is due
_LEAST = 0.02  # of a fault: a row that is the most probable for less is not named


def momentary_words(fault: IntervalRow, columns: Columns, axis: tuple[float, float], per: int = 1) -> str:
    """How long each row is the most probable of its moment, in a sentence; empty where the plot shows mostly the row that is stated.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    columns : Columns
        Columns that hold samples.
    axis : tuple[float, float]
        Time of the first row and between rows [s].
    per : int
        Samples whose extremes two rows hold, 1 where each row is a sample.
    """
    sides = Side(fault["side"]).sides
    base = f"evidence.{fault['component']}.{sides[0]}.p_"
    modes = [m for m in DECIDED if base + m in columns]
    if len(sides) > 1 or len(modes) < 2:
        return ""
    first, last = (round((fault[key] - axis[0]) / axis[1]) for key in ("start_s", "stop_s"))
    chances = np.array([columns[base + m][max(0, first) : last] for m in modes], dtype=np.float64)
    if per > 1:  # of extremes their middle
        pairs = chances.shape[1] // 2
        chances = chances[:, : 2 * pairs].reshape(len(modes), pairs, 2).mean(axis=2)
    chances = chances[:, np.isfinite(chances).all(axis=0)]
    if not (chances.size > 0 and np.ptp(chances, axis=1).any()):  # rows of whole faults do not change
        return ""
    top = np.argmax(chances, axis=0)
    shares = {m: float(np.mean(top == k)) for k, m in enumerate(modes)}
    if shares.get(State(fault["mode"]), 0.0) >= _MOSTLY:
        return ""
    named = sorted((m for m in modes if shares[m] >= _LEAST), key=lambda m: -shares[m])
    changes = int(np.count_nonzero(np.diff(top)))
    return (
        f"From moment to moment, as the plot of mode probabilities has it, {_listed(named, shares, sides[0])}"
        f"{_changes(changes)}; the bars weigh the fault as a whole."
    )


def _listed(modes: Sequence[State], shares: dict[State, float], side: Side) -> str:
    """Rows with their shares: ``disturbed is the most probable for 82 % of it, healthy for 12 %``."""
    first, *rest = (f"{state_label(m, side).lower()} {{}}for {100 * shares[m]:.0f} %" for m in modes)
    return ", ".join([first.format("is the most probable ") + " of it", *(text.format("") for text in rest)])


def _changes(n: int) -> str:
    return f", with {grouped(n)} change{'' if n == 1 else 's'} from one to another" if n else ""
