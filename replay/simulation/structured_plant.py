"""The loop of a machine of another structure, one control step after the other (compiled); see `structures`."""

from __future__ import annotations

import numpy as np

from replay.arrays.compiling import njit
from replay.arrays.copying import put
from replay.controllers.choice import command as controlled
from replay.simulation.plant import _faulted, _friction, _law, _quantised, _references, _reset_at_jumps
from replay.simulation.state import (
    DELAY_LINE,
    PHI_DELAY,
    U_DELAY,
    V_DELAY,
    F,
    FaultTable,
    PlantModel,
    PlantState,
    Recording,
)
from replay.simulation.structured_sensors import play, read_speed
from replay.simulation.structured_state import NO_LIMIT, PROPORTIONAL, RESONANT, TORQUE, StructureModel, StructureState

_STILL = 0.005  # speed within which dry friction changes sign [m/s]
_STRIBECK = 0.03  # speed over which the friction of standstill fades [m/s]
_FULL_LOAD = 0.3  # of a wheel's share of the weight: force at which `pressure` of the gain is lost


@njit(cache=True)
def _opened(u: float, forward: float, reverse: float) -> float:
    """Opening behind a dead band."""
    if u > forward:
        return float((u - forward) / (1.0 - forward))
    if u < -reverse:
        return float((u + reverse) / (1.0 - reverse))
    return 0.0


@njit(cache=True, no_cpython_wrapper=True)
def _flows(k: int, u: F, p: PlantModel, m: StructureModel, state: PlantState, s: StructureState, flow: F) -> None:
    """Speeds that valves and pump would give the wheels without load, into `flow`; spools follow their commands."""
    n = u.size
    warm = 1.0 - m.warming * k
    weight = p.mass * 9.81 / n
    for i in range(n):
        s.held[i] = play(u[i], s.held[i], m.play[i])
        state.spool[i] += p.valve_gain * (s.held[i] - state.spool[i])
        opening = _opened(state.spool[i], m.dead_forward[i], m.dead_reverse[i])
        flow[i] = opening * (m.gain_forward[i] if opening > 0.0 else m.gain_reverse[i]) * warm
        if m.pressure > 0.0:
            load = min(max(s.load[i] * np.sign(flow[i]) / (_FULL_LOAD * weight), -1.0), 1.0)
            flow[i] *= np.sqrt(max(1.0 - m.pressure * load, 0.05))
        if m.wheel_limit[i] > 0.0:
            flow[i] = min(max(flow[i], -m.wheel_limit[i]), m.wheel_limit[i])
    demand = 0.0
    for i in range(n):
        demand += abs(flow[i])
    if m.sharing == NO_LIMIT or demand <= m.pump:
        return
    if m.sharing == PROPORTIONAL:
        share = m.pump / demand
        for i in range(n):
            flow[i] *= share
        return
    left = m.pump
    order, against = (
        np.empty(n, dtype=np.int64),
        np.empty(n),
    )  # the lightest first; `np.argsort` compiles for two seconds
    for i in range(n):
        j, x = i, s.load[i] * np.sign(flow[i])
        while j > 0 and x < against[j - 1]:
            order[j], against[j] = order[j - 1], against[j - 1]
            j -= 1
        order[j], against[j] = i, x
    for wheel in order:
        given = min(abs(flow[wheel]), left)
        left -= given
        flow[wheel] = given * np.sign(flow[wheel])


@njit(cache=True, no_cpython_wrapper=True)
def _accelerate(
    i: int,
    flow: float,
    force: float,
    p: PlantModel,
    m: StructureModel,
    state: PlantState,
    s: StructureState,
) -> None:
    """One step of a wheel's speed under its flow (of the torque drive: its opening) and the force at its rim."""
    v = state.v[i]
    if m.drive == TORQUE:
        dry = m.coulomb + m.stribeck * np.exp(-((v / _STRIBECK) ** 2))
        push = m.force[i] * flow - dry * np.tanh(v / _STILL) - m.viscous * v - force
        state.v[i] = v + p.dt * push / m.inertia
        return
    target = flow - p.droop * force
    if m.drive == RESONANT:
        s.rate[i] += p.dt * (m.omega**2 * (target - v) - 2.0 * m.damping * m.omega * s.rate[i])
        state.v[i] = v + p.dt * s.rate[i]
    else:
        state.v[i] = v + p.dt / p.tau[i] * (target - v)


