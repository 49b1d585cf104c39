"""The table of fault rows: priors, words, colours and signs of the paper's two tables, and of all other states.

A row is a side and a mode. Whatever names or shows a row looks it up here: codes of the compiled recursions, JSON names,
labels of pages and terminal, titles, advice, colours, signs and curves. What a row makes of a signal says
`replay.faults.TABLE_ROWS`; which filters stand for it says the family of evidence that sees it.

A new row is a member of `replay.faults.FaultMode` and `State`, an entry in `replay.faults.TABLE_ROWS`, in `FAULT_ROWS`, in
`LOOKS` and in the tables of `diagnosis.decision.advice`, and a model with its filter in at least one family, such as `diagnosis.estimation.fault_models`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from replay.faults import FaultMode, Side, State


@dataclass(frozen=True)
class FaultRow:
    """One row of the tables.

    Attributes
    ----------
    side : Side
        `SENSOR` (L4) or `ACTUATOR` (L8).
    mode : FaultMode
        The row's mode, which is also its name in JSON.
    prior : float
        Probability of the row before any evidence, healthy having what the rows of its side leave.
    label : str
        Heading: ``No signal``.
    words : str
        To follow *was*: ``without signal``.
    title : str
        Title of a fault whose size is known, with any of ``{part}``, ``{mean}`` and ``{rms}`` of the saturation term and
        ``{lost}``, what is lost in words; without it, or with a size not known, part and label.
    """

    side: Side
    mode: FaultMode
    prior: float
    label: str
    words: str
    title: str = ""


FAULT_ROWS: tuple[FaultRow, ...] = (
    FaultRow(Side.SENSOR, FaultMode.STUCK, 0.05, "Stuck", "stuck", "{part} stuck at {mean}"),
    FaultRow(Side.SENSOR, FaultMode.NO_SIGNAL, 0.05, "No signal", "without signal", "{part}: no signal"),
    FaultRow(
        Side.SENSOR,
        FaultMode.INEFFICIENT,
        0.05,
        "Inefficient",
        "inefficient",
        "{part} inefficient, {lost}",
    ),
    FaultRow(
        Side.SENSOR,
        FaultMode.NOISY,
        0.05,
        "Noisy",
        "noisy",
        "{part} noisy, {rms} r.m.s. of noise",
    ),
    FaultRow(Side.ACTUATOR, FaultMode.STUCK, 0.05, "Stuck", "stuck", "{part} stuck at {mean}"),
    FaultRow(Side.ACTUATOR, FaultMode.NO_SIGNAL, 0.05, "No signal", "without signal", "{part}: no signal"),
    FaultRow(
        Side.ACTUATOR,
        FaultMode.INEFFICIENT,
        0.05,
        "Inefficient",
        "inefficient",
        "{part} inefficient, {lost}",
    ),
    FaultRow(
        Side.ACTUATOR,
        FaultMode.NOISY,
        0.05,
        "Disturbed",
        "disturbed",
        "{part} disturbed, {rms} r.m.s. of noise",
    ),
)


@dataclass(frozen=True)
class StateLook:
    """How a mode or state is shown, whatever its side.

    Attributes
    ----------
    label : str
        Heading where no side is known.
    sign : str
        One character for the terminal.
    light, dark : str
        Colour on light and dark pages; empty for states that have none of their own.
    terminal : str
        Style in the terminal.
    glyph : str
        Its symbol in a square of 12 by 12, as SVG; empty: a question mark.
    dash : str
        How its curve is drawn: ``solid``, ``dash`` or ``dot``.
    """

    label: str
    sign: str = ""
    light: str = ""
    dark: str = ""
    terminal: str = ""
    glyph: str = ""
    dash: str = "solid"


_SOLID = 'fill="currentColor"'
_LINE = 'fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round" stroke-linejoin="round"'

LOOKS: dict[str, StateLook] = {
    State.HEALTHY: StateLook(
        "Healthy", "✓", "#3a9a82", "#2fa98c", "#2fa98c", f'<path d="M2.2 6.3l2.6 2.7 5-5.6" {_LINE}/>'
    ),
    State.STUCK: StateLook(
        "Stuck",
        "■",
        "#b63a00",
        "#e4571e",
        "bold #e4571e",
        f'<rect x="2" y="2" width="8" height="8" rx="1" {_SOLID}/>',
    ),
    State.NO_SIGNAL: StateLook(
        "No signal", "✕", "#1b2430", "#f4f7fa", "bold reverse", f'<path d="M2 2l8 8M10 2l-8 8" {_LINE}/>', "dash"
    ),
    State.INEFFICIENT: StateLook(
        "Inefficient", "▼", "#f2b11b", "#ffd45c", "#d99a00", f'<path d="M6 10.4 1.4 2.6h9.2z" {_SOLID}/>'
    ),
    State.NOISY: StateLook(
        "Noisy",
        "∿",
        "#7d6fd0",
        "#8c80f2",
        "#8c80f2",
        f'<path d="M1 6.4l1.8-3.6 2.6 6.6L7.8 2.6l1.8 6L11 6" {_LINE}/>',
        "dot",
    ),
    State.OUTSIDE_TABLE: StateLook(
        "Outside the tables", "?", "#a0522d", "#d49a78", "bold", f'<path d="M6 1l5 5-5 5-5-5z" {_SOLID}/>'
    ),
    State.NOT_EXCITED: StateLook("Not excited"),
    State.MASKED: StateLook("Masked by another fault"),
    State.SLIP: StateLook("Wheel slip"),
    State.NO_DATA: StateLook("No data"),
    State.NOT_ASSESSED: StateLook("Not assessed"),
}

#: Modes of both tables by their code in compiled recursions and arrays of probabilities; 0 is healthy.
ROWS: tuple[State, ...] = (State.HEALTHY, *dict.fromkeys(State(row.mode.value) for row in FAULT_ROWS))


def row_of(side: str, mode: str) -> FaultRow | None:
    """The row of a side and mode, of the union of both sides the sensor's; None for what is no row of that side's table."""
    own = Side.ACTUATOR if side == Side.ACTUATOR else Side.SENSOR
    return next((row for row in FAULT_ROWS if row.side is own and row.mode == mode), None)


def codes(holds: Callable[[FaultMode], bool], side: Side | None = None) -> tuple[int, ...]:
    """Codes of the modes of which something holds, in order; of one side's rows alone where it is given."""
    modes = dict.fromkeys(row.mode for row in FAULT_ROWS if side is None or row.side is side)
    return tuple(sorted(ROWS.index(State(mode.value)) for mode in modes if holds(mode)))


