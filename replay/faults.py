"""One vocabulary of faults for injection, truth files and diagnosis: L4, L8 and the paper's two tables."""

from __future__ import annotations

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


#: Rows of the tables, which can be written into a log.
TABLE_MODES = (FaultMode.STUCK, FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT, FaultMode.NOISY)
#: Modes that leave nothing of the signal (ε = 1).
TOTAL = frozenset({FaultMode.STUCK, FaultMode.NO_SIGNAL})


class Side(StrEnum):
    """Where a fault sits; the union only for pairs that cannot be told apart."""

    SENSOR = "sensor"
    ACTUATOR = "actuator"
    SENSOR_OR_ACTUATOR = "sensor_or_actuator"

    @property
    def sides(self) -> tuple[Side, ...]:
        """The side itself; of the union both."""
        return (Side.SENSOR, Side.ACTUATOR) if self is Side.SENSOR_OR_ACTUATOR else (self,)


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
#: States that are judgements.
DECIDED = FAULT_STATES | {State.HEALTHY}
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
