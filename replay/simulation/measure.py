"""What a log holds of a simulated mission: measured signals, never true ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.faults import FaultMode, FaultSpec, Side
from replay.simulation.duty import Duty
from replay.simulation.options import SIMULATED_AXLES, SimulationOptions, SlowGroup
from replay.simulation.state import Recording

_COMMAND_GRID = 1e-6  # resolution of logged commands (m/s, rad, rad/s, fraction)
_SPOOL_STD, _SPOOL_LSB = 0.003, 2.0 / 4096
_SECOND_SPEED_STD, _SECOND_SPEED_LSB = 0.002, 0.001  # [m/s]
_SECOND_ANGLE_STD, _SECOND_ANGLE_LSB = 0.001, 0.0005  # [rad]
_ORIGIN = (61.0, 24.0)  # latitude, longitude of the start [deg]
_METRES_PER_DEGREE = 111_320.0


def logged_columns(
    options: SimulationOptions,
    recording: Recording,
    duty: Duty,
    faults: tuple[FaultSpec, ...],
    rng: np.random.Generator,
) -> dict[str, NDArray[np.float64]]:
    """Logged signals at the recorded rate by canonical name, SI, each of shape (n,)."""
    t = np.arange(options.samples) / options.rate_hz
    spool, direct = options.evidence != "base", options.evidence == "direct"
    command = _grid(duty.command(t), _COMMAND_GRID)
    columns = {"cmd.v": command[:, 0], "cmd.omega": command[:, 1]}

    def add(prefix: str, parts: tuple[str, ...], leaf: str, values: NDArray[np.float64]) -> None:
        columns.update({f"{prefix}.{part}.{leaf}": np.ascontiguousarray(values[:, i]) for i, part in enumerate(parts)})

    def redundant(late: NDArray[np.float64], std: float, lsb: float) -> NDArray[np.float64]:
        return _grid(late + std * rng.standard_normal(late.shape), lsb)

    wheels, axles = options.machine.wheels, SIMULATED_AXLES
    add("wheel", wheels, "v_ref", _grid(recording.v_ref, _COMMAND_GRID))
    add("wheel", wheels, "v", recording.v)
    add("wheel", wheels, "u", _grid(recording.u, _COMMAND_GRID))
    add("steer", axles, "phi_ref", _grid(recording.phi_ref, _COMMAND_GRID))
    add("steer", axles, "phi", recording.phi)
    add("steer", axles, "u", _grid(recording.steer_u, _COMMAND_GRID))
    if spool:
        add("wheel", wheels, "u_applied", redundant(recording.u_late, _SPOOL_STD, _SPOOL_LSB))
        add("steer", axles, "u_applied", redundant(recording.steer_u_late, _SPOOL_STD, _SPOOL_LSB))
    if direct:
        add("wheel", wheels, "v_true", redundant(recording.v_late, _SECOND_SPEED_STD, _SECOND_SPEED_LSB))
        add("steer", axles, "phi_true", redundant(recording.phi_late, _SECOND_ANGLE_STD, _SECOND_ANGLE_LSB))
    if options.silent != "zero":
        _silence(columns, t, faults)
    return columns


def _silence(columns: dict[str, NDArray[np.float64]], t: NDArray[np.float64], faults: tuple[FaultSpec, ...]) -> None:
    """Log no value while a sensor gives no signal."""
    for fault in faults:
        if fault.side is Side.SENSOR and fault.mode is FaultMode.NO_SIGNAL:
            steer = fault.component in SIMULATED_AXLES
            name = f"steer.{fault.component}.phi" if steer else f"wheel.{fault.component}.v"
            columns[name][(t >= fault.start_s - 1e-9) & (t < fault.stop_s - 1e-9)] = np.nan


def _grid(values: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Quantise; the inverse of the step is a whole number where the step is decimal, so that texts stay short."""
    inverse = 1.0 / step
    return np.round(values * inverse) / inverse + 0.0  # + 0.0 turns −0 into 0


def slow_groups(
    options: SimulationOptions, stamps: NDArray[np.int64], body: NDArray[np.float64], rng: np.random.Generator
) -> tuple[SlowGroup, ...]:
    """Yaw rate at 100 Hz and positions at 10 Hz, with noise.

    Parameters
    ----------
    options : SimulationOptions
        Says which are logged.
    stamps : NDArray[np.int64], shape (n,)
        Recorded stamps [ns].
    body : NDArray[np.float64], shape (n, 5)
        Speed, x, y, yaw, yaw rate.
    rng : np.random.Generator
        Source of the noise.
    """
    groups = []
    logged = options.evidence != "base"
    if logged if options.imu is None else options.imu:
        rows = _rows(options, min(100.0, options.rate_hz))
        rate = body[rows, 4] + 0.001 + 0.002 * rng.standard_normal(rows.size)
        groups.append(SlowGroup("imu", stamps[rows], {"imu.yaw_rate": _grid(rate, 1e-6)}))
    if logged if options.gnss is None else options.gnss:
        rows = _rows(options, 10.0)
        # Decimetres that wander slowly, centimetres from fix to fix.
        wander = np.cumsum(rng.standard_normal((rows.size, 2)), axis=0) * 0.005
        place = body[rows, 1:3] + wander + 0.02 * rng.standard_normal((rows.size, 2))
        degree = _METRES_PER_DEGREE * np.array([1.0, np.cos(np.radians(_ORIGIN[0]))])
        lat, lon = (np.array(_ORIGIN) + place[:, ::-1] / degree).T
        groups.append(SlowGroup("gnss", stamps[rows], {"gnss.lat": _grid(lat, 1e-9), "gnss.lon": _grid(lon, 1e-9)}))
    return tuple(groups)


def _rows(options: SimulationOptions, rate: float) -> NDArray[np.int64]:
    """Recorded rows nearest to the instants of a slower rate."""
    count = int(np.floor((options.samples - 1) * rate / options.rate_hz)) + 1
    rows: NDArray[np.int64] = np.rint(np.arange(count) * (options.rate_hz / rate)).astype(np.int64)
    return rows
