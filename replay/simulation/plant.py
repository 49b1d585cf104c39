"""Wheels, body, steering and the MFHCA loop, one control step after the other (compiled)."""

from __future__ import annotations

import numpy as np

from replay.arrays.compiling import njit
from replay.arrays.copying import put
from replay.controllers.choice import command as controlled
from replay.controllers.mfhca import EVENT_RISE, read_law
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


@njit(cache=True, no_cpython_wrapper=True)
def _faulted(c: int, k: int, value: float, normal: float, faults: FaultTable, state: PlantState) -> float:
    """L4, L8 (7): (1 − ε)·value + ε·sat while a fault of channel c is active."""
    row = state.row[c]
    while row < faults.first[c + 1] and faults.stop[row] <= k:
        row += 1
    state.row[c] = row
    if row == faults.first[c + 1] or k < faults.start[row]:
        return value
    if k == faults.start[row]:
        state.varying[c] = normal
        onset = value if k == 0 else state.last[c]
        faults.held[row] = onset if np.isnan(faults.sat[row]) else faults.sat[row]
    else:
        a = faults.decay[row]
        state.varying[c] = a * state.varying[c] + np.sqrt(1.0 - a * a) * normal
    sat = faults.held[row] + faults.std[row] * state.varying[c]
    epsilon = faults.epsilon[row] * min(1.0, (k - faults.start[row] + 1) * faults.growth[row])
    return float((1.0 - epsilon) * value + epsilon * sat)


@njit(cache=True, no_cpython_wrapper=True)
def _quantised(value: float, lsb: float) -> float:
    """Nearest multiple of a sensor's resolution; divided by 1/lsb so that decimal steps give short decimals."""
    return float(np.round(value / lsb) / (1.0 / lsb) + 0.0)


@njit(cache=True, no_cpython_wrapper=True)
def _references(k: int, v: float, omega: float, p: PlantModel, state: PlantState, v_ref: F) -> None:
    """L1 (1), L2 (2): v_c,i = s·|v_k| − (ω_b + φ̇)·d_i and φ_c of wheels and axles, held at standstill."""
    for i in range(p.x.size):
        v_x, v_y = v - omega * p.y[i], omega * p.x[i]
        s = 1.0 if v_x >= 0.0 else -1.0
        size = np.hypot(v_x, v_y)
        before = state.wheel_ref[i]
        if size > 1e-3:
            state.wheel_ref[i] = min(max(np.arctan2(s * v_y, s * v_x), -p.max_steer), p.max_steer)
        if k > 0:
            rate = (state.wheel_ref[i] - before) / p.dt
            state.wheel_ref_rate[i] += p.phi_dot_gain * (rate - state.wheel_ref_rate[i])
        v_ref[i] = s * size - (omega + state.wheel_ref_rate[i]) * p.d[i]
    s = 1.0 if v >= 0.0 else -1.0
    for a in range(2):
        v_y = omega * p.axle_x[a]
        if np.hypot(v, v_y) > 1e-3:
            state.axle_ref[a] = min(max(np.arctan2(s * v_y, s * v), -p.max_steer), p.max_steer)


@njit(cache=True, no_cpython_wrapper=True)
def _law(v_ref: float, v: float, psi: float, p: PlantModel) -> float:
    """u_a, L15 (14), in the simulated reading."""
    return float(read_law(p.law, v_ref, v, psi, p.lam, p.u_max))


@njit(cache=True, no_cpython_wrapper=True)
def _reset_at_jumps(i: int, e: float, p: PlantModel, state: PlantState) -> None:
    """Ψ̂ ← √(λ|e|) where the short mean of |e| rises over the long one; again only once they have met."""
    error = state.error[i]
    error[0] += p.event_gains[0] * (abs(e) - error[0])
    error[1] += p.event_gains[1] * (abs(e) - error[1])
    rise = error[0] - error[1]
    if error[2] == 0.0 and rise > EVENT_RISE:
        state.psi[i], error[2] = np.sqrt(p.lam * error[0]), 1.0
    elif rise < 0.25 * EVENT_RISE:
        error[2] = 0.0


@njit(cache=True, no_cpython_wrapper=True)
def _friction(i: int, p: PlantModel, state: PlantState) -> float:
    """Friction under wheel i: ice where a fixed field of waves over the ground exceeds its level."""
    yaw = state.body[3]
    x = state.body[1] + np.cos(yaw) * p.x[i] - np.sin(yaw) * p.y[i]
    y = state.body[2] + np.sin(yaw) * p.x[i] + np.cos(yaw) * p.y[i]
    height = 0.0
    for j in range(p.ice_waves.shape[0]):
        height += np.cos(p.ice_waves[j, 0] * x + p.ice_waves[j, 1] * y + p.ice_waves[j, 2])
    return p.mu_ice if height > p.ice_level else p.mu


