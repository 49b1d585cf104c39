"""The whole loop on a timeline: commands at the wheels, error, Ψ̂ and the commands that the law would have given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks, release
from replay.arrays.column_store import ColumnStore
from replay.arrays.envelope import envelope, in_buckets, rows_of
from replay.arrays.processors import each
from replay.control import mfhca
from replay.control.kinematics import CommandState, commands_by_angles, wheel_angles, wheel_commands
from replay.control.law_choice import Reading, choose_law
from replay.control.law_fit import LawFit
from replay.control.local_fit import PiFit
from replay.control.loop_kernel import LoopLaw, scan_wheel
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_FIRST_ROWS = 4096  # nearly always hold a number of every column that has any


@dataclass(frozen=True)
class Replay:
    """The replayed loop; arrays are (n, wheels) or (n, axles), NaN where not defined.

    All but `v_ref`, `phi_ref` and `steer_u` are for pictures and exports: they have the rows of `replay.arrays.envelope` for
    `bucket`, which are the n steps themselves where it is 1.

    Attributes
    ----------
    v_ref : Array
        Commanded wheel speed v_c,i [m/s], recorded where logged, else by L1 (1).
    phi_ref : Array
        Commanded axle angle [rad], recorded where logged, else by L2 (2).
    steer_u : Array
        Replayed steering command L17 (15) [fraction].
    bucket : int
        Steps per bucket of the fields below.
    wheel_phi : Array
        Measured angle of each wheel [rad].
    e : Array
        v − v_c with the measured v [m/s].
    rho : Array
        ρ of L16 (13) [1/s].
    psi_printed, psi_implied : Array
        Ψ̂ as printed, and √max(0, implied Ψ̂²).
    implied_squared : Array
        Implied Ψ̂², signed [fraction].
    forcing : Array
        w = d(Ψ̂²)/dt + 2ρΨ̂² of the implied Ψ̂² [fraction/s].
    psi : Array
        Ψ̂ of the mode in use.
    u : Array
        Replayed valve command [fraction].
    u_difference : Array
        Recorded − replayed valve command [fraction].
    steer_difference : Array
        Recorded − replayed steering command [fraction].
    fits : tuple[LawFit, ...]
        Readings of the law fitted to the recorded command, best first.
    readings : tuple[Reading, ...]
        What was used.
    law : LoopLaw or None
        Law that was replayed.
    psi0 : tuple[float or None, ...]
        Ψ̂(0) of each wheel; None where it was fitted.
    pi : PiFit or None
        Proportional and integral law with feed-forward that gave the commands, where no reading of MFHCA explains them.
    """

    v_ref: Array
    phi_ref: Array
    steer_u: Array
    bucket: int
    wheel_phi: Array
    e: Array
    rho: Array
    psi_printed: Array
    psi_implied: Array
    implied_squared: Array
    forcing: Array
    psi: Array
    u: Array
    u_difference: Array
    steer_difference: Array
    fits: tuple[LawFit, ...]
    readings: tuple[Reading, ...]
    law: LoopLaw | None = None
    psi0: tuple[float | None, ...] = ()
    pi: PiFit | None = None


def stack(timeline: Timeline, names: list[str]) -> Array:
    """Columns of a timeline side by side, not to be written to; NaN columns for signals that are not logged.

    Shape (n, names).
    """
    return timeline.beside(names)


def replay_loop(timeline: Timeline, machine: Machine, bucket: int = 1) -> Replay:
    """Replay the MFHCA loop open-loop with the recorded measurements.

    Parameters
    ----------
    timeline : Timeline
        Aligned signals.
    machine : Machine
        Geometry, law and readings.
    bucket : int
        Steps per bucket of what is for pictures alone; see `replay.arrays.envelope`.
    """
    readings: list[Reading] = []
    control = machine.control
    v = stack(timeline, [f"wheel.{w}.v" for w in machine.wheels])
    u = stack(timeline, [f"wheel.{w}.u" for w in machine.wheels])
    phi = stack(timeline, [f"steer.{a}.phi" for a in machine.axles])
    v_ref, phi_ref = _commands(timeline, machine, phi, readings)
    geometry = machine.geometry
    unfit = "" if any_finite(u).any() else "no recorded valve command to fit"
    steer_recorded = stack(timeline, [f"steer.{a}.u" for a in machine.axles])
    if timeline.open_loop:  # the recorded commands answer to other measurements than these
        u, steer_recorded = (np.broadcast_to(np.nan, x.shape) for x in (u, steer_recorded))
        unfit = "faults were injected into this recording, its controller did not react to them"
    law, psi0, fits, pi = choose_law(machine, u, v, v_ref, timeline.dt, unfit, readings)
    scanned = _scan(law, u, v, v_ref, timeline.dt, psi0, bucket, timeline.store)
    steer_u = timeline.map(lambda a, b: mfhca.steering_command(a, b, control.k_ps, control.u_max), phi_ref, phi)

    def shown(function: Callable[..., Array], *arrays: Array) -> Array:
        return in_buckets(function, bucket, timeline.store, *arrays)

    return Replay(
        v_ref=v_ref,
        phi_ref=phi_ref,
        steer_u=steer_u,
        bucket=bucket,
        wheel_phi=shown(
            lambda a: np.full((len(a), len(machine.wheels)), np.nan) if geometry is None else wheel_angles(a, geometry),
            phi,
        ),
        e=shown(np.subtract, v, v_ref),
        rho=shown(lambda a, b: mfhca.decay_rate(a, b, control.xi, control.beta), v, v_ref),
        psi_printed=scanned["psi_printed"],
        psi_implied=timeline.map(lambda x: np.sqrt(np.maximum(x, 0.0)), scanned["implied_squared"]),
        implied_squared=scanned["implied_squared"],
        forcing=scanned["forcing"],
        psi=scanned["psi"],
        u=scanned["u"],
        u_difference=scanned["u_difference"],
        steer_difference=shown(np.subtract, steer_recorded, steer_u),
        fits=fits,
        readings=tuple(readings),
        law=law,
        psi0=tuple(psi0),
        pi=pi,
    )


def _commands(timeline: Timeline, machine: Machine, phi: Array, readings: list[Reading]) -> tuple[Array, Array]:
    """Commanded wheel speeds and axle angles: recorded where logged, else by L1 and L2."""
    wheels, axles = machine.wheels, machine.axles
    v_ref = stack(timeline, [f"wheel.{w}.v_ref" for w in wheels])
    phi_ref = stack(timeline, [f"steer.{a}.phi_ref" for a in axles])
    logged_v, logged_phi = any_finite(v_ref), any_finite(phi_ref)
    speed, omega = timeline.get("cmd.v"), timeline.get("cmd.omega")
    geometry = machine.geometry
    mapped = geometry is not None and speed is not None
    _say_commands(machine, bool(logged_v.all()), mapped, readings, turning=omega is not None)
    if geometry is None or speed is None or (logged_v.all() and logged_phi.all()):
        return v_ref, phi_ref

    if omega is None:

        def turned(v_ref: Array, phi_ref: Array, phi: Array, speed: Array) -> Array:
            return np.where(logged_v, v_ref, commands_by_angles(phi_ref, phi, speed, geometry))

        return timeline.map(turned, v_ref, phi_ref, phi, speed), phi_ref

    def completed(
        state: CommandState, v_ref: Array, phi_ref: Array, phi: Array, speed: Array, omega: Array
    ) -> tuple[tuple[Array, Array], CommandState]:
        found = wheel_commands(
            speed,
            omega,
            geometry,
            dt=timeline.dt,
            max_steer=machine.max_steer,
            phi_dot=machine.control.phi_dot,
            phi_dot_hz=machine.control.phi_dot_hz,
            measured_angle=wheel_angles(phi, geometry),
            state=state,
        )
        return (np.where(logged_v, v_ref, found.speed), np.where(logged_phi, phi_ref, found.axle_angle)), state

    (v_all, phi_all), _ = timeline.scan(completed, CommandState(), v_ref, phi_ref, phi, speed, omega)
    return v_all, phi_all


def _say_commands(machine: Machine, logged: bool, mapped: bool, readings: list[Reading], *, turning: bool) -> None:
    if logged:
        readings.append(Reading(f"commanded {machine.part} speed v_c,i", "as recorded"))
    elif mapped and not turning:
        by = "from v_c and the steering angles: no ω_c is logged"
        readings.append(
            Reading(
                f"commanded {machine.part} speed v_c,i", by, "unknown beside the middle line where no axle is steered"
            )
        )
    elif mapped:
        assert machine.geometry is not None
        offsets = sorted({abs(w.offset) for w in machine.geometry.wheels.values()})
        readings.append(
            Reading(
                "commanded wheel speed v_c,i",
                "from v_c, ω_c by L1 (1)",
                "v_c,i = s·|v_k| − (ω_b + φ̇)·d_i, s = sgn of the joint's forward speed, φ̇ from the "
                f"{machine.control.phi_dot} angle below {machine.control.phi_dot_hz:g} Hz, |d| = "
                + ", ".join(f"{o:g} m" for o in offsets),
            )
        )
        readings.append(Reading("steering angle φ_c,i", "by L2 (2)", "along the rolling direction, held at standstill"))
    else:
        readings.append(
            Reading(f"commanded {machine.part} speed v_c,i", "not available", "neither v_c,i nor v_c with geometry")
        )


def any_finite(values: Array) -> NDArray[np.bool_]:
    """Which columns of an (n, k) array hold a number anywhere, shape (k,)."""
    found = np.zeros(values.shape[1], np.bool_)
    if not any(values.strides):  # one number for all
        return np.isfinite(values[0]) if len(values) else found
    if np.isfinite(values[:_FIRST_ROWS]).any(axis=0).all():
        return np.ones_like(found)
    for part in blocks(len(values)):
        found |= np.isfinite(values[part]).any(axis=0)
        release(values)
        if found.all():
            break
    return found


def _missing(shape: tuple[int, int]) -> Array:
    return np.full(shape, np.nan)


def _scan(
    law: LoopLaw | None,
    u: Array,
    v: Array,
    v_ref: Array,
    dt: float,
    psi0: list[float | None],
    bucket: int,
    store: ColumnStore,
) -> dict[str, Array]:
    """Fields of `Replay` that depend on the law; NaN where there is none, or where a wheel lacks a speed."""
    wheels = v.shape[1]
    names = ("psi_printed", "implied_squared", "forcing", "psi", "u", "u_difference")
    if law is None:
        return dict.fromkeys(names, np.broadcast_to(np.nan, (rows_of(len(v), bucket), wheels)))
    usable = any_finite(v) & any_finite(v_ref)
    parts = tuple(store.blocks(len(v), bucket))
    scans = {i: scan_wheel(law, u[:, i], v[:, i], v_ref[:, i], dt, psi0[i], parts) for i in range(wheels) if usable[i]}
    columns = {name: store.column(np.float64, (wheels,), rows_of(len(v), bucket)) for name in names}
    for part in parts:
        room = np.empty if len(scans) == wheels else _missing
        found = {name: room((part.stop - part.start, wheels)) for name in names}
        done = each(lambda scan: next(scan), scans.values(), len(v))
        for i, block in zip(scans, done, strict=True):
            for name in names[:-1]:
                found[name][:, i] = getattr(block, name)
            found["u_difference"][:, i] = u[part, i] - block.u
        for name, values in found.items():
            columns[name].append(envelope(values, bucket))
    return {name: column.finish() for name, column in columns.items()}
