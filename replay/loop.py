"""The whole loop on a timeline: commands at the wheels, error, Ψ̂ and the commands that the law would have given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay import mfhca
from replay.kinematics import WheelCommands, wheel_angles, wheel_commands
from replay.law_fit import MIN_EXPLAINED, LawFit, fit_law
from replay.machine import Machine
from replay.timeline import Timeline

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reading:
    """One reading of the paper that was used: name, value, and why."""

    name: str
    value: str
    detail: str = ""


@dataclass(frozen=True)
class Replay:
    """The replayed loop; arrays are (n, wheels) or (n, axles), NaN where not defined.

    Attributes
    ----------
    v_ref : Array
        Commanded wheel speed v_c,i [m/s], recorded where logged, else by L1 (1).
    phi_ref : Array
        Commanded axle angle [rad], recorded where logged, else by L2 (2).
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
    steer_u, steer_difference : Array
        Replayed steering command L17 (15), and recorded − replayed [fraction].
    fits : tuple[LawFit, ...]
        Readings of the law fitted to the recorded command, best first.
    readings : tuple[Reading, ...]
        What was used.
    """

    v_ref: Array
    phi_ref: Array
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
    steer_u: Array
    steer_difference: Array
    fits: tuple[LawFit, ...]
    readings: tuple[Reading, ...]


def stack(timeline: Timeline, names: list[str]) -> Array:
    """Columns of a timeline side by side; NaN columns for signals that are not logged."""
    nothing = np.full(timeline.size, np.nan)
    return (
        np.stack([timeline.signals.get(name, nothing) for name in names], axis=1)
        if names
        else np.empty((timeline.size, 0))
    )


def replay_loop(timeline: Timeline, machine: Machine) -> Replay:
    """Replay the MFHCA loop open-loop with the recorded measurements.

    Parameters
    ----------
    timeline : Timeline
        Aligned signals.
    machine : Machine
        Geometry, law and readings.
    """
    readings: list[Reading] = []
    wheels, axles = machine.wheels, machine.axles
    v = stack(timeline, [f"wheel.{w}.v" for w in wheels])
    u = stack(timeline, [f"wheel.{w}.u" for w in wheels])
    phi = stack(timeline, [f"steer.{a}.phi" for a in axles])
    v_ref, phi_ref, wheel_phi = _commands(timeline, machine, phi, readings)
    control = machine.control
    rho = mfhca.decay_rate(v, v_ref, control.xi, control.beta)
    e = v - v_ref
    unfit = "" if np.isfinite(u).any() else "no recorded valve command to fit"
    if timeline.open_loop:  # the recorded commands answer to other measurements than these
        u, unfit = np.full_like(u, np.nan), "faults were injected into this recording, its controller never met them"
    law, psi_mode, lambda_, zeta, psi0, fits = _choose(machine, u, v, v_ref, timeline.dt, unfit, readings)
    shape = v.shape
    nothing = np.full(shape, np.nan)
    psi_printed, implied, psi, u_replayed, forcing = (nothing.copy() for _ in range(5))
    if law != "none":
        for i in range(len(wheels)):
            if not np.isfinite(v[:, i]).any() or not np.isfinite(v_ref[:, i]).any():
                continue
            squared, bound = mfhca.implied_psi_squared(law, u[:, i], v[:, i], v_ref[:, i], lambda_, control.u_max)
            decay, _ = mfhca.printed_decay(rho[:, i], timeline.dt)
            start = control.psi0 if control.psi0 is not None else mfhca.fit_psi0(decay, squared, ~bound)
            if psi_mode == "printed" and control.psi0 is None and fits:
                start = psi0[i]
            psi_printed[:, i] = start * decay
            implied[:, i] = squared
            forcing[:, i] = mfhca.implied_forcing(np.where(bound, np.nan, squared), rho[:, i], timeline.dt)
            psi[:, i] = _psi(psi_mode, psi_printed[:, i], squared, bound, rho[:, i], e[:, i], timeline.dt, zeta)
            u_replayed[:, i] = mfhca.drive_command(law, v[:, i], v_ref[:, i], psi[:, i] ** 2, lambda_, control.u_max)
    steer_u = mfhca.steering_command(phi_ref, phi, control.k_ps, control.u_max)
    steer_recorded = stack(timeline, [f"steer.{a}.u" for a in axles])
    if timeline.open_loop:
        steer_recorded = np.full_like(steer_recorded, np.nan)
    return Replay(
        v_ref=v_ref,
        phi_ref=phi_ref,
        wheel_phi=wheel_phi,
        e=e,
        rho=rho,
        psi_printed=psi_printed,
        psi_implied=np.sqrt(np.maximum(implied, 0.0)),
        implied_squared=implied,
        forcing=forcing,
        psi=psi,
        u=u_replayed,
        u_difference=u - u_replayed,
        steer_u=steer_u,
        steer_difference=steer_recorded - steer_u,
        fits=fits,
        readings=tuple(readings),
    )


def _commands(timeline: Timeline, machine: Machine, phi: Array, readings: list[Reading]) -> tuple[Array, Array, Array]:
    """Commanded wheel speeds and axle angles: recorded where logged, else by L1 and L2."""
    v_ref = stack(timeline, [f"wheel.{w}.v_ref" for w in machine.wheels])
    phi_ref = stack(timeline, [f"steer.{a}.phi_ref" for a in machine.axles])
    wheel_phi = np.full(v_ref.shape, np.nan)
    if machine.geometry is not None:
        wheel_phi = wheel_angles(phi, machine.geometry)
    logged_v = [bool(np.isfinite(v_ref[:, i]).any()) for i in range(v_ref.shape[1])]
    logged_phi = [bool(np.isfinite(phi_ref[:, i]).any()) for i in range(phi_ref.shape[1])]
    speed, omega = timeline.get("cmd.v"), timeline.get("cmd.omega")
    mapped: WheelCommands | None = None
    if machine.geometry is not None and speed is not None:
        mapped = wheel_commands(
            speed,
            np.zeros_like(speed) if omega is None else omega,
            machine.geometry,
            dt=timeline.dt,
            max_steer=machine.max_steer,
            phi_dot=machine.control.phi_dot,
            phi_dot_hz=machine.control.phi_dot_hz,
            measured_angle=wheel_phi,
        )
        v_ref[:, [not x for x in logged_v]] = mapped.speed[:, [not x for x in logged_v]]
        phi_ref[:, [not x for x in logged_phi]] = mapped.axle_angle[:, [not x for x in logged_phi]]
    if all(logged_v):
        readings.append(Reading("commanded wheel speed v_c,i", "as recorded"))
    elif mapped is not None:
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
        readings.append(Reading("commanded wheel speed v_c,i", "not available", "neither v_c,i nor v_c with geometry"))
    return v_ref, phi_ref, wheel_phi


def _choose(
    machine: Machine, u: Array, v: Array, v_ref: Array, dt: float, unfit: str, readings: list[Reading]
) -> tuple[str, str, float, float, tuple[float, ...], tuple[LawFit, ...]]:
    """Law, mode of Ψ̂ and constants to replay with."""
    control = machine.control
    zeros = (0.0,) * len(machine.wheels)
    if control.law == "none":
        readings.append(Reading("control law", "none", "another controller: no Ψ̂ and no controller evidence"))
        return "none", "printed", 0.0, 0.0, zeros, ()
    laws = tuple(mfhca.LAW_TEXT) if control.law == "auto" else (control.law,)
    fits = (
        fit_law(u, v, v_ref, dt, xi=control.xi, beta=control.beta, u_max=control.u_max, laws=laws) if not unfit else ()
    )
    if not fits:
        law: str = "signed" if control.law == "auto" else control.law
        why = unfit or "too few usable samples to fit"
        readings.append(Reading("control law", f"{law}: {mfhca.LAW_TEXT[law]}", f"{why}; λ = {control.lambda_:g} s/m"))
        readings.append(Reading("adaptive law Ψ̂", "printed only", why))
        return law, "printed", control.lambda_, control.zeta, zeros, ()
    best = fits[0]
    fitted = control.law == "auto" and best.explained >= MIN_EXPLAINED
    law = best.law
    lambda_ = best.lambda_ if fitted and best.lambda_ > 0 else control.lambda_
    detail = (
        f"fit: λ̂ = {best.lambda_:.4g} ± {best.lambda_std:.2g} s/m with Ψ̂ {best.psi}"
        + (f", ζ̂ = {best.zeta:.4g} s/m²" if best.psi == "forced" else "")
        + f"; explains {100 * best.explained:.1f} % of the recorded command"
    )
    if control.law == "auto" and not fitted:
        detail += "; no reading explains it well: the log may come from another controller"
    readings.append(
        Reading("control law", f"{law}: {mfhca.LAW_TEXT[law]}", f"{detail}; replayed with λ = {lambda_:.4g} s/m")
    )
    mode: str = control.psi
    zeta = control.zeta
    if mode == "auto":
        mode = best.psi if fitted else "printed"
        zeta = best.zeta if best.psi == "forced" and fitted else control.zeta
    text = {
        "printed": "L16 (13) as printed, exact exponential per step; Ψ̂(0) fitted"
        if control.psi0 is None
        else "as printed",
        "implied": "from the recorded command",
        "event_reset": "as printed, re-initialised at jumps of the implied value",
        "forced": f"Ψ̂' = −ρΨ̂ + ½ζe², ζ = {zeta:.4g} s/m²",
    }[mode]
    readings.append(Reading("adaptive law Ψ̂", mode, text))
    return law, mode, lambda_, zeta, best.psi0, fits


def _psi(
    mode: str, printed: Array, squared: Array, bound: NDArray[np.bool_], rho: Array, e: Array, dt: float, zeta: float
) -> Array:
    if mode == "implied":
        return np.sqrt(np.maximum(squared, 0.0))
    if mode == "event_reset":
        return mfhca.event_reset_psi(rho, np.where(bound, np.nan, squared), dt)[0]
    if mode == "forced":
        return mfhca.forced_psi(rho, e, dt, zeta)[0]
    return printed
