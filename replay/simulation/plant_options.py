"""The simulated machine's physics and sensors."""

from __future__ import annotations

from dataclasses import dataclass

from replay.errors import check_range


@dataclass(frozen=True)
class PlantOptions:
    """The machine's physics and its sensors.

    Attributes
    ----------
    K : float
        Wheel speed per full valve opening, before the pump's limit [m/s].
    tau : float
        Lag from valve to wheel speed [s].
    wheel_spread : float
        Relative standard deviation of K from wheel to wheel [1].
    tau_spread : float or None
        The same of tau; None: as `wheel_spread`.
    dead_zone : float
        Valve opening without flow [fraction].
    valve_lag : float
        Lag of the spool [s]; 0 for none.
    droop : float
        Speed lost to leakage per force at the rim [m/s/N].
    leakage : float
        Speed lost to leakage at any opening and load [m/s]; it never turns the wheel backward.
    pump_flow, motor_displacement : float
        Flow shared by all motors [m³/s]; motor volume per turn [m³].
    mass : float
        Of the body [kg].
    friction, ice_friction : float
        Tyre friction on firm ground and on ice [1].
    slip_stiffness : float
        Tyre force per slip ratio of one wheel [N].
    rolling_resistance : float
        Share of the weight [1].
    steer_gain, steer_rate, steer_lag : float
        Steering speed per full valve opening [rad/s], its limit [rad/s], and lag [s].
    v_std, v_lsb : float
        Noise and resolution of the speed sensor [m/s]; None for 12 bit over 2500 rpm of the motor.
    phi_std, phi_lsb : float
        Noise and resolution of the steering encoder [rad].
    """

    K: float = 2.4
    tau: float = 0.25
    wheel_spread: float = 0.03
    tau_spread: float | None = None
    dead_zone: float = 0.0
    valve_lag: float = 0.0
    droop: float = 1e-5
    leakage: float = 0.0
    pump_flow: float = 63e-3 / 60
    motor_displacement: float = 100e-6
    mass: float = 6650.0
    friction: float = 0.6
    ice_friction: float = 0.05
    slip_stiffness: float = 5e4
    rolling_resistance: float = 0.03
    steer_gain: float = 4.0
    steer_rate: float = 0.25
    steer_lag: float = 0.05
    v_std: float = 0.004
    v_lsb: float | None = None
    phi_std: float = 0.0005
    phi_lsb: float = 0.0004

    def __post_init__(self) -> None:
        """Check values."""
        check_range("plant.K", self.K, 0.1, 20.0, "m/s per full opening")
        check_range("plant.tau", self.tau, 0.02, 5.0, "s")
        check_range("plant.wheel_spread", self.wheel_spread, 0.0, 0.2, "")
        if self.tau_spread is not None:
            check_range("plant.tau_spread", self.tau_spread, 0.0, 0.2, "")
        check_range("plant.dead_zone", self.dead_zone, 0.0, 0.5, "of full opening")
        check_range("plant.valve_lag", self.valve_lag, 0.0, 1.0, "s")
        check_range("plant.droop", self.droop, 0.0, 1e-4, "m/s/N")
        check_range("plant.leakage", self.leakage, 0.0, 0.1, "m/s")
        check_range("plant.v_std", self.v_std, 0.0, 0.1, "m/s")
        if self.v_lsb is not None:
            check_range("plant.v_lsb", self.v_lsb, 1e-6, 0.1, "m/s")
        check_range("plant.mass", self.mass, 500.0, 1e5, "kg")
        check_range("plant.pump_flow", self.pump_flow, 1e-5, 1.0, "m^3/s")
        check_range("plant.slip_stiffness", self.slip_stiffness, 1e3, 1e6, "N")
        check_range("plant.rolling_resistance", self.rolling_resistance, 0.0, 1.0, "of the weight")
        check_range("plant.phi_std", self.phi_std, 0.0, 0.1, "rad")
        check_range("plant.phi_lsb", self.phi_lsb, 1e-6, 0.1, "rad")
        check_range("plant.friction", self.friction, 0.01, 2.0, "")
        check_range("plant.ice_friction", self.ice_friction, 0.001, 2.0, "")
