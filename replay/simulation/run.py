"""Simulate one mission: duty cycle, faults, closed loop, measurement, truth."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from replay.controllers.choice import NEUTRAL, controller_state
from replay.errors import ConfigError
from replay.faults import FaultSpec, Side
from replay.simulation.duty import Duty, duty_of
from replay.simulation.measure import logged_columns, slow_groups
from replay.simulation.options import SIMULATED_AXLES, SIMULATED_LAWS, SimulatedMission, SimulationOptions
from replay.simulation.plant import scan
from replay.simulation.recorder import kept_rows, recorded_stamps, thinned
from replay.simulation.schedule import faults_of, varied_onsets
from replay.simulation.state import DELAY_LINE, FaultTable, PlantModel, PlantState, Recording
from replay.simulation.structure_draw import draw_machine
from replay.simulation.structured_plant import scan as structured_scan
from replay.simulation.structured_state import structure_state
from replay.simulation.truths import actual_signals, mission_truth

_BLOCK = 60_000  # control steps
_EVENT_LAGS = (0.05, 1.0)  # of the short and the long mean of |e| whose difference tells a jump [s]


def simulate_mission(options: SimulationOptions, block: int = _BLOCK) -> SimulatedMission:
    """Simulate one mission.

    Parameters
    ----------
    options : SimulationOptions
        What to simulate; the same options give the same numbers.
    block : int
        Control steps per block; any length gives the same numbers.

    Returns
    -------
    SimulatedMission
        Logged columns, truth file and true signals.

    Raises
    ------
    ConfigError
        Where two faults of one part and side overlap.
    """
    duty, faults, model = mission_parts(options)
    loop_rng, measure_rng, slow_rng, stamp_rng = (_generator(options, i) for i in (3, 4, 5, 6))
    table, order = _fault_table(options, faults, model.dt)
    recording = _run(options, duty, model, table, loop_rng, block)
    realised = np.full(len(faults), np.nan)
    realised[order] = table.held
    stamps = recorded_stamps(options, stamp_rng)
    columns = logged_columns(options, recording, duty, faults, measure_rng)
    return SimulatedMission(
        options=options,
        stamps=stamps,
        columns=columns,
        slow=thinned(options, slow_groups(options, stamps, recording.body, slow_rng), stamp_rng),
        truth=mission_truth(options, faults, realised, recording),
        actual=actual_signals(options, recording),
        kept=kept_rows(options, columns, stamp_rng),
    )


def mission_parts(options: SimulationOptions) -> tuple[Duty, tuple[FaultSpec, ...], PlantModel]:
    """Duty cycle, faults by start, and constants of the loop with which a mission is simulated."""
    duty = duty_of(options, _generator(options, 0))
    faults = varied_onsets(options, faults_of(options, duty, _generator(options, 1)), _generator(options, 7))
    return duty, faults, _model(options, _generator(options, 2))


def _generator(options: SimulationOptions, purpose: int) -> np.random.Generator:
    """Random numbers of one purpose; those of the others do not depend on how many are drawn."""
    return np.random.default_rng(np.random.SeedSequence(options.seed).spawn(purpose + 1)[purpose])


def _run(
    options: SimulationOptions,
    duty: Duty,
    model: PlantModel,
    table: FaultTable,
    rng: np.random.Generator,
    block: int,
) -> Recording:
    """Run the loop block by block; a generator fills its blocks in order, so their length changes no number."""
    wheels, every = len(options.machine.wheels), options.substeps
    rows = options.samples
    widths = [wheels] * 7 + [2] * 5 + [wheels, wheels, 2, 2, 5]
    out = Recording(*(np.zeros((rows, w)) for w in widths))
    state = _initial_state(wheels, options.psi0, table)
    steps = rows * every
    drawn = None
    if options.structure is not None:
        geometry = options.machine.geometry
        assert geometry is not None  # checked by SimulationOptions
        per_turn = np.pi * geometry.wheel_diameter / options.machine.gear_ratio
        chosen, machine_rng = options.structure.structure(options.seed), options.structure.generator(options.seed)
        drawn = draw_machine(chosen, model, machine_rng, per_turn, options.duration_s), structure_state(wheels)
    for k0 in range(0, steps, block):
        k = np.arange(k0, min(k0 + block, steps))
        t = np.asarray(k * model.dt, np.float64)
        normal = rng.standard_normal((k.size, wheels + 2 + state.last.size))
        command, slope, row = duty.command(t), duty.slope.at(t), -(-k0 // every)
        if drawn is None:
            scan(k0, every, command, slope, normal, model, table, state, out, row)
        else:
            (plant, structure), more = drawn
            structured_scan(k0, every, command, slope, normal, plant, structure, table, state, more, out, row)
    return out


def _initial_state(wheels: int, psi0: float, table: FaultTable) -> PlantState:
    """Everything at rest."""
    channels = table.first.size - 1
    return PlantState(
        v=np.zeros(wheels),
        spool=np.zeros(wheels),
        psi=np.full(wheels, float(psi0)),
        error=np.zeros((wheels, 3)),
        phi=np.zeros(2),
        phi_rate=np.zeros(2),
        body=np.zeros(5),
        axle_ref=np.zeros(2),
        wheel_ref=np.zeros(wheels),
        wheel_ref_rate=np.zeros(wheels),
        wheel_phi=np.zeros(wheels),
        last=np.zeros(channels),
        row=table.first[:-1].copy(),
        varying=np.zeros(channels),
        line=np.zeros((DELAY_LINE, 2 * wheels + 4)),
        controller=controller_state(wheels),
    )


def _gain(lag: float, dt: float) -> float:
    """Share of a first-order lag that one step covers."""
    return float(-np.expm1(-dt / lag)) if lag > 0.0 else 1.0


def _model(options: SimulationOptions, rng: np.random.Generator) -> PlantModel:
    machine, plant, control = options.machine, options.plant, options.machine.control
    geometry = machine.geometry
    assert geometry is not None  # checked by SimulationOptions
    wheels = [geometry.wheels[w] for w in machine.wheels]
    dt = 1.0 / (options.rate_hz * options.substeps)
    tau_spread = plant.wheel_spread if plant.tau_spread is None else plant.tau_spread
    spread = 1.0 + np.array([[plant.wheel_spread], [tau_spread]]) * rng.standard_normal((2, len(wheels)))
    per_turn = np.pi * geometry.wheel_diameter / machine.gear_ratio  # rim travel per motor turn [m]
    waves, level = _ice_field(options.ice_share, rng)
    zeta = options.zeta if options.zeta is not None else (control.zeta if options.law == "opposed" else 0.0)
    return PlantModel(
        dt=dt,
        x=np.array([w.x for w in wheels]),
        y=np.array([w.y for w in wheels]),
        d=np.array([w.offset for w in wheels]),
        axle_x=np.array([geometry.axle_x(a) for a in SIMULATED_AXLES]),
        K=plant.K * spread[0],
        tau=plant.tau * spread[1],
        speed_limit=plant.pump_flow / plant.motor_displacement * per_turn,
        dead_zone=plant.dead_zone,
        valve_gain=_gain(plant.valve_lag, dt),
        droop=plant.droop,
        leakage=plant.leakage,
        mass=plant.mass,
        mu=plant.friction,
        mu_ice=plant.ice_friction,
        slip_stiffness=plant.slip_stiffness,
        rolling=plant.rolling_resistance,
        ground=options.coupling == "ground",
        steer_gain=plant.steer_gain,
        steer_rate=plant.steer_rate,
        steer_lag_gain=_gain(plant.steer_lag, dt),
        max_steer=machine.max_steer,
        law=SIMULATED_LAWS.index(options.law),
        event_gains=np.array([_gain(lag, dt) for lag in _EVENT_LAGS]),
        lam=control.lambda_,
        xi=control.xi,
        beta=control.beta,
        zeta=0.0 if options.law == "p" else zeta,
        k_ps=control.k_ps,
        u_max=control.u_max,
        phi_dot_gain=_gain(1.0 / (2 * np.pi * control.phi_dot_hz), dt),
        v_std=plant.v_std,
        v_lsb=2500.0 / 4096 / 60 * per_turn if plant.v_lsb is None else plant.v_lsb,
        phi_std=plant.phi_std,
        phi_lsb=plant.phi_lsb,
        ice_waves=waves,
        ice_level=level,
        controller=-1 if options.controller is None else options.controller.kind.code,
        gains=NEUTRAL if options.controller is None else options.controller.gains(),
    )


def _ice_field(share: float, rng: np.random.Generator) -> tuple[NDArray[np.float64], float]:
    """Waves of 3–9 m over the ground, shape (6, 3), and the level that a `share` of it exceeds."""
    length, heading = rng.uniform(3.0, 9.0, 6), rng.uniform(0.0, 2 * np.pi, 6)
    waves = np.column_stack(
        [2 * np.pi / length * np.cos(heading), 2 * np.pi / length * np.sin(heading), rng.uniform(0.0, 2 * np.pi, 6)]
    )
    if share <= 0.0:
        return waves, np.inf
    points = rng.uniform(-50.0, 50.0, (4000, 2))
    height = np.cos(points @ waves[:, :2].T + waves[:, 2]).sum(axis=1)
    return waves, float(np.quantile(height, 1.0 - share))


def _fault_table(
    options: SimulationOptions, faults: tuple[FaultSpec, ...], dt: float
) -> tuple[FaultTable, NDArray[np.int64]]:
    """Faults sorted by channel, and for each row the fault's place in `faults`."""
    parts = (*options.machine.wheels, *SIMULATED_AXLES)
    channel = np.array([parts.index(f.component) + len(parts) * (f.side is Side.ACTUATOR) for f in faults], np.int64)
    times = np.array([(f.start_s, f.stop_s) for f in faults]).reshape(-1, 2)
    steps = np.ceil(times / dt - 1e-6).astype(np.int64)
    order = np.lexsort((steps[:, 0], channel))
    for a, b in pairwise(order):
        if channel[a] == channel[b] and steps[b, 0] < steps[a, 1]:
            raise ConfigError(
                f"two {faults[a].side} faults of {faults[a].component} overlap at {faults[b].start_s:g} s; "
                "let one end before the next begins"
            )
    sorted_faults = [faults[i] for i in order]
    tau = np.array([f.sat_tau_s for f in sorted_faults])
    table = FaultTable(
        first=np.searchsorted(channel[order], np.arange(2 * len(parts) + 1)).astype(np.int64),
        start=np.ascontiguousarray(steps[order, 0]),
        stop=np.ascontiguousarray(steps[order, 1]),
        epsilon=np.array([f.epsilon for f in sorted_faults], np.float64),
        sat=np.array([f.sat for f in sorted_faults], np.float64),
        std=np.array([f.sat_std for f in sorted_faults], np.float64),
        decay=np.exp(-dt / np.maximum(tau, 1e-12)).astype(np.float64),
        growth=dt / np.maximum(np.array([f.ramp_s for f in sorted_faults], np.float64), dt),
        held=np.full(len(faults), np.nan),
    )
    return table, order
