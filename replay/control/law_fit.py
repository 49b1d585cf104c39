"""Which reading of the law, and which λ, explain a recorded valve command.

For every reading the command is linear in λ and in one more unknown: Ψ̂(0)² where Ψ̂ decays as printed, ζ² where it is
forced from zero (Ψ̂ = ζ·G, G' = −ρG + ½e²). Fitting both together keeps Ψ̂ from biasing λ. Of long missions every few
samples are fitted; Ψ̂ runs through all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.control.loop_kernel import decay_shapes, decimated
from replay.control.mfhca import LAW_TEXT, Array, adaptive_sign, proportional_part

FIT_PSI = ("printed", "forced")
MIN_EXPLAINED = 0.9


@dataclass(frozen=True)
class LawFit:
    """One reading of the law fitted to recorded commands.

    Attributes
    ----------
    law, psi : str
        Reading of L15 (14) and mode of Ψ̂.
    lambda_, lambda_std : float
        λ̂ and its spread over the wheels [s/m].
    zeta : float
        ζ̂ of the forced mode [s/m²]; 0 for the printed mode.
    psi0 : tuple[float, ...]
        Ψ̂(0) per wheel of the printed mode; zeros for the forced mode.
    explained : float
        Share of the command's variation that the fit explains, 0…1.
    rms : float
        Root mean square of recorded − fitted command [fraction].
    """

    law: str
    psi: str
    lambda_: float
    lambda_std: float
    zeta: float
    psi0: tuple[float, ...]
    explained: float
    rms: float


def fit_law(
    u: Array,
    v: Array,
    v_c: Array,
    dt: float,
    *,
    xi: float,
    beta: float,
    u_max: float,
    laws: tuple[str, ...] = tuple(LAW_TEXT),
) -> tuple[LawFit, ...]:
    """Fit every reading; the best first.

    Parameters
    ----------
    u, v, v_c : Array, shape (n, wheels)
        Recorded command [fraction], measured and commanded speed [m/s]; NaN where not valid.
    dt : float
        Step [s].
    xi, beta : float
        ξ, β of L16 (13) [1/s].
    u_max : float
        Saturation; saturated samples are left out.
    laws : tuple[str, ...]
        Readings to try.

    Returns
    -------
    tuple[LawFit, ...]
        Empty where no wheel has 100 usable samples.
    """
    stride = decimated(u.shape[0])
    whole_v, whole_v_c = v, v_c
    u, v, v_c = (np.ascontiguousarray(x[::stride]) for x in (u, v, v_c))
    usable = np.isfinite(u) & np.isfinite(v) & np.isfinite(v_c) & (np.abs(u) < u_max * (1 - 1e-9))
    wheels = [i for i in range(u.shape[1]) if np.count_nonzero(usable[:, i]) >= 100]
    if not wheels:
        return ()
    shapes: dict[tuple[int, str], Array] = {}
    for i in wheels:
        shapes[i, "printed"], shapes[i, "forced"] = decay_shapes(whole_v[:, i], whole_v_c[:, i], dt, xi, beta)
    fits = [_fit_one(law, psi, u, v, v_c, usable, wheels, shapes) for law in laws for psi in FIT_PSI]
    return tuple(sorted(fits, key=lambda f: f.rms))


def _fit_one(
    law: str,
    psi: str,
    u: Array,
    v: Array,
    v_c: Array,
    usable: NDArray[np.bool_],
    wheels: list[int],
    shapes: dict[tuple[int, str], Array],
) -> LawFit:
    gains, adaptive_gains, weights, squares, total, count = [], [], [], 0.0, 0.0, 0
    for i in wheels:
        k = usable[:, i]
        part = proportional_part(law, v[k, i], v_c[k, i])
        basis = adaptive_sign(law, v[k, i], v_c[k, i]) * shapes[i, psi][k]
        a = np.stack([part, basis], axis=1)
        scale = np.sqrt((a**2).mean(axis=0))
        scale[scale == 0] = 1.0
        x, _, rank, _ = np.linalg.lstsq(a / scale, u[k, i], rcond=None)
        lam, adaptive = x / scale
        if adaptive < 0 or rank < 2:  # Ψ̂² cannot be negative
            lam, adaptive = float(part @ u[k, i]) / max(float(part @ part), 1e-300), 0.0
        residual = u[k, i] - lam * part - adaptive * basis
        squares += float(residual @ residual)
        total += float(np.sum((u[k, i] - u[k, i].mean()) ** 2))
        count += residual.size
        gains.append(lam)
        adaptive_gains.append(adaptive)
        weights.append(float(part @ part))
    lam = float(np.average(gains, weights=weights)) if sum(weights) > 0 else float("nan")
    spread = float(np.std(gains)) if len(gains) > 1 else 0.0
    root = np.sqrt(np.maximum(adaptive_gains, 0.0))
    per_wheel = np.zeros(u.shape[1])
    if psi == "printed":
        per_wheel[wheels] = root
    return LawFit(
        law=law,
        psi=psi,
        lambda_=lam,
        lambda_std=spread,
        zeta=float(np.median(root)) if psi == "forced" else 0.0,
        psi0=tuple(float(p) for p in per_wheel),
        explained=max(0.0, 1.0 - squares / total) if total > 0 else 0.0,
        rms=float(np.sqrt(squares / count)),
    )
