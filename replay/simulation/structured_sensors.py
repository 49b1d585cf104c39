"""What speed sensors of other kinds read, and play between two parts (compiled)."""

from __future__ import annotations

import numpy as np

from replay.arrays.compiling import njit
from replay.simulation.state import PlantModel
from replay.simulation.structured_state import COUNTING, SAMPLED, TACHO, StructureModel, StructureState

_HALL_TIMEOUT = 250  # control steps without a pole after which the sensor reads 0


@njit(cache=True)
def play(value: float, held: float, half: float) -> float:
    """Backlash: the output follows once the input has crossed the play. All in one unit."""
    return float(min(max(held, value - half), value + half))


@njit(cache=True, no_cpython_wrapper=True)
def read_speed(i: int, k: int, v: float, normal: float, p: PlantModel, m: StructureModel, s: StructureState) -> float:
    """What a wheel's healthy speed sensor reads. In m/s."""
    v = v * (1.0 + m.scale[i])
    s.travel[i] += v * p.dt
    if m.sensor == SAMPLED:
        return float(v + p.v_std * normal)
    if m.sensor == TACHO:
        s.speed[i] += m.tacho_gain * (v - s.speed[i])
        return float(s.speed[i] + (0.25 * p.v_std + m.tacho_noise * abs(s.speed[i])) * normal)
    if m.sensor == COUNTING:
        if k % m.window == 0:
            steps = np.floor(s.travel[i] / m.step) - np.floor(s.counted[i] / m.step)
            s.speed[i] = steps * m.step / (m.window * p.dt)
            s.counted[i] = s.travel[i]
        return float(s.speed[i])
    s.since[i] += 1
    ahead = s.travel[i] - s.edge[i]
    poles = m.pole.size
    width = m.pole[s.pole[i] % poles] if ahead >= 0.0 else m.pole[(s.pole[i] - 1) % poles]
    if abs(ahead) >= width:
        direction = 1.0 if ahead > 0.0 else -1.0
        s.speed[i] = direction * m.pole.mean() / (s.since[i] * p.dt)
        s.edge[i] += direction * width
        s.pole[i] += int(direction)
        s.since[i] = 0
    elif s.since[i] > _HALL_TIMEOUT:
        s.speed[i] = 0.0
    else:  # no pole for longer than the last interval: it can be no faster than one pole in this time
        most = m.pole.mean() / (s.since[i] * p.dt)
        s.speed[i] = min(max(s.speed[i], -most), most)
    return float(s.speed[i])