@njit(cache=True, no_cpython_wrapper=True)
def _move(
    k: int, slope: float, u: F, p: PlantModel, m: StructureModel, state: PlantState, s: StructureState, slip: F, flow: F
) -> None:
    """One step of wheels, tyres and body; fills `slip`."""
    n = p.x.size
    tan_f, tan_r = np.tan(state.phi[0]), np.tan(state.phi[1])
    kappa = (tan_f - tan_r) / (p.axle_x[0] - p.axle_x[1])
    b = tan_f - kappa * p.axle_x[0]
    _flows(k, u, p, m, state, s, flow)
    weight = p.mass * 9.81
    push, speed, norm = 0.0, 0.0, 0.0
    for i in range(n):
        k_x, k_y = 1.0 - kappa * p.y[i], b + kappa * p.x[i]
        angle = np.arctan(k_y / k_x)
        turn = (angle - state.wheel_phi[i]) / p.dt * p.d[i]
        state.wheel_phi[i] = angle
        c = np.sign(k_x) * np.hypot(k_x, k_y) - kappa * p.d[i]
        speed += c * (state.v[i] + turn)
        norm += c * c
        if p.ground:
            slip[i] = state.v[i] - (c * state.body[0] - turn)
            most = _friction(i, p, state) * weight / n
            force = most * np.tanh(p.slip_stiffness * slip[i] / (abs(state.body[0]) + 0.05) / most)
            push += force * c
        else:
            slip[i] = 0.0
            force = weight * slope / n
        s.load[i] = force
        _accelerate(i, flow[i], force, p, m, state, s)
    if p.ground:
        drag = weight * (p.rolling * np.tanh(state.body[0] / 0.02) + slope)
        state.body[0] += p.dt * (push - drag) / p.mass
    else:
        state.body[0] = speed / norm
    v_x, yaw = state.body[0], state.body[3]
    state.body[1] += p.dt * v_x * (np.cos(yaw) - b * np.sin(yaw))
    state.body[2] += p.dt * v_x * (np.sin(yaw) + b * np.cos(yaw))
    state.body[4] = kappa * v_x
    state.body[3] += p.dt * state.body[4]


@njit(cache=True, no_cpython_wrapper=True)
def _steer(u: F, p: PlantModel, m: StructureModel, state: PlantState) -> None:
    """One step of the axle cylinders behind valves with a dead band and a gain of each direction."""
    for a in range(2):
        opening = _opened(u[a], m.steer_dead[a], m.steer_dead[a])
        gain = m.steer_forward[a] if opening > 0.0 else m.steer_reverse[a]
        rate = min(max(gain * opening, -p.steer_rate), p.steer_rate)
        state.phi_rate[a] += p.steer_lag_gain * (rate - state.phi_rate[a])
        state.phi[a] += p.dt * state.phi_rate[a]
        if abs(state.phi[a]) > p.max_steer:
            state.phi[a] = np.sign(state.phi[a]) * p.max_steer
            state.phi_rate[a] = 0.0


@njit(cache=True, no_cpython_wrapper=True)
def _command(
    i: int, v_ref: float, v: float, p: PlantModel, m: StructureModel, state: PlantState, s: StructureState
) -> float:
    """Valve command of a wheel: the mission's law, or proportional, integral and feed-forward."""
    e = v - v_ref
    rho = p.beta + abs(v_ref) + abs(v) + p.xi
    state.psi[i] = state.psi[i] * np.exp(-rho * p.dt) + 0.5 * p.zeta * e * e * p.dt
    if not m.pi:
        if p.law == 5:
            _reset_at_jumps(i, e, p, state)
        return float(_law(v_ref, v, state.psi[i], p))
    u = m.feed_forward * v_ref - m.kp * e + s.integral[i]
    if abs(u) < p.u_max or u * e > 0.0:  # the integral waits while the valve is fully open
        s.integral[i] -= m.ki * e * p.dt
    if abs(v_ref) < 1e-3 and abs(v) < 0.01:  # held at standstill
        s.integral[i] *= 1.0 - p.dt / 0.2
    return float(min(max(u, -p.u_max), p.u_max))


