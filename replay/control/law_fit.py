"""Which reading of the law, and which λ, explain a recorded valve command.

For every reading the command is linear in λ and in one more unknown: Ψ̂(0)² where Ψ̂ decays as printed, ζ² where it is
forced from zero (Ψ̂ = ζ·G, G' = −ρG + ½e²). Fitting both together keeps Ψ̂ from biasing λ. Of a forced Ψ̂ the order is fitted
too: whether a command holds the step of its own sample. A log slower than the controller lacks part of what forced Ψ̂, and λ
would take it up; there λ comes from short windows (`replay.control.local_fit`). Of long missions every few samples are
fitted; Ψ̂ runs through all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.control.local_fit import LAMBDA_S, local_lambda
from replay.control.loop_kernel import decay_shapes, decimated
from replay.control.mfhca import LAW_TEXT, Array, adaptive_sign, proportional_part

FIT_PSI = ("printed", "forced")
MIN_EXPLAINED = 0.9
_LEADS = (0.0, 0.5, 1.0)
_ORDER_SHOWS = 0.98  # residual with another order, as a share, from which the order shows
_MISFIT_DOUBT = 4.0  # error of λ̂ per share left unexplained, as seen on simulated missions
_LOCAL_DOUBT = 0.005  # least error of λ̂ from windows, as a share
_LENGTH_DOUBT = 0.3  # share of what a window of twice the length changes


@dataclass(frozen=True)
class LawFit:
    """One reading of the law fitted to recorded commands.

    Attributes
    ----------
    law, psi : str
        Reading of L15 (14) and mode of Ψ̂.
    lambda_, lambda_std : float
        λ̂ and its standard deviation: its spread over the wheels, and what the reading leaves unexplained [s/m].
    zeta : float
        ζ̂ of the forced mode [s/m²]; 0 for the printed mode.
    psi0 : tuple[float, ...]
        Ψ̂(0) per wheel of the printed mode; zeros for the forced mode.
    explained : float
        Share of the command's variation that the fit explains, 0…1.
    rms : float
        Root mean square of recorded − fitted command [fraction].
    lead : float
        Share of a sample's own step that the forced Ψ̂ of its command holds; see `replay.control.mfhca.forced_psi`.
    """

    law: str
    psi: str
    lambda_: float
    lambda_std: float
    zeta: float
    psi0: tuple[float, ...]
    explained: float
    rms: float
    lead: float = 0.0


@dataclass(frozen=True)
class _Samples:
    """Usable samples of every wheel, each array of shape (n_i,), and the squares of u about its mean."""

    u: list[Array]
    v: list[Array]
    v_c: list[Array]
    printed: list[Array]
    forced: list[Array]
    ahead: list[Array]
    variation: list[float]
    wheels: list[int]
    count: int

    def shape(self, psi: str, i: int, lead: float) -> Array:
        """Ψ̂² of a wheel for Ψ̂(0) = 1 or ζ = 1."""
        if psi == "printed":
            return np.asarray(self.printed[i] ** 2)
        return np.asarray((self.forced[i] + lead * (self.ahead[i] - self.forced[i])) ** 2)


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
    samples = _usable(u, v, v_c, dt, xi, beta, u_max)
    if not samples.wheels:
        return ()
    fits = [_fit_one(law, psi, samples) for law in laws for psi in FIT_PSI]
    best, *others = sorted(fits, key=lambda f: f.rms)
    if best.psi == "forced":
        best = _in_order(best, samples)
    if best.psi == "forced" and best.lambda_std > _LOCAL_DOUBT * abs(best.lambda_):
        windows = (LAMBDA_S, 2 * LAMBDA_S)
        local = [
            [local_lambda(best.law, u[:, i], v[:, i], v_c[:, i], dt, u_max, s) for s in windows] for i in samples.wheels
        ]
        best = _with_local(best, samples, np.array(local))
    return best, *others


def _usable(u: Array, v: Array, v_c: Array, dt: float, xi: float, beta: float, u_max: float) -> _Samples:
    """Samples that are known and not saturated, of wheels with at least 100 of them."""
    stride = decimated(u.shape[0])
    samples = _Samples([], [], [], [], [], [], [], [], u.shape[1])
    for i in range(u.shape[1]):
        part = [np.ascontiguousarray(x[::stride, i]) for x in (u, v, v_c)]
        k = np.isfinite(part[0]) & np.isfinite(part[1]) & np.isfinite(part[2]) & (np.abs(part[0]) < u_max * (1 - 1e-9))
        if np.count_nonzero(k) < 100:
            continue
        shapes = decay_shapes(v[:, i], v_c[:, i], dt, xi, beta)
        fields = (samples.u, samples.v, samples.v_c, samples.printed, samples.forced, samples.ahead)
        for field, x in zip(fields, (*part, *shapes), strict=True):
            field.append(x[k])
        samples.variation.append(float(np.sum((samples.u[-1] - samples.u[-1].mean()) ** 2)))
        samples.wheels.append(i)
    return samples


def _fit_one(law: str, psi: str, s: _Samples, lead: float = 0.5, lambdas: Array | None = None) -> LawFit:
    """Fit a reading with a given order; of given λ̂ of each wheel, its Ψ̂ alone."""
    gains, adaptive_gains, weights, squares, total, count = [], [], [], 0.0, 0.0, 0
    for j in range(len(s.wheels)):
        part = proportional_part(law, s.v[j], s.v_c[j])
        basis = adaptive_sign(law, s.v[j], s.v_c[j]) * s.shape(psi, j, lead)
        u = s.u[j]
        lam, adaptive = _solved(part, basis, u, None if lambdas is None else float(lambdas[j]))
        residual = u - lam * part - adaptive * basis
        squares += _sum(residual, residual)
        total += s.variation[j]
        count += residual.size
        gains.append(lam)
        adaptive_gains.append(adaptive)
        weights.append(_sum(part, part))
    lam = float(np.average(gains, weights=weights)) if sum(weights) > 0 else float("nan")
    spread = float(np.std(gains)) if len(gains) > 1 else 0.0
    explained = max(0.0, 1.0 - squares / total) if total > 0 else 0.0
    root = np.sqrt(np.maximum(adaptive_gains, 0.0))
    per_wheel = np.zeros(s.count)
    if psi == "printed":
        per_wheel[s.wheels] = root
    return LawFit(
        law=law,
        psi=psi,
        lambda_=lam,
        lambda_std=float(np.hypot(spread, _MISFIT_DOUBT * np.sqrt(1.0 - explained) * abs(lam))),
        zeta=float(np.median(root)) if psi == "forced" else 0.0,
        psi0=tuple(float(p) for p in per_wheel),
        explained=explained,
        rms=float(np.sqrt(squares / count)),
        lead=lead if psi == "forced" else 0.0,
    )


def _sum(a: Array, b: Array) -> float:
    """Sum of a·b, without the linear algebra's threads: they cost more than they save where other work is done beside."""
    return float(np.einsum("i,i->", a, b))


