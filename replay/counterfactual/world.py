"""What a recorded mission gives a counterfactual one: signals, what faults let through, and the plant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

F = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class RecordedWorld:
    """One mission as it was recorded and diagnosed; arrays are (n, wheels) unless they say otherwise.

    Attributes
    ----------
    dt : float
        Step [s].
    v_ref : F
        Commanded speed v_c,i [m/s].
    y : F
        Speed that the controller read [m/s].
    u : F
        Recorded valve command [fraction].
    opening : F
        What the valve did: measured, or by L8 (7) from command and fault [fraction].
    speed : F
        Best knowledge of the true speed [m/s]; NaN where a faulty sensor leaves none.
    let_sensor, let_valve : F
        δ_s, δ_a: share of the signal that faults let through [1].
    held_sensor, held_valve : Flags
        Where a part stands still at the value of its onset, which is another one in another world.
    ratio, turn : F
        Wheel speed per speed of the body [1], and what a wheel rolls less because it steers [m/s].
    ground : F
        Share of the firm ground's hold that is under the wheel [1].
    """

    dt: float
    v_ref: F
    y: F
    u: F
    opening: F
    speed: F
    let_sensor: F
    let_valve: F
    held_sensor: Flags
    held_valve: Flags
    ratio: F
    turn: F
    ground: F


class CoupledPlant(NamedTuple):
    """Wheels that share a pump and a body: τ v' = −v + share·p(u_v) − f(v + turn − ratio·body) + d.

    `body` is the speed at which the tyres' forces sum to 0: the body's mass and what it is pushed by are alike in both worlds.
    The tyre transmits f(s) = most·tanh(grip·s/most).
    """

    tau: F  # (wheels,) [s]
    openings: F  # (wheels, m) map of the valve: openings [fraction]
    speeds: F  # (wheels, m) and speeds without load [m/s]
    play: F  # (wheels,) half the width of the spool's hysteresis [fraction]
    grip: F  # (wheels,) speed that the tyre costs per slip [1]; with `creep`, times speed [m/s]
    most: F  # (wheels,) largest speed that it costs [m/s]; 0: wheels off the ground
    creep: float  # 0: constant grip; else grip/(|body| + creep) [m/s]
    flow: float  # sum of speeds that the pump feeds [m/s]


def linear_map(K: F, dead: F, u_max: float) -> tuple[F, F]:
    """Openings and speeds, each of shape (wheels, 4), of valves with gain K [m/s] and a dead zone [fraction]."""
    edge = np.maximum(dead, 1e-9)
    openings = np.column_stack([np.full(K.size, -u_max), -edge, edge, np.full(K.size, u_max)])
    top = K * (u_max - edge)
    return openings, np.column_stack([-top, np.zeros(K.size), np.zeros(K.size), top])


@dataclass(frozen=True)
class OtherWorld:
    """A mission under another law; arrays are (n, wheels).

    Attributes
    ----------
    y, u : F
        Speed that the controller would have read [m/s], and its command [fraction].
    shift : F
        Δv: by how much faster the wheel would have turned [m/s].
    load : F
        d̂ of the recorded world: load as a speed [m/s], low-passed as the observer has it.
    """

    y: F
    u: F
    shift: F
    load: F