@njit(cache=True, no_cpython_wrapper=True)
def _drive(slope: float, u: F, p: PlantModel, state: PlantState, slip: F) -> None:
    """One step of τ v̇ = −v + K u − leakage − droop·F with the shared pump, and of the body and its path; fills `slip`."""
    n = p.x.size
    # Centre of rotation from both axle angles: v_y = b·v_x, ω = κ·v_x.
    tan_f, tan_r = np.tan(state.phi[0]), np.tan(state.phi[1])
    kappa = (tan_f - tan_r) / (p.axle_x[0] - p.axle_x[1])
    b = tan_f - kappa * p.axle_x[0]
    demand = 0.0
    opening = np.empty(n)
    for i in range(n):
        state.spool[i] += p.valve_gain * (u[i] - state.spool[i])
        opening[i] = np.sign(state.spool[i]) * max(abs(state.spool[i]) - p.dead_zone, 0.0)
        demand += abs(p.K[i] * opening[i])
    share = min(1.0, p.speed_limit / demand) if demand > 0.0 else 1.0
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
        flow = share * p.K[i] * opening[i]
        if p.leakage > 0.0:
            flow -= p.leakage * np.tanh(flow / p.leakage)
        state.v[i] += p.dt / p.tau[i] * (flow - state.v[i] - p.droop * force)
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
def _steer(u: F, p: PlantModel, state: PlantState) -> None:
    """One step of the axle cylinders: rate by valve opening, limited, with lag and end stops."""
    for a in range(2):
        rate = min(max(p.steer_gain * u[a], -p.steer_rate), p.steer_rate)
        state.phi_rate[a] += p.steer_lag_gain * (rate - state.phi_rate[a])
        state.phi[a] += p.dt * state.phi_rate[a]
        if abs(state.phi[a]) > p.max_steer:
            state.phi[a] = np.sign(state.phi[a]) * p.max_steer
            state.phi_rate[a] = 0.0


# One body of 50 lines: split into a function each for wheels, axles and recording it took 1.4 to 2 times as long, because
# numba counts a reference to every array of a tuple that a call takes.
@njit(cache=True)
def scan(
    k0: int,
    every: int,
    command: F,
    slope: F,
    normal: F,
    p: PlantModel,
    faults: FaultTable,
    state: PlantState,
    out: Recording,
    row0: int,
) -> None:
    """Run the loop over one block; changes `state`, `faults.held` and the rows of `out` from `row0` on.

    Parameters
    ----------
    k0 : int
        Number of the block's first control step.
    every : int
        Control steps per recorded sample.
    command : NDArray[np.float64], shape (m, 2)
        v_c [m/s] and ω_c [rad/s].
    slope : NDArray[np.float64], shape (m,)
        Rise of the ground ahead [rad].
    normal : NDArray[np.float64], shape (m, wheels + 2 + fault channels)
        Standard normal numbers: speed sensors, steering sensors, then varying parts of faults.
    """
    n = p.x.size
    v, v_ref, u, u_v, slip = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    phi, u_s, u_sv, body = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(5)
    row = row0
    for j in range(slope.size):
        k = k0 + j
        fault_normal = normal[j, n + 2 :]
        _references(k, command[j, 0], command[j, 1], p, state, v_ref)
        for i in range(n):
            # y = Q[δ_s(v_a + n) + δ̄_s]
            clean = state.v[i] + p.v_std * normal[j, i]
            v[i] = _quantised(_faulted(i, k, clean, fault_normal[i], faults, state), p.v_lsb)
            state.last[i] = v[i]
            # Ψ̂' = −(β+|v_c|+|v|+ξ)Ψ̂ + ½ζe²
            rho = p.beta + abs(v_ref[i]) + abs(v[i]) + p.xi
            state.psi[i] = state.psi[i] * np.exp(-rho * p.dt) + 0.5 * p.zeta * (v[i] - v_ref[i]) ** 2 * p.dt
            if p.law == 5:
                _reset_at_jumps(i, v[i] - v_ref[i], p, state)
            u[i] = _law(v_ref[i], v[i], state.psi[i], p)
        if p.controller >= 0:
            controlled(p.controller, v_ref, v, p.dt, p.u_max, p.gains, state.controller, u)
        for i in range(n):
            c = n + 2 + i
            u_v[i] = _faulted(c, k, u[i], fault_normal[c], faults, state)
            state.last[c] = u_v[i]
        for a in range(2):
            clean = state.phi[a] + p.phi_std * normal[j, n + a]
            c = n + a
            phi[a] = _quantised(_faulted(c, k, clean, fault_normal[c], faults, state), p.phi_lsb)
            state.last[c] = phi[a]
            u_s[a] = min(max(p.k_ps * (state.axle_ref[a] - phi[a]), -p.u_max), p.u_max)
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
        _drive(slope[j], u_v, p, state, slip)
        if recorded:
            put(out.slip[row], slip)
            put(out.body[row], body)
            row += 1
        _steer(u_sv, p, state)
