"""Models of a wheel: the row of the tables that each stands for, and the constants of their filters.

A row may have several models: noise of several strengths is one row. A new model is a code here, its entry in `ROW_OF_MODEL`,
and what `diagnosis.wheels.step_kernel` makes of its code.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from replay.faults import FaultMode, Side

#: A row of the paper's tables; None stands for a healthy wheel.
Row = tuple[Side, FaultMode]

#: `ODD` is a healthy wheel under a load that the wheel's usual one does not explain: no row, and nothing is stated of it.
HEALTHY, ODD, S_STUCK, S_NONE, S_GAIN, S_WHITE_3, S_WHITE_8, S_WHITE_24, S_OU_SMALL, S_OU_LARGE = range(10)
A_GAIN, A_STUCK, A_NONE, A_BIAS = range(10, 14)
MODELS = 14

#: Row of each model, by the model's code.
ROW_OF_MODEL: tuple[Row | None, ...] = (
    None,
    None,
    (Side.SENSOR, FaultMode.STUCK),
    (Side.SENSOR, FaultMode.NO_SIGNAL),
    (Side.SENSOR, FaultMode.INEFFICIENT),
    (Side.SENSOR, FaultMode.NOISY),
    (Side.SENSOR, FaultMode.NOISY),
    (Side.SENSOR, FaultMode.NOISY),
    (Side.SENSOR, FaultMode.NOISY),
    (Side.SENSOR, FaultMode.NOISY),
    (Side.ACTUATOR, FaultMode.INEFFICIENT),
    (Side.ACTUATOR, FaultMode.STUCK),
    (Side.ACTUATOR, FaultMode.NO_SIGNAL),
    (Side.ACTUATOR, FaultMode.NOISY),
)
#: Models of a sensor that shows nothing of the speed.
TOTAL_SENSOR = (S_STUCK, S_NONE)
#: Models of a sensor with noise, the weakest white one first.
NOISY_SENSOR = tuple(range(S_WHITE_3, S_OU_LARGE + 1))

ODD_LOAD = 4.0  # times the usual load
DISTURBED_S = 0.8  # correlation time of a valve's disturbance [s]
COLOURED_S = 0.05  # correlation time of a coloured sensor noise [s]


class WheelConstants(NamedTuple):
    """Constants of one wheel for the kernels; see `WheelFilterModel` for their meaning. SI units."""

    K: float
    lag: float  # dt / τ of one block
    noise: float
    constant_noise: float
    rounding: float
    load: float
    load_keep: float  # share of the load's deviation that is left after one block
    drift: float  # process noise of the speed [m/s/√s]
    span: float
    valve_span: float  # standard deviation of a stuck valve's speed [m/s]
    grip: float  # load per slip of a tyre that holds [1]
    grip_most: float  # largest load that a tyre transmits, as a speed [m/s]
    offset: float  # constant load, as a speed [m/s]
    dt: float  # block [s]
    raw_dt: float
    fade: float  # e^(−lag)
    fade_held: float  # e^(−lag·(1 + grip))
    keep_bias: float  # share of a valve's disturbance that is left after one block
    keep_noise: float  # and of a coloured sensor noise


@dataclass(frozen=True)
class WheelFilterModel:
    """Constants of one wheel.

    Attributes
    ----------
    K : float
        Speed per full opening [m/s].
    tau : float
        Lag [s].
    noise : float
        White noise of the speed sensor [m/s].
    constant_noise : float
        Noise left in a stuck sensor: its rounding [m/s].
    rounding : float
        Noise of the rounding alone [m/s].
    load : float
        Standard deviation of load and model error, as a speed [m/s].
    span : float
        Largest plausible speed [m/s].
    valve_span : float
        Standard deviation of a stuck valve's opening [fraction].
    grip : float
        Load per slip while the tyre holds [1].
    grip_most : float
        Largest load that a tyre transmits, as a speed [m/s]; 0 for wheels off the ground.
    offset : float
        Constant load, as a speed [m/s].
    measured : bool
        Whether the opening is the measured one, so that the valve is judged elsewhere.
    drift : float
        What the model gets wrong from block to block [m/s/√s].
    """

    K: float
    tau: float
    noise: float
    constant_noise: float
    rounding: float
    load: float
    span: float
    valve_span: float
    grip: float = 2.2
    grip_most: float = 0.0
    offset: float = 0.0
    measured: bool = False
    drift: float = 0.008

    load_s = 6.0  # correlation time of the load [s]

    @property
    def models(self) -> int:
        """How many models are considered: without the valve's where that is judged elsewhere."""
        return A_GAIN if self.measured else MODELS

    def constants(self, dt: float, raw_dt: float) -> WheelConstants:
        """Constants for blocks of dt of samples of raw_dt [s]."""
        return WheelConstants(
            K=self.K,
            lag=dt / self.tau,
            noise=self.noise,
            constant_noise=self.constant_noise,
            rounding=self.rounding,
            load=self.load,
            load_keep=float(np.exp(-dt / self.load_s)),
            drift=self.drift,
            span=self.span,
            valve_span=self.valve_span * self.K,
            grip=self.grip,
            grip_most=self.grip_most,
            offset=self.offset,
            dt=dt,
            raw_dt=raw_dt,
            fade=float(np.exp(-dt / self.tau)),
            fade_held=float(np.exp(-dt / self.tau * (1 + self.grip))),
            keep_bias=float(np.exp(-dt / DISTURBED_S)),
            keep_noise=float(np.exp(-dt / COLOURED_S)),
        )


@dataclass(frozen=True)
class JointModel:
    """All wheels and what they share.

    Attributes
    ----------
    wheels : tuple[WheelFilterModel | None, ...]
        None where one is not modelled.
    flow : float
        What the pump feeds, as a sum of speeds [m/s].
    switch_cost : float
        Minus the log-probability of entering a model in one block.
    """

    wheels: tuple[WheelFilterModel | None, ...]
    flow: float
    switch_cost: float

    def sliding_at(self, slip: float) -> JointModel:
        """The same with tyres that transmit no more than their force at `slip` [m/s]."""
        return replace(
            self, wheels=tuple(None if w is None else replace(w, grip_most=w.grip * slip) for w in self.wheels)
        )
