"""Constants of the steering filters, as compiled recursions take them."""

from __future__ import annotations

from typing import NamedTuple

from diagnosis.steering.valve_map import ValveMap


class AxleConstants(NamedTuple):
    """Valve, cylinder and axle.

    Attributes
    ----------
    dt : float
        Length of a block [s].
    valve : ValveMap
        Rate by opening.
    gain, rate_limit : float
        Rate per opening beyond the dead band and its limit, both directions together [rad/s].
    play : float
        Half of the sensor's play [rad].
    lag, rate_decay : float
        Lag of the rate [s], and what is left of a rate after a block, exp(−dt/lag) [1].
    lag_error : float
        What the lag's error makes of a rate's change in a block [1].
    stop : float
        Angle of the end stops [rad].
    stop_up, stop_down : float
        What the sensor reads at them [rad].
    rate_error, rate_error_decay : float
        Standard deviation of the rate's error [rad/s], and what is left of it after a block [1].
    rate_error_s : float
        How long an error of the rate lasts [s].
    idle_rate : float
        Commanded rate up to which nothing is asked of the valve [rad/s].
    opening_measured : bool
        Whether the valve's opening is logged beside its command.
    angle_variance : float
        Variance that a block adds to the angle [rad²].
    stop_variance : float
        Variance of the angle at an end stop [rad²].
    disturbance_decay : float
        What is left of a valve's disturbance after a block [1].
    """

    dt: float
    valve: ValveMap
    gain: float
    rate_limit: float
    play: float
    lag: float
    rate_decay: float
    lag_error: float
    stop: float
    stop_up: float
    stop_down: float
    rate_error: float
    rate_error_decay: float
    rate_error_s: float
    idle_rate: float
    opening_measured: bool
    angle_variance: float
    stop_variance: float
    disturbance_decay: float


class SensorConstants(NamedTuple):
    """The angle sensor's noise.

    Attributes
    ----------
    white, white_spread : float
        Power of the white noise, its rounding included [rad²], and the variance of its logarithm [1].
    white_dof : float
        Degrees of freedom of a sample in the power of the white part [1].
    constant : float
        The least power that a constant reading is given [rad²].
    rounding : float
        Power of the rounding in a sample [rad²].
    mean_rounding : float
        What rounding leaves in the mean of a block [rad²].
    resolved : bool
        Whether the noise is larger than the rounding step.
    rest_cost : float
        What a constant reading must gain per block where rounding hides the noise [log-likelihood].
    coloured_decay : float
        What is left of coloured noise after a block [1].
    """

    white: float
    white_spread: float
    white_dof: float
    constant: float
    rounding: float
    mean_rounding: float
    resolved: bool
    rest_cost: float
    coloured_decay: float


class FilterConstants(NamedTuple):
    """Constants of all filters of an axle.

    Attributes
    ----------
    axle : AxleConstants
    sensor : SensorConstants
    switch_cost : float
        Minus the log-probability that a row is entered in a block.
    freedom_cost : float
        What a model with a free gain must gain per block [log-likelihood].
    idle_variance : float
        Least variance of an angle whose valve is at fault while nothing is asked of it [rad²]: that of a healthy axle
        at rest, so that no fault gains by being surer of rest.
    redundant : bool
        Whether anything is measured redundantly.
    """

    axle: AxleConstants
    sensor: SensorConstants
    switch_cost: float
    freedom_cost: float
    idle_variance: float
    redundant: bool