def _solved(part: Array, basis: Array, u: Array, given: float | None) -> tuple[float, float]:
    """λ and the gain of Ψ̂², which cannot be negative, by normal equations of scaled columns."""
    pp, bb, pb = _sum(part, part), _sum(basis, basis), _sum(part, basis)
    pu, bu = _sum(part, u), _sum(basis, u)
    if given is not None:
        return given, max(0.0, (bu - given * pb) / bb) if bb > 0 else 0.0
    alike = pb * pb / (pp * bb) if pp > 0 and bb > 0 else 1.0
    if alike < 1.0 - 1e-12:
        adaptive = (bu / bb - pb * pu / (pp * bb)) / (1.0 - alike)
        if adaptive >= 0:
            return (pu - adaptive * pb) / pp, adaptive
    return pu / max(pp, 1e-300), 0.0


def _in_order(fit: LawFit, s: _Samples) -> LawFit:
    """The reading with the share of a step that its forced Ψ̂ is ahead, by the least residual; as it is where none shows."""
    tried = [fit if lead == fit.lead else _fit_one(fit.law, fit.psi, s, lead) for lead in _LEADS]
    found = _least(fit, tried, s)
    return found if found.rms < _ORDER_SHOWS * fit.rms else fit


def _least(fit: LawFit, tried: list[LawFit], s: _Samples) -> LawFit:
    """The best of readings with an order each, or of the order between them where their residuals bend."""
    misfit = np.array([f.rms**2 for f in tried])
    k = int(np.clip(np.argmin(misfit), 1, len(_LEADS) - 2))
    c = np.polyfit(_LEADS[k - 1 : k + 2], misfit[k - 1 : k + 2], 2)
    if c[0] <= 0:
        return tried[int(np.argmin(misfit))]
    lead = float(np.clip(-c[1] / (2 * c[0]), 0.0, 1.0))
    return min((_fit_one(fit.law, fit.psi, s, lead), *tried), key=lambda f: f.rms)


def _with_local(fit: LawFit, s: _Samples, local: NDArray[np.float64]) -> LawFit:
    """The reading with λ̂ of each wheel from short windows, and from windows twice as long, where that is surer.

    What the length of the windows changes is doubt: Ψ̂² is no exact line within them.
    """
    known = local[np.isfinite(local).all(axis=1)]
    if not known.size:
        return fit
    middle, longer = np.median(known, axis=0).tolist()
    spread = float(np.std(known[:, 0]))
    doubt = float(np.sqrt(spread**2 + (_LOCAL_DOUBT * middle) ** 2 + (_LENGTH_DOUBT * (longer - middle)) ** 2))
    if not doubt < fit.lambda_std:
        return fit
    found = _fit_one(fit.law, fit.psi, s, fit.lead, np.where(np.isfinite(local[:, 0]), local[:, 0], middle))
    return LawFit(**{**vars(found), "lambda_": middle, "lambda_std": doubt})
