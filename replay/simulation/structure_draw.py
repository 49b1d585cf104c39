"""One machine of a structure: its sizes drawn from the seed, as constants of the compiled loop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.simulation.state import PlantModel
from replay.simulation.structured_plant import StructureModel
from replay.simulation.structures import DRIVES, SHARINGS, SPEED_SENSORS, Span, Structure

_COUNTS, _POLES = 4096, 48  # encoder steps and hall poles per motor turn
_POLE_SPREAD = 0.03  # uneven poles
_WINDOW_S, _TACHO_S, _TACHO_NOISE = 0.010, 0.015, 0.015
_RIM_MASS = 1500.0  # inertia of a torque drive, as mass at the rim [kg]
_KP, _KI, _STEER_KI = 0.35, 1.5, 0.3  # PI law: per speed that a full opening gives; [1/s]; [1/s]


def draw_machine(
    structure: Structure, model: PlantModel, rng: np.random.Generator, per_turn: float, duration_s: float
) -> tuple[PlantModel, StructureModel]:
    """Constants of one machine.

    Parameters
    ----------
    structure : Structure
        Its effects and their ranges.
    model : PlantModel
        Machine of the default structure, whose body, ground and controller it keeps.
    rng : np.random.Generator
        Of the machine.
    per_turn : float
        Travel of the rim per motor turn [m].
    duration_s : float
        Length of the mission [s], by the end of which the machine is warm.
    """
    n = model.x.size

    def one(span: Span) -> float:
        return float(rng.uniform(*span))

    def each(span: Span, count: int = n) -> NDArray[np.float64]:
        return rng.uniform(*span, count)

    gain, lag = one(structure.gain), one(structure.lag)
    forward = gain * (1.0 + 0.03 * rng.standard_normal(n))
    reverse = forward * (1.0 + each(structure.asymmetry) * rng.choice([-1.0, 1.0], n))
    droop, tyre = one(structure.leakage), one(structure.tyre)
    spool = one(structure.spool_lag)
    steer = model.steer_gain * (1.0 + 0.1 * rng.standard_normal(2))
    steer_reverse = steer * (1.0 + each(structure.steer_asymmetry, 2) * rng.choice([-1.0, 1.0], 2))
    body = model.mass / n + _RIM_MASS
    acceleration = one(structure.acceleration) * (1.0 + 0.03 * rng.standard_normal(n))
    torque = structure.drive == "torque"
    full = acceleration.mean() / one(structure.viscous) if torque and structure.viscous[1] > 0 else gain
    pi = structure.law == "pi"
    changed = model._replace(
        K=forward,
        tau=lag * (1.0 + 0.05 * rng.standard_normal(n)),
        valve_gain=1.0 - np.exp(-model.dt / spool) if spool > 0.0 else 1.0,
        droop=droop,
        leakage=0.0,
        dead_zone=0.0,
        slip_stiffness=model.slip_stiffness * tyre,
        v_lsb=1e-6 if structure.sensor in ("counting", "hall") else model.v_lsb,
    )
    return changed, StructureModel(
        drive=DRIVES.index(structure.drive),
        gain_forward=np.ones(n) if torque else forward,
        gain_reverse=np.ones(n) * (1.0 + 0.0) if torque else reverse,
        dead_forward=each(structure.dead_band),
        dead_reverse=each(structure.dead_band),
        play=each(structure.hysteresis) / 2,
        omega=2 * np.pi * one(structure.resonance),
        damping=one(structure.damping),
        wheel_limit=each(structure.wheel_limit),
        sharing=SHARINGS.index(structure.sharing),
        pump=one(structure.pump),
        pressure=one(structure.pressure),
        force=acceleration * body,
        inertia=_RIM_MASS,
        coulomb=one(structure.coulomb) * body,
        stribeck=one(structure.stribeck) * body,
        viscous=one(structure.viscous) * body,
        warming=one(structure.warming) * model.dt / duration_s,
        sensor=SPEED_SENSORS.index(structure.sensor),
        scale=structure.scale * rng.standard_normal(n),
        step=per_turn / _COUNTS,
        window=max(1, round(_WINDOW_S / model.dt)),
        tacho_gain=float(-np.expm1(-model.dt / _TACHO_S)),
        tacho_noise=_TACHO_NOISE,
        pole=per_turn / _POLES * (1.0 + _POLE_SPREAD * rng.standard_normal(_POLES)),
        steer_forward=steer,
        steer_reverse=steer_reverse,
        steer_dead=each(structure.steer_dead_band, 2),
        backlash=each(structure.steer_backlash, 2) / 2,
        pi=pi,
        feed_forward=1.0 / full,
        kp=_KP / full * (8.0 if torque else 1.0),
        ki=_KI / full,
        steer_ki=_STEER_KI,
    )
