"""Ψ̂ and the valve command of one wheel through a mission, block by block with carried state."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks, release
from replay.control import mfhca

Array = NDArray[np.float64]

FIT_SAMPLES = 1 << 15
_FORCING_S = 0.25


@dataclass(frozen=True)
class LoopLaw:
    """What a loop is replayed with: reading of the law, mode of Ψ̂, λ [s/m], ζ [s/m²], u_max, ξ, β [1/s], and order.

    `lead` is the share of a step by which the forced Ψ̂ is ahead of its sample; see `replay.control.mfhca.forced_psi`.
    """

    law: str
    psi: str
    lambda_: float
    zeta: float
    u_max: float
    xi: float
    beta: float
    lead: float = 0.0


@dataclass(frozen=True)
class WheelBlock:
    """One block of one wheel; fields as in `replay.control.loop.Replay`."""

    psi_printed: Array
    implied_squared: Array
    forcing: Array
    psi: Array
    u: Array


def scan_wheel(
    law: LoopLaw, u: Array, v: Array, v_ref: Array, dt: float, psi0: float | None, parts: Iterable[slice]
) -> Iterator[WheelBlock]:
    """Replay one wheel.

    Parameters
    ----------
    law : LoopLaw
        What to replay with; its law is not ``none``.
    u, v, v_ref : Array, shape (n,)
        Recorded command [fraction], measured and commanded speed [m/s].
    dt : float
        Step [s].
    psi0 : float or None
        Ψ̂(0) of the printed law; None fits it to the implied values.
    parts : Iterable[slice]
        Blocks of n, in order.

    Yields
    ------
    WheelBlock
        One for each of the parts.
    """
    start = _fitted_start(law, u, v, v_ref, dt) if psi0 is None else psi0
    threshold = _threshold(law, u, v, v_ref) if law.psi == "event_reset" else 0.0
    total = forced = before = 0.0
    event = (np.nan, 0)
    half = round(_FORCING_S / dt) + 2
    for part in parts:
        near = slice(max(0, part.start - half), part.stop + half)  # what the forcing of its ends is found from
        inside = slice(part.start - near.start, part.stop - near.start)
        u_near, v_near, v_ref_near = (np.ascontiguousarray(x[near]) for x in (u, v, v_ref))
        rho_near = mfhca.decay_rate(v_near, v_ref_near, law.xi, law.beta)
        squared_near, bound_near = _implied(law, u_near, v_near, v_ref_near)
        free_near = np.where(bound_near, np.nan, squared_near)
        rho, squared, speed, asked = (x[inside] for x in (rho_near, squared_near, v_near, v_ref_near))
        decay, total = mfhca.printed_decay(rho, dt, total, before)
        printed = psi = start * decay
        if law.psi == "implied":
            psi = np.sqrt(np.maximum(squared, 0.0))
        elif law.psi == "event_reset":
            psi, _, event = mfhca.event_reset_psi(rho, free_near[inside], dt, threshold, state=event, before=before)
        elif law.psi == "forced":
            psi, forced = mfhca.forced_psi(rho, speed - asked, dt, law.zeta, forced, before, law.lead)
        before = float(mfhca.fill_forward(rho, before)[-1])
        forcing = mfhca.implied_forcing(free_near, rho_near, dt, _FORCING_S)[inside]
        command = mfhca.drive_command(law.law, speed, asked, psi**2, law.lambda_, law.u_max)
        yield WheelBlock(printed, squared, forcing, psi, command)
        release(u, v, v_ref)


def decimated(size: int) -> int:
    """Stride at which fits take samples of a mission of so many steps."""
    return max(1, size // FIT_SAMPLES)


def decay_shapes(v: Array, v_ref: Array, dt: float, xi: float, beta: float) -> tuple[Array, Array, Array]:
    """Ψ̂/Ψ̂(0) of the printed law, and Ψ̂/ζ of the forced one before and after each step, at every `decimated` step.

    The state runs through all steps.

    `v` and `v_ref` of shape (n,) in m/s, the results of shape (rows,); `dt` in s.
    """
    stride = decimated(v.size)
    printed, driven, ahead = [], [], []
    total = forced = before = 0.0
    for part in blocks(v.size):
        rho = mfhca.decay_rate(v[part], v_ref[part], xi, beta)
        decay, total = mfhca.printed_decay(rho, dt, total, before)
        psi, forced = mfhca.forced_psi(rho, v[part] - v_ref[part], dt, 1.0, forced, before)
        before = float(mfhca.fill_forward(rho, before)[-1])
        first = -part.start % stride
        printed.append(decay[first::stride])
        driven.append(psi[first::stride])
        ahead.append(np.append(psi[1:], forced)[first::stride])
        release(v, v_ref)
    return np.concatenate(printed), np.concatenate(driven), np.concatenate(ahead)


def _implied(law: LoopLaw, u: Array, v: Array, v_ref: Array) -> tuple[Array, NDArray[np.bool_]]:
    return mfhca.implied_psi_squared(law.law, u, v, v_ref, law.lambda_, law.u_max)


def _fitted_start(law: LoopLaw, u: Array, v: Array, v_ref: Array, dt: float) -> float:
    stride = decimated(v.size)
    squared, bound = _implied(law, u[::stride], v[::stride], v_ref[::stride])
    decay = decay_shapes(v, v_ref, dt, law.xi, law.beta)[0]
    return mfhca.fit_psi0(decay, squared, ~bound)


def _threshold(law: LoopLaw, u: Array, v: Array, v_ref: Array) -> float:
    stride = decimated(v.size)
    two = []
    for first in (0, 1):
        squared, bound = _implied(law, *(x[first::stride][: (v.size - 1) // stride] for x in (u, v, v_ref)))
        two.append(np.where(bound, np.nan, squared))
    return mfhca.jump_threshold(two[1] - two[0])