def codes_of(side: Side) -> tuple[int, ...]:
    """Codes of the rows of one side, healthy before them."""
    return (0, *codes(lambda _: True, side))


def prior(code: int, side: Side = Side.SENSOR) -> float:
    """Probability of a row of one side before any evidence, by its code; 0 for a row that its table lacks.

    A probability [1].
    """
    rows = {ROWS.index(State(row.mode.value)): row.prior for row in FAULT_ROWS if row.side is side}
    return rows.get(code, 0.0) if code else 1.0 - sum(rows.values())


def state_label(state: str, side: str = "") -> str:
    """Heading of a mode or state, by its side where that is known; words of other tools' documents stay."""
    found = row_of(side, state) if side in (Side.SENSOR, Side.ACTUATOR) else None
    if found is not None:
        return found.label
    look = LOOKS.get(state)
    return state if look is None else look.label


def mode_words(side: str, mode: str) -> str:
    """A fault mode in words for its side, to follow *was*; words of other tools' documents stay.

    Of a part of which either side may be faulty, a standstill is no missing signal.
    """
    if side == Side.SENSOR_OR_ACTUATOR and mode == FaultMode.NO_SIGNAL:
        return "without signal or motion"
    found = row_of(side, mode)
    return found.words if found is not None else state_label(mode).lower()
