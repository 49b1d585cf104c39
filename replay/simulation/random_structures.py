"""Structures drawn at random: any mixture of the effects of `replay.simulation.structure.Structure`.

Each effect is present with a probability of its own, so that thousands of seeds give thousands of kinds of machines. Flow
that goes to the wheel with the lightest load first and hysteresis above 2 % are never drawn: structures of kind
``reporting`` keep them for figures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from replay.simulation.structure import Drive, Span, SpeedSensor, Structure

SHARE = 0.4  # probability of each effect
_RATES = (200.0, 250.0, 500.0, 1000.0)
_LEAST_DAMPING = 0.15  # of the speed loop
_FORCED = 2.5  # times as stiff as its proportional part is a law with forced Ψ̂
_LEAST_GAIN = 1.0  # with which the recorded laws still follow [m/s]

# Effect: lowest and highest value of a machine, and how far its wheels lie from it, as a share.
_VALVES: Mapping[str, tuple[float, float, float]] = {
    "asymmetry": (0.03, 0.25, 0.4),
    "dead_band": (0.005, 0.05, 0.25),
    "hysteresis": (0.002, 0.016, 0.25),
    "spool_lag": (0.01, 0.045, 0.0),
    "warming": (0.02, 0.1, 0.0),
}
_HYDRAULICS: Mapping[str, tuple[float, float, float]] = {
    "wheel_limit": (0.38, 0.6, 0.08),
    "pressure": (0.1, 0.5, 0.0),
}
_STEERING: Mapping[str, tuple[float, float, float]] = {
    "steer_dead_band": (0.005, 0.04, 0.25),
    "steer_asymmetry": (0.03, 0.2, 0.4),
    "steer_backlash": (0.0005, 0.006, 0.3),
}
_GAIN, _LAG, _LEAKAGE = (1.1, 3.2), (0.08, 0.3), (3e-6, 3e-5)
_PUMP = (1.1, 1.7)
_RESONANCE, _DAMPING = (3.5, 9.0), (0.3, 0.6)
_ACCELERATION, _VISCOUS = (1.8, 4.5), (0.6, 2.5)
_FRICTION: Mapping[str, Span] = {"coulomb": (0.05, 0.3), "stribeck": (0.02, 0.18)}
_TYRE, _SCALE = (0.5, 2.0), (0.001, 0.004)
_SENSOR_LAGS: Mapping[str, float] = {"sampled": 0.0, "counting": 0.005, "tacho": 0.015, "hall": 0.03}  # [s]


def random_structure(seed: int) -> Structure:
    """A structure whose effects are drawn at random.

    Parameters
    ----------
    seed : int
        The same seed gives the same structure.

    Returns
    -------
    Structure
        Its spans hold one machine's sizes, drawn evenly by logarithm, with the spread of its wheels.
    """
    rng = np.random.default_rng([seed, 541])

    def size(low: float, high: float) -> float:
        return float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.3g}")

    def around(low: float, high: float, spread: float) -> Span:
        centre = size(low, high)
        return centre * (1.0 - spread), centre * (1.0 + spread)

    def drawn(table: Mapping[str, tuple[float, float, float]]) -> dict[str, Any]:
        return {name: around(*span) for name, span in table.items() if rng.random() < SHARE}

    drive = str(rng.choice(get_args(Drive), p=(0.4, 0.3, 0.3)))
    sensor = str(rng.choice(get_args(SpeedSensor), p=(0.4, 0.2, 0.2, 0.2)))
    fields: dict[str, Any] = {"drive": drive, "sensor": sensor, **drawn(_VALVES), **drawn(_STEERING)}
    gain, leakage, tyre = size(*_GAIN), size(*_LEAKAGE), size(*_TYRE)
    fields |= {"leakage": (leakage, leakage), "tyre": (tyre, tyre), "lag": around(*_LAG, 0.05)}
    fields["scale"] = size(*_SCALE) if rng.random() < SHARE else 0.0
    fields["law"] = "pi" if rng.random() < SHARE else "recorded"
    if drive == "torque":
        fields |= {"acceleration": around(*_ACCELERATION, 0.0), "viscous": around(*_VISCOUS, 0.0)}
        fields |= {name: around(*span, 0.0) for name, span in _FRICTION.items() if rng.random() < SHARE + 0.2}
    else:
        fields |= drawn(_HYDRAULICS)
        fields |= {"resonance": around(*_RESONANCE, 0.0), "damping": around(*_DAMPING, 0.0)}
        if rng.random() < SHARE:
            fields |= {"sharing": "proportional", "pump": around(*_PUMP, 0.0)}
    rates = tuple(float(r) for r in _RATES if rng.random() < 0.5) or (_RATES[-1],)
    structure = Structure(kind="tuning", gain=(gain, gain), rate_hz=rates, **fields)
    most = stiffest_loop(structure)
    if drive == "torque" or gain <= most:  # the default controller has λ = 1
        return structure
    return replace(structure, gain=(most, most)) if most >= _LEAST_GAIN else replace(structure, law="pi")


def stiffest_loop(structure: Structure) -> float:
    """Loop gain Kλ up to which the recorded laws drive the structure without ringing; at least 0.2.

    With 2.5 times that gain, which forced Ψ̂ adds at times, the proportional loop still has a damping of .15. The loop is
    valve lag, drive and sensor lag in series, for the middle of the structure's spans. Of a drive that accelerates, K is its
    acceleration [m/s²].
    """
    lags = [_middle(structure.spool_lag), _SENSOR_LAGS[structure.sensor], 0.002]
    if structure.drive == "resonant":
        omega = 2 * np.pi * _middle(structure.resonance)
        open_loop = np.array([1.0 / omega**2, 2.0 * _middle(structure.damping) / omega, 1.0])
    elif structure.drive == "torque":
        open_loop = np.array([1.0, _middle(structure.viscous)])
    else:
        open_loop = np.array([_middle(structure.lag), 1.0])
    for lag in lags:
        open_loop = np.convolve(open_loop, [lag, 1.0]) if lag > 0.0 else open_loop
    stiff = 0.2
    for gain in np.geomspace(0.2, 20.0, 80):
        closed = open_loop.copy()
        closed[-1] += _FORCED * gain
        poles = np.roots(closed)
        if np.min(-poles.real / np.abs(poles)) < _LEAST_DAMPING:
            break
        stiff = float(f"{gain:.3g}")
    return stiff


def _middle(span: Span) -> float:
    return 0.5 * (span[0] + span[1])
