"""Constants, state and recorded samples of the compiled loop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.controllers.choice import NEUTRAL, ControllerGains

F = NDArray[np.float64]
I = NDArray[np.int64]  # noqa: E741

# Delays of the redundant measurements, in control steps (1 ms): second speed sensor, spool, second steering sensor.
V_DELAY, U_DELAY, PHI_DELAY = 3, 2, 3
DELAY_LINE = 4


class PlantModel(NamedTuple):
    """Constants of the scan; n wheels, axle 0 front and 1 rear, SI units (see `PlantOptions`)."""

    dt: float
    x: F
    y: F
    d: F
    axle_x: F
    K: F
    tau: F
    speed_limit: float
    dead_zone: float
    valve_gain: float
    droop: float
    leakage: float
    mass: float
    mu: float
    mu_ice: float
    slip_stiffness: float
    rolling: float
    ground: bool
    steer_gain: float
    steer_rate: float
    steer_lag_gain: float
    max_steer: float
    law: int
    event_gains: F
    lam: float
    xi: float
    beta: float
    zeta: float
    k_ps: float
    u_max: float
    phi_dot_gain: float
    v_std: float
    v_lsb: float
    phi_std: float
    phi_lsb: float
    ice_waves: F
    ice_level: float
    controller: int = -1  # of `replay.controllers.choice`, instead of the law; −1: the law
    gains: ControllerGains = NEUTRAL


class FaultTable(NamedTuple):
    """Faults by channel: wheel sensors, axle sensors, wheel actuators, axle actuators; `held` is filled by the scan."""

    first: I
    start: I
    stop: I
    epsilon: F
    sat: F
    std: F
    decay: F
    growth: F  # share of ε gained per step
    held: F


class PlantState(NamedTuple):
    """Everything that the scan carries from one block to the next."""

    v: F
    spool: F
    psi: F
    error: F  # per wheel: short and long mean of |e|, 1 after a jump until they meet again
    phi: F
    phi_rate: F
    body: F  # forward speed, x, y, yaw, yaw rate
    axle_ref: F
    wheel_ref: F
    wheel_ref_rate: F
    wheel_phi: F
    last: F  # last faulty value per fault channel
    row: I
    varying: F
    line: F  # delay line: v (n), u (n), φ (2), u_s (2)
    controller: F  # state of a controller that stands in for the law, shape (n, STATES)


class Recording(NamedTuple):
    """Recorded samples, each of shape (m, wheels), (m, axles) or (m, 5) for the body."""

    v: F
    u: F
    v_ref: F
    v_actual: F
    u_actual: F
    psi: F
    slip: F
    phi: F
    phi_ref: F
    phi_actual: F
    steer_u: F
    steer_u_actual: F
    v_late: F
    u_late: F
    phi_late: F
    steer_u_late: F
    body: F
