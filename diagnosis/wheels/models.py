"""What the wheel filters work with: constants, the state that they carry, and what one pass gives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.step_kernel import COLOURED_S, DISTURBED_S, WheelConstants

Array = NDArray[np.float64]


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

    load_s = 6.0  # correlation time of the load [s]
    drift = 0.008  # process noise of the speed [m/s/√s]

    def constants(self, dt: float, raw_dt: float) -> WheelConstants:
        """Constants for blocks of dt of samples of raw_dt [s]."""
        return WheelConstants(
            self.K,
            dt / self.tau,
            self.noise,
            self.constant_noise,
            self.rounding,
            self.load,
            float(np.exp(-dt / self.load_s)),
            self.drift,
            self.span,
            self.valve_span * self.K,
            self.grip,
            self.grip_most,
            self.offset,
            dt,
            raw_dt,
            float(np.exp(-dt / self.tau)),
            float(np.exp(-dt / self.tau * (1 + self.grip))),
            float(np.exp(-dt / DISTURBED_S)),
            float(np.exp(-dt / COLOURED_S)),
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

    def on_ground(self, grip_most: float) -> JointModel:
        """The same with tyres that transmit `grip_most` [m/s]."""
        return replace(self, wheels=tuple(None if w is None else replace(w, grip_most=grip_most) for w in self.wheels))


@dataclass(frozen=True)
class JointState:
    """What the recursion carries from blocks to blocks.

    Attributes
    ----------
    score : Array, shape (wheels, models)
    mean : Array, shape (wheels, models, 4)
    cov : Array, shape (wheels, models, 4, 4)
    spill : Array, shape (wheels, 4)
        What the last samples' openings still drive in the next block, and the lagged drive.
    """

    score: Array
    mean: Array
    cov: Array
    spill: Array


@dataclass(frozen=True)
class JointPass:
    """One run of the recursion over n blocks.

    Attributes
    ----------
    back : tuple of NDArray[np.uint8], one per wheel, shape (n, models)
        Back-pointers.
    best : NDArray[np.uint8], shape (n, wheels)
        Most probable model by what came before: a causal reading.
    fault : Array, shape (n, wheels)
        Probability by the same that the wheel is not healthy.
    inputs : Array, shape (n, wheels, 8)
        Openings as fed, shares, speed and uncertainty of the body (see `wheel_scan.WheelInput`), log-likelihood.
    state : JointState
        For the next blocks.
    """

    back: tuple[NDArray[np.uint8], ...]
    best: NDArray[np.uint8]
    fault: Array
    inputs: Array
    state: JointState

    @property
    def evidence(self) -> float:
        """Log-likelihood of the most probable paths."""
        return float(self.gains.sum())

    @cached_property
    def gains(self) -> Array:
        """Log-likelihood of each block of each wheel, shape (n, wheels)."""
        return np.ascontiguousarray(self.inputs[:, :, 7])