@njit(cache=True, no_cpython_wrapper=True)
def _steer_command(a: int, phi: float, p: PlantModel, m: StructureModel, state: PlantState, s: StructureState) -> float:
    e = state.axle_ref[a] - phi
    u = p.k_ps * e + s.steer_integral[a]
    if m.pi and abs(u) < p.u_max:
        s.steer_integral[a] += m.steer_ki * e * p.dt - s.steer_integral[a] * p.dt / 2.0
    return float(min(max(u, -p.u_max), p.u_max))


@njit(cache=True)
def scan(
    k0: int,
    every: int,
    command: F,
    slope: F,
    normal: F,
    p: PlantModel,
    m: StructureModel,
    faults: FaultTable,
    state: PlantState,
    s: StructureState,
    out: Recording,
    row0: int,
) -> None:
    """Run the loop over one block, as `replay.simulation.plant.scan` does."""
    n = p.x.size
    v, v_ref, u, u_v, slip, flow = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    phi, u_s, u_sv, body = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(5)
    row = row0
    for j in range(slope.size):
        k = k0 + j
        fault_normal = normal[j, n + 2 :]
        _references(k, command[j, 0], command[j, 1], p, state, v_ref)
        for i in range(n):
            clean = read_speed(i, k, state.v[i], normal[j, i], p, m, s)
            v[i] = _quantised(_faulted(i, k, clean, fault_normal[i], faults, state), p.v_lsb)
            state.last[i] = v[i]
            u[i] = _command(i, v_ref[i], v[i], p, m, state, s)
        if p.controller >= 0:
            controlled(p.controller, v_ref, v, p.dt, p.u_max, p.gains, state.controller, u)
        for i in range(n):
            c = n + 2 + i
            u_v[i] = _faulted(c, k, u[i], fault_normal[c], faults, state)
            state.last[c] = u_v[i]
        for a in range(2):
            s.angle[a] = play(state.phi[a], s.angle[a], m.backlash[a])
            clean = s.angle[a] + p.phi_std * normal[j, n + a]
            c = n + a
            phi[a] = _quantised(_faulted(c, k, clean, fault_normal[c], faults, state), p.phi_lsb)
            state.last[c] = phi[a]
            u_s[a] = _steer_command(a, phi[a], p, m, state, s)
            c = 2 * n + 2 + a
            u_sv[a] = _faulted(c, k, u_s[a], fault_normal[c], faults, state)
            state.last[c] = u_sv[a]
        line = state.line[k % DELAY_LINE]
        put(line, state.v)
        put(line[n:], u_v)
        put(line[2 * n :], state.phi)
        put(line[2 * n + 2 :], u_sv)
        if k == 0:
            for i in range(DELAY_LINE):
                put(state.line[i], line)
        recorded = k % every == 0
        if recorded:
            put(out.v[row], v)
            put(out.u[row], u)
            put(out.v_ref[row], v_ref)
            put(out.v_actual[row], state.v)
            put(out.u_actual[row], u_v)
            put(out.psi[row], state.psi)
            put(out.phi[row], phi)
            put(out.phi_ref[row], state.axle_ref)
            put(out.phi_actual[row], state.phi)
            put(out.steer_u[row], u_s)
            put(out.steer_u_actual[row], u_sv)
            put(out.v_late[row], state.line[(k - V_DELAY) % DELAY_LINE, :n])
            put(out.u_late[row], state.line[(k - U_DELAY) % DELAY_LINE, n : 2 * n])
            put(out.phi_late[row], state.line[(k - PHI_DELAY) % DELAY_LINE, 2 * n : 2 * n + 2])
            put(out.steer_u_late[row], state.line[(k - U_DELAY) % DELAY_LINE, 2 * n + 2 :])
            put(body, state.body)
        _move(k, slope[j], u_v, p, m, state, s, slip, flow)
        put(line[n : 2 * n], state.spool)  # a measured opening is the spool's, not the command's
        if recorded:
            put(out.slip[row], slip)
            put(out.body[row], body)
            row += 1
        _steer(u_sv, p, m, state)
