"""A straight line through estimates with bounds of their own: random-effects regression on one covariate.

Model: ε̂_i = a + b·(x_i − x̄) + u_i + e_i, with e_i ~ N(0, σ_i²) from the mission's own bounds and u_i ~ N(0, τ²) for what
differs from mission to mission (load, ground, temperature). τ² solves Σ r_i²/(σ_i² + τ²) = n − 2 (Paule and Mandel, 1982);
coefficients are those of weighted least squares with w_i = 1/(σ_i² + τ²), their variances are multiplied by
q = max(1, Σ w_i r_i²/(n − 2)) and judged by Student's t with n − 2 degrees of freedom (Knapp and Hartung, Statistics in
Medicine 22, 2003). Centred at the weighted mean x̄ the two coefficients are uncorrelated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

Array = NDArray[np.float64]

LEAST_SIGMA = 1e-4
_STEPS = 30


@dataclass(frozen=True)
class Line:
    """A fitted line and what it does not know.

    Attributes
    ----------
    centre : float
        x̄, unit of x.
    level, slope : float
        a [1], and b per unit of x.
    level_var, slope_var : float
        Their variances.
    tau : float
        Spread from mission to mission beyond the missions' own bounds [1].
    dof : int
        Degrees of freedom.
    """

    centre: float
    level: float
    slope: float
    level_var: float
    slope_var: float
    tau: float
    dof: int

    def at(self, x: float) -> float:
        """Line at a place. x in hours or days, the value in the trend's unit [1 for ε]."""
        return self.level + self.slope * (x - self.centre)

    def half(self, x: float, confidence: float) -> float:
        """Half width of the two-sided confidence interval of the line at a place.

        x in hours or days, the width in the trend's unit [1 for ε].
        """
        return self.quantile(confidence) * math.sqrt(self.level_var + self.slope_var * (x - self.centre) ** 2)

    def quantile(self, confidence: float) -> float:
        """Factor of the standard error for a two-sided interval. Both without a unit [1]."""
        return float(stdtrit(self.dof, 0.5 + confidence / 2))

    def crossing(self, limit: float, start: float, confidence: float) -> tuple[float, float, float]:
        """Where the line reaches a limit from below, at `start` or later.

        Fieller's interval (Journal of the Royal Statistical Society B 16, 1954): the places at which a test at level
        1 − confidence does not reject "the line is at the limit here".

        Returns
        -------
        tuple[float, float, float]
            Soonest, likely and latest place; ``inf`` where the upper bound, the line or the lower bound never gets there.
        """
        t2 = self.quantile(confidence) ** 2
        gap, begin = self.level - limit, start - self.centre
        a = self.slope**2 - t2 * self.slope_var
        b, c = 2 * self.slope * gap, gap**2 - t2 * self.level_var
        roots = [r for r in _roots(a, b, c) if r > begin]
        above = [gap + self.slope * r > 0 for r in roots]
        now, half = self.at(start), self.half(start, confidence)
        soonest = start if now + half >= limit else self._first(roots, above, False)
        latest = start if now - half >= limit else self._first(roots, above, True)
        likely = start if now >= limit else math.inf
        if now < limit and self.slope > 0:
            likely = self.centre - gap / self.slope
        return soonest, likely, latest

    def _first(self, roots: list[float], above: list[bool], wanted: bool) -> float:
        return min((self.centre + r for r, a in zip(roots, above, strict=True) if a is wanted), default=math.inf)


def _roots(a: float, b: float, c: float) -> list[float]:
    """Real roots of a·d² + b·d + c, without cancellation."""
    inside = b * b - 4 * a * c
    if inside < 0 or (a == 0 and b == 0):
        return []
    q = -0.5 * (b + math.copysign(math.sqrt(inside), b))
    return [p / r for p, r in ((q, a), (c, q)) if r != 0]


def sigmas(value: Array, low: Array, high: Array) -> Array:
    """Standard errors behind 95 % bounds; the wider half counts, so that a bound cut at 0 or 1 hides nothing.

    All of shape (m,), in the unit of the values.
    """
    return np.asarray(np.maximum(np.maximum(high - value, value - low) / 1.959963984540054, LEAST_SIGMA))


def sums(x: Array, y: Array, w: Array) -> tuple[float, float, float, float, Array]:
    """Weighted x̄, a, b, Sxx and residuals of the least-squares line. x, y, w and the residuals of shape (m,)."""
    total = float(w.sum())
    centre = float(w @ x) / total
    d = x - centre
    sxx = float(w @ (d * d))
    level = float(w @ y) / total
    slope = float(w @ (d * y)) / sxx
    return centre, level, slope, sxx, y - level - slope * d


def between(x: Array, y: Array, variance: Array) -> float:
    """τ² by Paule and Mandel; 0 where the missions' own bounds explain the scatter.

    All of shape (m,); the result in the unit of `variance`.
    """
    tau2, dof = 0.0, len(x) - 2
    for _ in range(_STEPS):  # Newton from below on a convex function: never passes the root
        w = 1.0 / (variance + tau2)
        r2 = sums(x, y, w)[4] ** 2
        excess = float(w @ r2) - dof
        if excess <= 1e-6 * dof:
            break
        tau2 += excess / float((w * w) @ r2)
    return tau2


class Weighted(NamedTuple):
    """Weights and the line through them: τ², w, x̄, a, b, Sxx, residuals, and Σ w r²."""

    tau2: float
    w: Array
    centre: float
    level: float
    slope: float
    sxx: float
    rest: Array
    whole: float


def weighted(x: Array, y: Array, sigma: Array) -> Weighted:
    """Find τ², and the line with the weights that it gives; x must vary. All of shape (m,)."""
    variance = sigma * sigma
    tau2 = between(x, y, variance)
    w = 1.0 / (variance + tau2)
    centre, level, slope, sxx, rest = sums(x, y, w)
    return Weighted(tau2, w, centre, level, slope, sxx, rest, float(w @ (rest * rest)))


def fit_line(x: Array, y: Array, sigma: Array, known: Weighted | None = None) -> Line:
    """Fit the line of the module's description.

    Parameters
    ----------
    x : Array, shape (n,)
        Covariate; at least three values, not all equal.
    y, sigma : Array, shape (n,)
        Estimates and their standard errors, same unit.
    known : Weighted or None
        From `weighted`, where that was asked for already.

    Raises
    ------
    ValueError
        Where there are too few values or x does not vary.
    """
    if len(x) < 3 or not varies(x):
        raise ValueError(f"a line with a spread needs three values at different places, not {len(x)}")
    of = known or weighted(x, y, sigma)
    dof = len(x) - 2
    q = max(1.0, of.whole / dof)
    return Line(of.centre, of.level, of.slope, q / float(of.w.sum()), q / of.sxx, math.sqrt(of.tau2), dof)


def varies(x: Array) -> bool:
    """Whether not all places are the same; they are in order. `x` of shape (m,)."""
    return float(x[-1]) > float(x[0])
