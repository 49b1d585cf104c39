"""The table of fault rows: codes, models, priors, words and colours of the paper's two tables, and of all other states.

A row is a side and a mode. Everything that names a row, a mode or a state looks it up here: codes of the compiled
recursions, JSON names, labels of pages and terminal, colours and signs. A new row is a member of
`replay.faults.FaultMode` and one entry in `FAULT_ROWS`; which filters stand for it says each family's ``models`` module.
"""

from __future__ import annotations

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
    code : int
        Number of the mode in compiled recursions and in arrays of probabilities; 0 is healthy.
    prior : float
        Probability of the row before any evidence, healthy having what the rows leave.
    model : str
        What the measured y is of its reference x.
    label : str
        Heading: ``No signal``.
    words : str
        To follow *was*: ``without control signal``.
    """

    side: Side
    mode: FaultMode
    code: int
    prior: float
    model: str
    label: str
    words: str


FAULT_ROWS: tuple[FaultRow, ...] = (
    FaultRow(Side.SENSOR, FaultMode.STUCK, 1, 0.05, "y = c", "Stuck", "stuck"),
    FaultRow(Side.SENSOR, FaultMode.NO_SIGNAL, 2, 0.05, "y = 0", "No signal", "without signal"),
    FaultRow(Side.SENSOR, FaultMode.INEFFICIENT, 3, 0.05, "y = δ·x", "Inefficient", "inefficient"),
    FaultRow(Side.SENSOR, FaultMode.NOISY, 4, 0.05, "y = δ·x + δ̄(t)", "Noisy", "noisy"),
    FaultRow(Side.ACTUATOR, FaultMode.STUCK, 1, 0.05, "y = c", "Stuck", "stuck"),
    FaultRow(Side.ACTUATOR, FaultMode.NO_SIGNAL, 2, 0.05, "y = 0", "No signal", "without control signal"),
    FaultRow(Side.ACTUATOR, FaultMode.INEFFICIENT, 3, 0.05, "y = δ·x", "Inefficient", "inefficient"),
    FaultRow(Side.ACTUATOR, FaultMode.NOISY, 4, 0.05, "y = δ·x + δ̄(t)", "Disturbed", "disturbed"),
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
    """

    label: str
    sign: str = ""
    light: str = ""
    dark: str = ""
    terminal: str = ""


LOOKS: dict[str, StateLook] = {
    State.HEALTHY: StateLook("Healthy", "✓", "#3a9a82", "#2fa98c", "#2fa98c"),
    State.STUCK: StateLook("Stuck", "■", "#b63a00", "#e4571e", "bold #e4571e"),
    State.NO_SIGNAL: StateLook("No signal", "✕", "#1b2430", "#f4f7fa", "bold reverse"),
    State.INEFFICIENT: StateLook("Inefficient", "▼", "#f2b11b", "#ffd45c", "#d99a00"),
    State.NOISY: StateLook("Noisy", "∿", "#7d6fd0", "#8c80f2", "#8c80f2"),
    State.OUTSIDE_TABLE: StateLook("Outside the tables", "?", "#a0522d", "#d49a78", "bold"),
    State.NOT_EXCITED: StateLook("Not excited"),
    State.MASKED: StateLook("Masked by another fault"),
    State.SLIP: StateLook("Wheel slip"),
    State.NO_DATA: StateLook("No data"),
    State.NOT_ASSESSED: StateLook("Not assessed"),
}

#: Modes of the tables by their code; 0 is healthy.
ROWS: tuple[State, ...] = (State.HEALTHY, *(State(r.mode.value) for r in FAULT_ROWS if r.side is Side.SENSOR))
_ROW: dict[tuple[str, str], FaultRow] = {(r.side, r.mode): r for r in FAULT_ROWS}


def row_of(side: Side, mode: FaultMode) -> FaultRow | None:
    """The row of a side and mode, None for `OUTSIDE_TABLE`; of the union of both sides the sensor's."""
    return _ROW.get((Side.ACTUATOR if side is Side.ACTUATOR else Side.SENSOR, mode))


def prior(code: int) -> float:
    """Probability of a row before any evidence, by its code."""
    rows = {r.code: r.prior for r in FAULT_ROWS if r.side is Side.SENSOR}
    return rows.get(code, 1.0 - sum(rows.values()))


def state_label(state: str, side: str = "") -> str:
    """Heading of a mode or state, by its side where that is known; words of other tools' documents stay."""
    found = _ROW.get((side, state))
    if found is not None:
        return found.label
    look = LOOKS.get(state)
    return state if look is None else look.label


def mode_words(side: str, mode: str) -> str:
    """A fault mode in words for its side, to follow *was*; words of other tools' documents stay."""
    found = _ROW.get((Side.ACTUATOR if side == Side.ACTUATOR else Side.SENSOR, mode))
    return found.words if found is not None else state_label(mode).lower()
