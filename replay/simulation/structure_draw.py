"""One machine of a structure: its sizes drawn from the seed, as constants of the compiled loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.simulation.state import PlantModel
from replay.simulation.structure import DRIVES, SHARINGS, SPEED_SENSORS, Span, Structure
from replay.simulation.structured_state import StructureModel, neutral

_COUNTS, _POLES = 4096, 48  # encoder steps and hall poles per motor turn
_POLE_SPREAD = 0.03  # uneven poles
_WINDOW_S, _TACHO_S, _TACHO_NOISE = 0.010, 0.015, 0.015
_RIM_MASS = 1500.0  # inertia of a torque drive, as mass at the rim [kg]
_KP, _KI, _STEER_KI = 0.35, 1.5, 0.3  # PI law: per speed that a full opening gives; [1/s]; [1/s]
_TORQUE_KP = 8.0  # times as stiff for drives that accelerate


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
    draw = _Draw(rng, model.x.size)
    gain = draw.one(structure.gain)
    forward = draw.spread(gain, 0.03)
    spool = draw.one(structure.spool_lag)
    changed = model._replace(
        K=forward,
        tau=draw.spread(draw.one(structure.lag), 0.05),
        valve_gain=1.0 - np.exp(-model.dt / spool) if spool > 0.0 else 1.0,
        droop=draw.one(structure.leakage),
        leakage=0.0,
        dead_zone=0.0,
        slip_stiffness=model.slip_stiffness * draw.one(structure.tyre),
        v_lsb=1e-6 if structure.sensor in ("counting", "hall") else model.v_lsb,
    )
    drawn = _with_valves(neutral(changed), structure, draw)
    warming = draw.one(structure.warming) * model.dt / duration_s
    if structure.drive == "torque":
        drawn, gain = _with_torque(drawn, structure, draw, model.mass / model.x.size + _RIM_MASS)
    drawn = drawn._replace(
        drive=DRIVES.index(structure.drive),
        omega=2 * np.pi * draw.one(structure.resonance),
        damping=draw.one(structure.damping),
        warming=warming,
    )
    drawn = _with_sensors(drawn, structure, draw, model.dt, per_turn)
    drawn = _with_steering(drawn, structure, draw)
    if structure.law == "pi":
        stiff = _TORQUE_KP if structure.drive == "torque" else 1.0
        drawn = drawn._replace(
            pi=True, feed_forward=1.0 / gain, kp=stiff * _KP / gain, ki=_KI / gain, steer_ki=_STEER_KI
        )
    return changed, drawn


@dataclass(frozen=True)
class _Draw:
    """Draws from spans for a machine of some wheels."""

    rng: np.random.Generator
    wheels: int

    def one(self, span: Span) -> float:
        return float(self.rng.uniform(*span))

    def each(self, span: Span, count: int | None = None) -> NDArray[np.float64]:
        return np.asarray(self.rng.uniform(*span, self.wheels if count is None else count))

    def spread(self, value: float, share: float) -> NDArray[np.float64]:
        """A value with a relative standard deviation from wheel to wheel."""
        return np.asarray(value * (1.0 + share * self.rng.standard_normal(self.wheels)))

    def unlike(self, span: Span, count: int | None = None) -> NDArray[np.float64]:
        """Factors that differ from 1 by shares within a span, of either sign."""
        shares = self.each(span, count)
        return np.asarray(1.0 + shares * self.rng.choice([-1.0, 1.0], shares.size))


def _with_valves(m: StructureModel, structure: Structure, draw: _Draw) -> StructureModel:
    """Valves and pump."""
    return m._replace(
        gain_reverse=m.gain_forward * draw.unlike(structure.asymmetry),
        dead_forward=draw.each(structure.dead_band),
        dead_reverse=draw.each(structure.dead_band),
        play=draw.each(structure.hysteresis) / 2,
        wheel_limit=draw.each(structure.wheel_limit),
        sharing=SHARINGS.index(structure.sharing),
        pump=draw.one(structure.pump),
        pressure=draw.one(structure.pressure),
    )


def _with_torque(m: StructureModel, structure: Structure, draw: _Draw, mass: float) -> tuple[StructureModel, float]:
    """Drives whose opening accelerates a `mass` [kg] at the rim, and the speed that a full opening reaches [m/s]."""
    acceleration, viscous = draw.one(structure.acceleration), draw.one(structure.viscous)
    changed = m._replace(
        gain_forward=np.ones(draw.wheels),
        gain_reverse=m.gain_reverse / m.gain_forward,
        force=draw.spread(acceleration, 0.03) * mass,
        inertia=_RIM_MASS,
        coulomb=draw.one(structure.coulomb) * mass,
        stribeck=draw.one(structure.stribeck) * mass,
        viscous=viscous * mass,
    )
    return changed, acceleration / max(viscous, 0.1)


def _with_sensors(m: StructureModel, structure: Structure, draw: _Draw, dt: float, per_turn: float) -> StructureModel:
    """Speed sensors."""
    return m._replace(
        sensor=SPEED_SENSORS.index(structure.sensor),
        scale=structure.scale * draw.rng.standard_normal(draw.wheels),
        step=per_turn / _COUNTS,
        window=max(1, round(_WINDOW_S / dt)),
        tacho_gain=float(-np.expm1(-dt / _TACHO_S)),
        tacho_noise=_TACHO_NOISE,
        pole=per_turn / _POLES * (1.0 + _POLE_SPREAD * draw.rng.standard_normal(_POLES)),
    )


def _with_steering(m: StructureModel, structure: Structure, draw: _Draw) -> StructureModel:
    """Steering valves and encoders of both axles."""
    forward = m.steer_forward * (1.0 + 0.1 * draw.rng.standard_normal(2))
    return m._replace(
        steer_forward=forward,
        steer_reverse=forward * draw.unlike(structure.steer_asymmetry, 2),
        steer_dead=draw.each(structure.steer_dead_band, 2),
        backlash=draw.each(structure.steer_backlash, 2) / 2,
    )
