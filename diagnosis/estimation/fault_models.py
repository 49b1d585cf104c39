"""Rows of the fault table as Kalman models of one channel; `diagnosis.estimation.viterbi` finds which of them holds when.

Every row of the two tables is a model of a measured y against a reference x (v against v_true by L4, u_applied against
u_a by L8):

healthy      y = x + n, or y = x + b + n with a small passing mismatch b of the two instruments; of a valve, x as it was of late
             where it only jitters
stuck        y = c, a constant c
no_signal    y = 0
inefficient  y = δ·x + n, δ constant
noisy        y = δ·x + δ̄ + n, δ̄ drifting (random walk) or white with one of several powers

The codes of the rows are those of `diagnosis.results.fault_rows`; a row may have several models. Their filters are in
`diagnosis.estimation.filter_kernel`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.fault_rows import ROWS, codes, codes_of
from replay.faults import CONSTANT_VALUE, Side, State

Array = NDArray[np.float64]

HEALTHY, STUCK, NO_SIGNAL, INEFFICIENT, NOISY = (
    ROWS.index(s) for s in (State.HEALTHY, State.STUCK, State.NO_SIGNAL, State.INEFFICIENT, State.NOISY)
)
#: Rows by what they leave of the signal; see `replay.faults.TABLE_ROWS`.
TOTAL_ROWS, SCALED_ROWS, VARYING_ROWS = (
    codes(lambda m: m.total),
    codes(lambda m: m.scaled),
    codes(lambda m: m.varying),
)
#: Rows that hold one value, and those with one constant unknown, value or gain: another one is another fault.
VALUE_ROWS = codes(lambda m: m in CONSTANT_VALUE)
STEADY_ROWS = tuple(sorted(VALUE_ROWS + SCALED_ROWS))
#: Rows without a saturation term, which show only while the reference moves.
UNSATURATED_ROWS = tuple(row for row in range(1, len(ROWS)) if row not in VALUE_ROWS + VARYING_ROWS)

#: Models of the noisy row: random walk of δ̄ [span/√s] and white noise [healthy noise].
NOISY_MODELS = np.array([[0.3, 1.0], [0.06, 1.0], [0.012, 1.0], [0.06, 3.0], [0.06, 8.0], [0.06, 25.0], [0.06, 80.0]])
#: Places of the models: y = x, y = c, y = 0, y = δ·x, y = x + b; those of the noisy row follow.
EXACT, CONSTANT, ZERO, GAIN, MISMATCH, FIRST_NOISY = range(6)
ROW_OF_MODEL = np.array([HEALTHY, STUCK, NO_SIGNAL, INEFFICIENT, HEALTHY] + [NOISY] * len(NOISY_MODELS))
MODELS = ROW_OF_MODEL.size

_OUTLIER = -18.0
MISMATCH_S = 0.05  # correlation time of a passing mismatch of two healthy instruments
_STEADY_S = 0.2  # over which x is taken to see whether it is steady
_DRIFT_COST = 0.04  # what the noisy row must gain per sample to be preferred


class FilterBank(NamedTuple):
    """Constants of the filters of all models of one channel, for the compiled recursions; in the channel's unit.

    Attributes
    ----------
    r, constant_r : float
        Variance of n while healthy, and of y while stuck.
    span : float
        Largest plausible magnitude of y.
    dt : float
        Step [s].
    switch_cost : float
        Minus the log-probability of entering a row at one sample.
    mismatch_r : float
        Variance of the passing mismatch b.
    log_r, log_constant_r : float
        ln(2π·r) of both.
    floor : float
        Least log-likelihood of one sample: that of an outlier.
    decay : float
        What is left of b after a step [1].
    drift_cost : float
        What the noisy row must gain per sample.
    jitter : float
        Of x at most, which a healthy channel need not join in.
    recent : float
        What is left after a step of what x was [1].
    admitted : NDArray[np.bool_], shape (models,)
        Models of rows that the table of the channel's side has.
    """

    r: float
    constant_r: float
    span: float
    dt: float
    switch_cost: float
    mismatch_r: float
    log_r: float
    log_constant_r: float
    floor: float
    decay: float
    drift_cost: float
    jitter: float
    recent: float
    admitted: NDArray[np.bool_]


@dataclass(frozen=True)
class ModeModel:
    """Noise and prior of one channel; all in the channel's unit.

    Attributes
    ----------
    noise : float
        Standard deviation of y − x while healthy.
    constant_noise : float
        Standard deviation of y while stuck: the rounding step of a sensor, the noise of a spool sensor.
    tolerance : float
        Standard deviation of the slow mismatch between y and x while healthy.
    span : float
        Largest plausible magnitude of y.
    switch_cost : float
        Minus the log-probability of entering a row at one sample.
    dt : float
        Step [s].
    mismatch_s : float
        Correlation time of that mismatch [s].
    drift_cost : float
        What the noisy row must gain per sample to be preferred.
    own_cost : float
        What the noisy row gains per sample at most by explaining x's own noise away, which says nothing about y.
    jitter : float
        Of x at most, which a healthy channel need not join in: beside a steady command a healthy valve stands, too.
    side : Side
        `SENSOR` or `ACTUATOR`: whose table's rows the channel may follow.
    """

    noise: float
    constant_noise: float
    tolerance: float
    span: float
    switch_cost: float
    dt: float
    mismatch_s: float = MISMATCH_S
    drift_cost: float = _DRIFT_COST
    own_cost: float = 0.0
    jitter: float = 0.0
    side: Side = Side.SENSOR

    def admitted(self) -> NDArray[np.bool_]:
        """Models of rows that the table of the channel's side has, shape (models,)."""
        return np.isin(ROW_OF_MODEL, codes_of(self.side))

    def bank(self) -> FilterBank:
        """Constants of the compiled recursions."""
        r, constant_r = self.noise**2, self.constant_noise**2
        return FilterBank(
            r=float(r),
            constant_r=float(constant_r),
            span=float(self.span),
            dt=float(self.dt),
            switch_cost=float(self.switch_cost),
            mismatch_r=float(self.tolerance**2),
            log_r=float(np.log(2 * np.pi * r)),
            log_constant_r=float(np.log(2 * np.pi * constant_r)),
            floor=_OUTLIER - float(np.log(self.span)),
            decay=float(np.exp(-self.dt / self.mismatch_s)),
            drift_cost=float(self.drift_cost + self.own_cost),
            jitter=float(self.jitter),
            recent=float(np.exp(-self.dt / _STEADY_S)),
            admitted=self.admitted(),
        )
