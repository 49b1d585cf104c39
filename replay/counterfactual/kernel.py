"""Both worlds, one step after the other (compiled); see `replay.counterfactual`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replay.arrays.compiling import njit
from replay.controllers.choice import ControllerGains, command
from replay.counterfactual.world import CoupledPlant, F, Flags

_NEWTON_STEPS = 2
_OBSERVER = (8.0, 16.0)  # gains of the load observer: speed [1/s], load [1/s]


class Signals(NamedTuple):
    """Columns of `RecordedWorld`, each of shape (n, wheels)."""

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


class WorldState(NamedTuple):
    """What runs on; (wheels,) each, in the recorded world and in the other one where there are two."""

    speed: F  # v̂ of the recorded world
    load: F  # d̂
    shift: F  # Δv
    spool: F  # (2, wheels)
    body: F  # (2,)
    sensor_offset: F  # what a held sensor shows more in the other world
    valve_offset: F
    reading: F  # y* of the step before
    given: F  # u_v* less u_v of the step before
    controller: F  # (wheels, STATES)


def world_state(wheels: int, controller: F) -> WorldState:
    """Both worlds at rest, with the other law's state."""
    z = [np.zeros(wheels) for _ in range(7)]
    return WorldState(z[0], z[1], z[2], np.zeros((2, wheels)), np.zeros(2), z[3], z[4], z[5], z[6], controller)


@njit(cache=True, no_cpython_wrapper=True)
def _static(i: int, x: float, p: CoupledPlant) -> float:
    """Speed without load at an opening, by the map; beyond its ends as at them."""
    o, s = p.openings[i], p.speeds[i]
    if x <= o[0]:
        return float(s[0])
    for j in range(1, o.size):
        if x < o[j]:
            return float(s[j - 1] + (s[j] - s[j - 1]) * (x - o[j - 1]) / (o[j] - o[j - 1]))
    return float(s[o.size - 1])


@njit(cache=True, no_cpython_wrapper=True)
def _driven(world: int, opening: F, p: CoupledPlant, state: WorldState, out: F) -> None:
    """share·p(u_v) of every wheel into `out`: play, map, and the pump that all share."""
    demand = 0.0
    for i in range(opening.size):
        spool = min(max(state.spool[world, i], opening[i] - p.play[i]), opening[i] + p.play[i])
        state.spool[world, i] = spool
        out[i] = _static(i, spool, p)
        demand += abs(out[i])
    if demand > p.flow:
        out *= p.flow / demand


@njit(cache=True, no_cpython_wrapper=True)
def _tyres(world: int, k: int, v: F, r: Signals, p: CoupledPlant, state: WorldState, out: F) -> None:
    """f(slip) of every wheel into `out`; the body is where these forces sum to 0, by Newton's method from the step before."""
    ratio, turn, ground = r.ratio[k], r.turn[k], r.ground[k]
    body = state.body[world]
    fade = 1.0 if p.creep <= 0.0 else 1.0 / (abs(body) + p.creep)
    for _ in range(_NEWTON_STEPS):
        force, slope = 0.0, 1e-9
        for i in range(v.size):
            if p.most[i] <= 0.0:
                continue
            grip, most = p.grip[i] * fade, p.most[i] * ground[i]
            held = np.tanh(grip * (v[i] + turn[i] - ratio[i] * body) / most)
            force += ratio[i] * most * held
            slope += ratio[i] ** 2 * grip * (1.0 - held * held + 0.02)
        body += force / slope
    state.body[world] = body
    for i in range(v.size):
        out[i] = 0.0
        if p.most[i] > 0.0:
            slip, most = v[i] + turn[i] - ratio[i] * body, p.most[i] * ground[i]
            out[i] = most * np.tanh(p.grip[i] * fade * slip / most)


@njit(cache=True, no_cpython_wrapper=True)
def _read(k: int, first: bool, r: Signals, state: WorldState, y: F) -> None:
    """y* = y + δ_s Δv; a sensor held at its onset stays where it was in the other world."""
    for i in range(y.size):
        if r.held_sensor[k, i]:
            if first and k > 0 and not r.held_sensor[k - 1, i]:
                state.sensor_offset[i] = state.reading[i] - r.y[k - 1, i]
            y[i] = r.y[k, i] + state.sensor_offset[i]
        else:
            y[i] = r.y[k, i] + r.let_sensor[k, i] * state.shift[i]
        state.reading[i] = y[i]


@njit(cache=True, no_cpython_wrapper=True)
def _open(k: int, first: bool, r: Signals, u: F, u_max: float, state: WorldState, opening: F) -> None:
    """u_v* = u_v + δ_a (u* − u); a valve held at its onset stays where it was in the other world."""
    for i in range(u.size):
        if r.held_valve[k, i]:
            if first and k > 0 and not r.held_valve[k - 1, i]:
                state.valve_offset[i] = state.given[i]
            more = state.valve_offset[i]
        else:
            more = r.let_valve[k, i] * (u[i] - r.u[k, i])
        opening[i] = min(max(r.opening[k, i] + more, -u_max), u_max)
        state.given[i] = more


@njit(cache=True)
def scan(
    r: Signals,
    dt: float,
    substeps: int,
    code: int,
    gains: ControllerGains,
    u_max: float,
    p: CoupledPlant,
    state: WorldState,
    out_y: F,
    out_u: F,
    out_shift: F,
    out_load: F,
) -> None:
    """Run both worlds over the mission; fills the four outputs, each of shape (n, wheels), and changes `state`.

    Speeds in m/s, `dt` in s, openings in fractions.
    """
    n, wheels = r.y.shape
    y, u, opening = np.zeros(wheels), np.zeros(wheels), np.zeros(wheels)
    driven, driven_other = np.zeros(wheels), np.zeros(wheels)
    tyre, tyre_other, other = np.zeros(wheels), np.zeros(wheels), np.zeros(wheels)
    h = dt / substeps
    for i in range(wheels):
        state.speed[i] = r.speed[0, i] if np.isfinite(r.speed[0, i]) else 0.0
        state.spool[:, i] = r.opening[0, i]
    for k in range(n):
        for sub in range(substeps):
            _read(k, sub == 0, r, state, y)
            command(code, r.v_ref[k], y, h, u_max, gains, state.controller, u)
            if sub == 0:
                out_y[k], out_u[k], out_shift[k], out_load[k] = y, u, state.shift, state.load
            _open(k, sub == 0, r, u, u_max, state, opening)
            _driven(0, r.opening[k], p, state, driven)
            _driven(1, opening, p, state, driven_other)
            for i in range(wheels):
                other[i] = state.speed[i] + state.shift[i]
            _tyres(0, k, state.speed, r, p, state, tyre)
            _tyres(1, k, other, r, p, state, tyre_other)
            for i in range(wheels):
                # τ Δv' = −Δv + Δp − Δf
                change = driven_other[i] - driven[i] - (tyre_other[i] - tyre[i])
                state.shift[i] += h / p.tau[i] * (change - state.shift[i])
                rate = (driven[i] - tyre[i] + state.load[i] - state.speed[i]) / p.tau[i]
                if np.isfinite(r.speed[k, i]):
                    wrong = r.speed[k, i] - state.speed[i]
                    rate += _OBSERVER[0] * wrong
                    state.load[i] += h * _OBSERVER[1] * wrong * p.tau[i]
                state.speed[i] += h * rate
