"""Constants and state of the compiled loop of a machine of another structure; see `structures`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replay.simulation.state import F, I, PlantModel

FIRST_ORDER, RESONANT, TORQUE = range(3)
NO_LIMIT, PROPORTIONAL, LEAST_LOADED = range(3)
SAMPLED, COUNTING, TACHO, HALL = range(4)


class StructureModel(NamedTuple):
    """Constants of the structure; n wheels, axle 0 front and 1 rear, SI units (see `Structure`)."""

    drive: int
    gain_forward: F
    gain_reverse: F
    dead_forward: F
    dead_reverse: F
    play: F  # half the width of the spool's hysteresis
    omega: float  # resonance [rad/s]
    damping: float
    wheel_limit: F
    sharing: int
    pump: float
    pressure: float
    force: F  # of the torque drive at full opening [N]
    inertia: float  # of the torque drive, as mass at the rim [kg]
    coulomb: float  # [N]
    stribeck: float  # [N]
    viscous: float  # [N s/m]
    warming: float  # share of the gain lost per control step
    sensor: int
    scale: F
    step: float  # travel per encoder step [m]
    window: int  # control steps per counting window
    tacho_gain: float
    tacho_noise: float  # per speed [1]
    pole: F  # travel between two poles, shape (poles per turn,) [m]
    steer_forward: F
    steer_reverse: F
    steer_dead: F
    backlash: F  # half the play of the encoder [rad]
    pi: bool
    feed_forward: float  # [opening per m/s]
    kp: float
    ki: float  # [1/s]
    steer_ki: float  # [1/s]


class StructureState(NamedTuple):
    """What the structure carries from one step to the next, beside `PlantState`."""

    held: F  # spool position behind its play
    rate: F  # v̇ of the resonant drive
    integral: F  # of the wheels' controllers
    steer_integral: F
    load: F  # force at the rim in the last step [N]
    travel: F
    counted: F  # travel at the last end of a window
    speed: F  # what the sensor reads, before noise
    pole: I  # poles passed
    since: I  # control steps since the last pole
    edge: F  # travel of the last pole
    angle: F  # what the steering encoder follows


def structure_state(wheels: int) -> StructureState:
    """Everything at rest."""
    f = [np.zeros(wheels) for _ in range(8)]
    integers = [np.zeros(wheels, np.int64) for _ in range(2)]
    return StructureState(
        held=f[0],
        rate=f[1],
        integral=f[2],
        steer_integral=np.zeros(2),
        load=f[3],
        travel=f[4],
        counted=f[5],
        speed=f[6],
        pole=integers[0],
        since=integers[1],
        edge=f[7],
        angle=np.zeros(2),
    )


def neutral(model: PlantModel) -> StructureModel:
    """A structure without any effect of its own."""
    n, zero, two = model.x.size, np.zeros(model.x.size), np.zeros(2)
    return StructureModel(
        drive=FIRST_ORDER,
        gain_forward=model.K,
        gain_reverse=model.K,
        dead_forward=zero,
        dead_reverse=zero,
        play=zero,
        omega=1.0,
        damping=1.0,
        wheel_limit=zero,
        sharing=NO_LIMIT,
        pump=1e9,
        pressure=0.0,
        force=zero,
        inertia=1.0,
        coulomb=0.0,
        stribeck=0.0,
        viscous=0.0,
        warming=0.0,
        sensor=SAMPLED,
        scale=zero,
        step=1.0,
        window=1,
        tacho_gain=1.0,
        tacho_noise=0.0,
        pole=np.ones(n),
        steer_forward=np.full(2, model.steer_gain),
        steer_reverse=np.full(2, model.steer_gain),
        steer_dead=two,
        backlash=two,
        pi=False,
        feed_forward=0.0,
        kp=0.0,
        ki=0.0,
        steer_ki=0.0,
    )
