"""One vocabulary of faults for injection, truth files and diagnosis: L4, L8 and the paper's two tables.

A new row is a member of `FaultMode` and of `State`, and an entry in `TABLE_ROWS`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray


class FaultMode(StrEnum):
    """Rows of the two tables; `NOISY` is noise-affected (sensor) or disturbance-affected (actuator)."""

    STUCK = "stuck"
    NO_SIGNAL = "no_signal"
    INEFFICIENT = "inefficient"
    NOISY = "noisy"
    OUTSIDE_TABLE = "outside_table"

    @property
    def total(self) -> bool:
        """Whether nothing is left of the signal (ε = 1): stuck or no signal."""
        return self in TOTAL

    @property
    def varying(self) -> bool:
        """Whether the saturation term varies in time: noise, a disturbance."""
        return self in VARYING

    @property
    def scaled(self) -> bool:
        """Whether the signal is nothing but a share of what it should be: inefficient."""
        return self in SCALED


class Side(StrEnum):
    """Where a fault sits; the union only for pairs that cannot be told apart."""

    SENSOR = "sensor"
    ACTUATOR = "actuator"
    SENSOR_OR_ACTUATOR = "sensor_or_actuator"

    @property
    def sides(self) -> tuple[Side, ...]:
        """The side itself; of the union both."""
        return (Side.SENSOR, Side.ACTUATOR) if self is Side.SENSOR_OR_ACTUATOR else (self,)


class Saturation(StrEnum):
    """The saturation term of a row: none, one value that is not 0, or any mean with a part that varies."""

    NONE = "none"
    VALUE = "value"
    VARYING = "varying"


#: A range of values, its lower end first.
Range = tuple[float, float]


@dataclass(frozen=True)
class Drawn:
    """How the size of a random fault is drawn, in units of the paper's machine; see `FaultSpec`.

    Attributes
    ----------
    epsilon : Range or None
        ε; None: 1.
    sat, steer_sat : Range or None
        Magnitude of the mean of the saturation term, of a wheel and of a steering axle (None: as a wheel's); its sign is
        drawn too.
    held_share : float
        Share of the faults that hold the value at onset instead.
    sat_std : Range or None
        Standard deviation of the varying part; None: 0.
    sat_tau_s : tuple[float, ...]
        Its correlation time [s]: one of these.
    """

    epsilon: Range | None = None
    sat: Range | None = None
    steer_sat: Range | None = None
    held_share: float = 0.0
    sat_std: Range | None = None
    sat_tau_s: tuple[float, ...] = (0.0,)


@dataclass(frozen=True)
class TableRow:
    """A row of the paper's two tables: what it makes of a signal by L4 (sensor) or L8 (actuator), and usual sizes of it.

    Attributes
    ----------
    side : Side
        `SENSOR` or `ACTUATOR`.
    mode : FaultMode
        The row's mode; what it makes of a signal is the same on both sides.
    total : bool
        Whether ε = 1; else ε lies between 0 and 1.
    saturation : Saturation
        Its saturation term.
    epsilon, sat, sat_std, sat_tau_s : float
        Middling severity for the paper's machine; see `FaultSpec`.
    drawn : Drawn or None
        Sizes of random faults; None: random faults are not of this row.
    """

    side: Side
    mode: FaultMode
    total: bool
    saturation: Saturation
    epsilon: float = 1.0
    sat: float = 0.0
    sat_std: float = 0.0
    sat_tau_s: float = 0.0
    drawn: Drawn | None = None


TABLE_ROWS: tuple[TableRow, ...] = (
    TableRow(
        Side.SENSOR,
        FaultMode.STUCK,
        True,
        Saturation.VALUE,
        sat=math.nan,
        drawn=Drawn(sat=(0.05, 0.35), steer_sat=(0.08, 0.4), held_share=0.5),
    ),
    TableRow(Side.SENSOR, FaultMode.NO_SIGNAL, True, Saturation.NONE, drawn=Drawn()),
    TableRow(
        Side.SENSOR,
        FaultMode.INEFFICIENT,
        False,
        Saturation.NONE,
        epsilon=0.5,
        drawn=Drawn(epsilon=(0.25, 0.75)),
    ),
    TableRow(
        Side.SENSOR,
        FaultMode.NOISY,
        False,
        Saturation.VARYING,
        epsilon=0.4,
        sat=0.05,
        sat_std=0.12,
        sat_tau_s=0.05,
        drawn=Drawn(epsilon=(0.25, 0.5), sat=(0.0, 0.1), sat_std=(0.06, 0.2), sat_tau_s=(0.0, 0.05)),
    ),
    TableRow(Side.ACTUATOR, FaultMode.STUCK, True, Saturation.VALUE, sat=math.nan, drawn=Drawn(sat=(0.04, 0.14))),
    TableRow(Side.ACTUATOR, FaultMode.NO_SIGNAL, True, Saturation.NONE, drawn=Drawn()),
    TableRow(
        Side.ACTUATOR,
        FaultMode.INEFFICIENT,
        False,
        Saturation.NONE,
        epsilon=0.5,
        drawn=Drawn(epsilon=(0.25, 0.75)),
    ),
    TableRow(
        Side.ACTUATOR,
        FaultMode.NOISY,
        False,
        Saturation.VARYING,
        epsilon=0.4,
        sat=0.08,
        sat_std=0.08,
        sat_tau_s=0.8,
        drawn=Drawn(epsilon=(0.3, 0.5), sat=(0.05, 0.12), sat_std=(0.05, 0.12), sat_tau_s=(0.8,)),
    ),
)

#: Modes of the tables, which can be written into a log.
TABLE_MODES: tuple[FaultMode, ...] = tuple(dict.fromkeys(row.mode for row in TABLE_ROWS))
#: Modes that leave nothing of the signal (ε = 1).
TOTAL = frozenset(row.mode for row in TABLE_ROWS if row.total)
#: Modes whose saturation term varies in time.
VARYING = frozenset(row.mode for row in TABLE_ROWS if row.saturation is Saturation.VARYING)
#: Modes that hold one value and nothing else.
CONSTANT_VALUE = frozenset(row.mode for row in TABLE_ROWS if row.saturation is Saturation.VALUE)
#: Modes that are a share of the signal and nothing else.
SCALED = frozenset(row.mode for row in TABLE_ROWS if not row.total and row.saturation is Saturation.NONE)


def table_row(side: Side, mode: FaultMode) -> TableRow | None:
    """The row of a side and mode; None where that side's table has none."""
    return next((row for row in TABLE_ROWS if row.side is side and row.mode is mode), None)


def drawn_modes(side: Side) -> tuple[FaultMode, ...]:
    """Modes of a side that random faults are of, in the order of the table."""
    return tuple(row.mode for row in TABLE_ROWS if row.side is side and row.drawn is not None)


class State(StrEnum):
    """Condition of one component and side at one moment; the fault modes are states too."""

    HEALTHY = "healthy"
    STUCK = "stuck"
    NO_SIGNAL = "no_signal"
    INEFFICIENT = "inefficient"
    NOISY = "noisy"
    OUTSIDE_TABLE = "outside_table"
    NOT_EXCITED = "not_excited"
    MASKED = "masked"
    SLIP = "slip"
    NO_DATA = "no_data"
    NOT_ASSESSED = "not_assessed"


FAULT_STATES = frozenset(State(m.value) for m in FaultMode)
#: States that are judgements: healthy and every mode, in the order of the enumerations.
DECIDED: tuple[State, ...] = (State.HEALTHY, *(State(m.value) for m in FaultMode))
#: States that say why there is no judgement, in the order of the enumeration.
UNDECIDED = tuple(s for s in State if s not in DECIDED)


@dataclass(frozen=True)
class FaultSpec:
    """One fault to inject, by L4 or L8.

    Attributes
    ----------
    component : str
        Wheel (``FR``) or steering axle (``front``).
    side : Side
        `SENSOR` or `ACTUATOR`.
    mode : FaultMode
        Row of the table.
    start_s, stop_s : float
        Interval in mission time [s], half open.
    epsilon : float
        ε of L4 or L8, 0…1; 1 for stuck and no signal.
    sat : float
        Mean of the saturation term: r·ω_sat [m/s] for a wheel sensor, u_sat [fraction of full opening] for an
        actuator, φ_sat [rad] for a steering sensor. NaN for ``stuck`` means the value at onset.
    sat_std : float
        Standard deviation of the varying part of the saturation term, same unit.
    sat_tau_s : float
        Correlation time of the varying part [s]; 0 for white.
    ramp_s : float
        Time over which ε grows linearly from 0 to `epsilon` [s]; 0 for an abrupt onset.
    """

    component: str
    side: Side
    mode: FaultMode
    start_s: float
    stop_s: float
    epsilon: float = 1.0
    sat: float = 0.0
    sat_std: float = 0.0
    sat_tau_s: float = 0.0
    ramp_s: float = 0.0


def fault_affected(
    accurate: NDArray[np.float64], epsilon: NDArray[np.float64], saturation: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Apply a fault to a signal: L4 for a sensor, L8 (7) for an actuator.

    Parameters
    ----------
    accurate : NDArray[np.float64], shape (n,)
        v_a = r·ω_a [m/s] or u_a [fraction of full opening].
    epsilon : NDArray[np.float64], shape (n,)
        ε, 0…1.
    saturation : NDArray[np.float64], shape (n,)
        r·ω_sat [m/s] or u_sat [fraction of full opening].

    Returns
    -------
    NDArray[np.float64], shape (n,)
        (1 − ε)·accurate + ε·saturation.
    """
    return (1.0 - epsilon) * accurate + epsilon * saturation
