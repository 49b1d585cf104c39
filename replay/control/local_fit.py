"""Gains of a controller from short windows of the recorded command, within which its slow part is free.

What a controller adds slowly (Ψ̂², an integral) is a line over a short window, whatever made it; what remains of the command
follows from the error of the same sample. So neither the order in which Ψ̂ is advanced nor what happened between two recorded
samples reaches the gains found here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.control.mfhca import Array, adaptive_sign, proportional_part

_SAMPLES = 1 << 16  # of a wheel that are looked at
LAMBDA_S = 0.05  # length of a window over which Ψ̂² is a line
_PI_S = 1.0
_LEAST_LENGTH, _LEAST_WINDOWS = 5, 8
_PARTS = 10


def spread_windows(size: int, length: int) -> NDArray[np.int64]:
    """Samples of whole windows, spread evenly over `size` where there are more than are needed, shape (windows, length)."""
    whole = size // length
    kept = min(whole, max(1, _SAMPLES // length))
    first = np.arange(kept) * whole // max(kept, 1) * length
    return np.asarray(first[:, None] + np.arange(length))


def local_lambda(
    law: str, u: Array, v: Array, v_c: Array, dt: float, u_max: float, window_s: float = LAMBDA_S
) -> float:
    """λ of one wheel, with Ψ̂² a line within each window and its present step free.

    u = λ·p + s·(Ψ₀² + Ψ₁²t) + c·s·Ψ₀e² with the law's proportional part p and sign s; the last term is what the sample's own
    error has just added to Ψ̂².

    Parameters
    ----------
    law : str
        Reading of L15 (14).
    u, v, v_c : Array, shape (n,)
        Recorded command [fraction], measured and commanded speed [m/s]; windows with NaN or saturation are left out.
    dt : float
        Step [s].
    u_max : float
        Saturation [fraction].
    window_s : float
        Length of a window [s].

    Returns
    -------
    float
        λ̂ [s/m]; NaN where too few windows answer.
    """
    places = spread_windows(u.size, max(_LEAST_LENGTH, round(window_s / dt)))
    u, v, v_c = (np.asarray(x[places]) for x in (u, v, v_c))
    part, sign = proportional_part(law, v, v_c), adaptive_sign(law, v, v_c)
    good = _free(u, u_max) & np.isfinite(part).all(axis=1) & (sign != 0).all(axis=1)
    if np.count_nonzero(good) < _LEAST_WINDOWS:
        return float("nan")
    u, part, sign, e = u[good], part[good], sign[good], (v - v_c)[good]
    slow = np.stack([sign, sign * np.linspace(-1.0, 1.0, u.shape[1])], axis=1)
    level = np.mean(sign * u - np.abs(part), axis=1)
    step = sign * e**2 * np.sqrt(np.maximum(level, 0.0))[:, None]
    x = np.stack([part, step], axis=2)
    beta, *_ = _projected(x, u, slow)
    return float(beta[0])


@dataclass(frozen=True)
class PiFit:
    """A proportional and integral controller with feed-forward, u = ff·v_c − kp·e − ki·∫e dt.

    Attributes
    ----------
    feed_forward, kp, ki : float
        Means over the wheels [s/m], [s/m], [1/m].
    spread : tuple[float, float, float]
        Their standard deviations over the wheels, or over parts of the mission where that is more.
    explained : float
        Share of the command's variation within windows of a second that it explains, 0…1; least of the wheels.
    """

    feed_forward: float
    kp: float
    ki: float
    spread: tuple[float, float, float]
    explained: float

    @property
    def text(self) -> str:
        """The law with its gains."""
        terms = ((self.feed_forward, "v_c"), (-self.kp, "e"), (-self.ki, "∫e dt"))
        text = " ".join(f"{'−' if gain < 0.0 else '+'} {abs(gain):.3g}·{of}" for gain, of in terms)
        return f"u = {text.removeprefix('+ ')}"


def fit_pi(u: Array, v: Array, v_c: Array, dt: float, u_max: float, driving: float) -> PiFit | None:
    """Fit a PI controller with feed-forward to the recorded commands.

    Parameters
    ----------
    u, v, v_c : Array, shape (n, wheels)
        Recorded command [fraction], measured and commanded speed [m/s].
    dt : float
        Step [s].
    u_max : float
        Saturation [fraction]; saturated windows are left out, for there the integral may wait.
    driving : float
        Commanded speed from which a wheel drives [m/s].

    Returns
    -------
    PiFit or None
        None where no wheel drives enough, or nothing of the three terms shows.
    """
    found = [_fit_wheel(u[:, i], v[:, i], v_c[:, i], dt, u_max, driving) for i in range(u.shape[1])]
    known = [f for f in found if f is not None]
    if not known:
        return None
    gains = np.array([g for g, _, _ in known])
    spread = np.maximum(gains.std(axis=0), np.mean([s for _, s, _ in known], axis=0))
    ff, kp, ki = (float(x) for x in gains.mean(axis=0))
    return PiFit(ff, kp, ki, tuple(float(s) for s in spread), float(min(x for *_, x in known)))  # type: ignore[arg-type]


def _fit_wheel(
    u: Array, v: Array, v_c: Array, dt: float, u_max: float, driving: float
) -> tuple[Array, Array, float] | None:
    """Gains, their spread over parts of the mission, and the share explained."""
    places = spread_windows(u.size, max(_LEAST_LENGTH, round(_PI_S / dt)))
    u, v, v_c = (np.asarray(x[places]) for x in (u, v, v_c))
    e = v - v_c
    moving = (np.abs(v_c) > driving).all(axis=1) & (np.abs(np.sign(v_c).sum(axis=1)) == v_c.shape[1])
    good = _free(u, u_max) & np.isfinite(e).all(axis=1) & moving
    if np.count_nonzero(good) < _LEAST_WINDOWS:
        return None
    u, v_c, e = u[good], v_c[good], e[good]
    integral = (np.cumsum(e, axis=1) - 0.5 * e) * dt
    x = np.stack([v_c, -e, -integral], axis=2)
    beta, explained, xx, xy = _projected(x, u, np.ones((u.shape[0], 1, u.shape[1])))
    whole = [xx.sum(axis=0), xy.sum(axis=0)]
    parts = np.array_split(np.arange(len(u)), _PARTS)
    left_out = np.array([_solve(whole[0] - xx[p].sum(axis=0), whole[1] - xy[p].sum(axis=0)) for p in parts])
    spread = np.sqrt((_PARTS - 1) / _PARTS * ((left_out - left_out.mean(axis=0)) ** 2).sum(axis=0))
    return beta, spread, explained


def _free(u: Array, u_max: float) -> NDArray[np.bool_]:
    """Windows in which the command is known and never saturated."""
    return np.asarray((np.abs(u) < u_max * (1 - 1e-9)).all(axis=1))  # NaN compares false


def _projected(x: Array, y: Array, slow: Array) -> tuple[Array, float, Array, Array]:
    """Least squares of y on x with other slow parts in every window.

    Parameters
    ----------
    x : Array, shape (windows, length, terms)
        Regressors.
    y : Array, shape (windows, length)
        What they are to explain.
    slow : Array, shape (windows, parts, length)
        What is free in every window.

    Returns
    -------
    beta : Array, shape (terms,)
        Gains; 0 of what does not vary.
    explained : float
        Share of what the slow parts leave.
    xx, xy : Array, shape (windows, terms, terms), (windows, terms)
        Products of every window.
    """
    basis = np.linalg.qr(slow.transpose(0, 2, 1))[0]  # (windows, length, parts)
    x = x - basis @ (basis.transpose(0, 2, 1) @ x)
    y = y - (basis @ (basis.transpose(0, 2, 1) @ y[..., None]))[..., 0]
    xx, xy = x.transpose(0, 2, 1) @ x, (x * y[..., None]).sum(axis=1)
    beta = _solve(xx.sum(axis=0), xy.sum(axis=0))
    total = float((y * y).sum())
    rest = float(((y - x @ beta) ** 2).sum())
    return beta, max(0.0, 1.0 - rest / total) if total > 0 else 0.0, xx, xy


def _solve(xx: Array, xy: Array) -> Array:
    """Solution of scaled normal equations; of least norm where they do not fix it."""
    scale = np.sqrt(np.maximum(np.diag(xx), 1e-300))
    beta = np.linalg.lstsq(xx / np.outer(scale, scale), xy / scale, rcond=1e-10)[0]
    return np.asarray(beta / scale)
