"""Likelihood of each pair of rows for one stretch of one wheel, by an oracle that knows plant and ground (see `bound`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import minimize

A = NDArray[np.float64]

ROWS = ("healthy", "stuck", "no_signal", "inefficient", "noisy")
# Ranges from which the scenarios draw their faults (`replay.simulation.schedule.draw_fault`).
EPSILON, STUCK_VALVE = (0.25, 0.75), (0.04, 0.14)
NOISY_DELTA, NOISY_MEAN, NOISY_SPREAD, NOISY_TAU = (0.5, 0.75), (-0.05, 0.05), (0.015, 0.1), 0.05
DISTURBED_EPSILON, DISTURBED_SAT, DISTURBED_STD, DISTURBED_TAU = (0.3, 0.5), (0.05, 0.12), (0.05, 0.12), 0.8
# Prior of a stretch: healthy, one row of one side, one of both.
LOG_PRIOR = (np.log(0.5), np.log(0.5 * 6 / 7 / 8), np.log(0.5 / 7 / 16))
HOPELESS = 5.0  # a search gains less than this per sample in log likelihood over its first guess

Noise = tuple[float, float, float, float]


class World(NamedTuple):
    """What the oracle knows of one wheel: constants, and signals of shape (n,)."""

    dt: float
    K: float
    tau: float
    droop: float
    pump: float
    u: A
    others: A  # flow that the other valves ask for [m/s]
    most: A  # largest tyre force [N]; 0 where `force` holds all of it
    stiffness: A  # tyre force per slip speed [N s/m]
    ground: A  # speed at which the tyre does not slip [m/s]
    force: A  # force that depends on no hypothesis [N]


SIGNALS = ("u", "others", "most", "stiffness", "ground", "force")


@njit(cache=True)
def _flow(k, u, w):  # type: ignore[no-untyped-def]
    """Steady speed K·u under the shared pump, and its derivative by u."""
    demand = w.others[k] + abs(w.K * u)
    if demand <= w.pump:
        return w.K * u, w.K
    return w.pump / demand * w.K * u, w.pump * w.K * w.others[k] / demand**2


@njit(cache=True)
def _force(k, v, w):  # type: ignore[no-untyped-def]
    """Force at the rim and its derivative by the wheel's speed."""
    if w.most[k] == 0.0:
        return w.force[k], 0.0
    x = np.tanh(w.stiffness[k] * (v - w.ground[k]) / w.most[k])
    return w.force[k] + w.most[k] * x, w.stiffness[k] * (1.0 - x * x)


@njit(cache=True)
def trajectory(v0, epsilon, sat, w):  # type: ignore[no-untyped-def]
    """τ v̇ = −v + flow(u_v) − droop·F with u_v = (1−ε)u + ε·sat, shape (n,)."""
    out, v = np.empty(w.u.size), v0
    for k in range(w.u.size):
        out[k] = v
        flow, _ = _flow(k, (1.0 - epsilon) * w.u[k] + epsilon * sat, w)
        force, _ = _force(k, v, w)
        v += w.dt / w.tau * (flow - v - w.droop * force)
    return out


def peak(function: Callable[[float], float], low: float, high: float, count: int = 9) -> tuple[float, float]:
    """Place and height of a function's peak: the best point of a grid, then parabolas through three points."""
    x = np.linspace(low, high, count)
    found = {float(a): function(float(a)) for a in x}
    step = float(x[1] - x[0])
    for _ in range(3):
        best = max(found, key=found.__getitem__)
        before = max((y for y in found if y < best), default=None)
        after = min((y for y in found if y > best), default=None)
        if before is None or after is None:
            place = best
        else:
            place = best + _vertex(before - best, after - best, found[before] - found[best], found[after] - found[best])
        step /= 6.0
        for a in np.clip([place - step, place, place + step], low, high):
            found.setdefault(float(a), function(float(a)))
    best = max(found, key=found.__getitem__)
    return best, found[best]


def _vertex(a: float, b: float, f_a: float, f_b: float) -> float:
    """Where the parabola through (a, f_a), (0, 0), (b, f_b) is highest, a < 0 < b."""
    bend = (f_a / a - f_b / b) / (a - b)
    return float(np.clip(-(f_a / a - bend * a) / (2 * bend), a, b)) if bend < 0 else 0.0


@njit(cache=True)
def _innovations(y, v, a, spread, white):  # type: ignore[no-untyped-def]
    """Moments of the whitened series y, v and 1 for noise AR(1) of std `spread` in white noise; and Σ log S."""
    moments, log_s = np.zeros((3, 3)), 0.0
    x, p = np.zeros(3), spread * spread
    e = np.empty(3)
    for k in range(y.size):
        s = p + white
        e[0], e[1], e[2] = y[k] - x[0], v[k] - x[1], 1.0 - x[2]
        log_s += np.log(s)
        for i in range(3):
            x[i] = a * (x[i] + p / s * e[i])
            for j in range(3):
                moments[i, j] += e[i] * e[j] / s
        p = a * a * p * white / s + (1.0 - a * a) * spread * spread
    return moments, log_s


@njit(cache=True)
def disturbed(y, v0, epsilon, sat, std, a, delta, mean, spread, b, white, w):  # type: ignore[no-untyped-def]
    """Log likelihood of y = δv + m + x_s + noise under a disturbed valve: a Kalman filter of v, x_u and x_s."""
    m, h, ph, f = np.array([v0, 0.0, 0.0]), np.array([delta, 0.0, 1.0]), np.zeros(3), np.zeros((3, 3))
    p, fp = np.diag(np.array([0.0, 1.0, spread * spread])), np.zeros((3, 3))
    f[1, 1], f[2, 2] = a, b
    total = 0.0
    for k in range(y.size):
        s, e = white, y[k] - mean
        for i in range(3):
            ph[i] = p[i, 0] * h[0] + p[i, 2] * h[2]
            e -= h[i] * m[i]
            s += h[i] * ph[i]
        total -= 0.5 * (e * e / s + np.log(2 * np.pi * s))
        for i in range(3):
            m[i] += ph[i] / s * e
            for j in range(3):
                p[i, j] -= ph[i] * ph[j] / s
        flow, slope = _flow(k, (1.0 - epsilon) * w.u[k] + epsilon * (sat + std * m[1]), w)
        force, grip = _force(k, m[0], w)
        f[0, 0], f[0, 1] = 1.0 - w.dt / w.tau * (1.0 + w.droop * grip), w.dt / w.tau * slope * epsilon * std
        m[0] += w.dt / w.tau * (flow - m[0] - w.droop * force)
        m[1] *= a
        m[2] *= b
        for i in range(3):
            for j in range(3):
                fp[i, j] = f[i, 0] * p[0, j] + f[i, 1] * p[1, j] + f[i, 2] * p[2, j]
        for i in range(3):
            for j in range(3):
                p[i, j] = fp[i, 0] * f[j, 0] + fp[i, 1] * f[j, 1] + fp[i, 2] * f[j, 2]
        p[1, 1] += 1.0 - a * a
        p[2, 2] += (1.0 - b * b) * spread * spread
    return total


@dataclass(frozen=True)
class Oracle:
    """Likelihood of one stretch of one wheel: measured speed y, speed at its begin, sensor noise and resolution."""

    y: A
    v0: float
    std: float
    lsb: float
    world: World

    def white(self, delta: float) -> float:
        """Variance of what is white in y: noise before the fault, and quantisation."""
        return (delta * self.std) ** 2 + self.lsb**2 / 12

    def cost(self, parameters: int, tau: float = 0.0) -> float:
        """Price of parameters that noise with a correlation time leaves uncertain: ½ log of its independent samples."""
        return 0.5 * parameters * float(np.log(max(1.0, self.y.size * min(1.0, self.world.dt / max(tau, 1e-9)))))

    def pairs(self) -> Iterator[tuple[str, str, float]]:
        """Every pair of rows with the logarithm of its probability, up to a constant."""
        n, cell = self.y.size, float(np.log(self.lsb))
        if np.ptp(self.y) == 0.0:
            silent = self.y[0] == 0.0
            yield ("no_signal" if silent else "stuck"), "healthy", LOG_PRIOR[1] + (0.0 if silent else cell)
            return  # noise above the resolution: no other row gives one value for long
        found = {
            (sensor, actuator): self.best(sensor, actuator)
            for sensor, actuator in product(("healthy", "inefficient", "noisy"), ROWS)
            if actuator != "noisy"
        }
        for sensor in ("healthy", "inefficient", "noisy"):
            found[sensor, "noisy"] = self.with_disturbance(sensor, max(found.values()) - HOPELESS * n)
        for (sensor, actuator), fit in found.items():
            yield sensor, actuator, fit + n * cell + LOG_PRIOR[(sensor != "healthy") + (actuator != "healthy")]

    def best(self, sensor: str, actuator: str) -> float:
        """Largest log likelihood over the actuator row's parameter."""

        def fit(epsilon: float, sat: float) -> float:
            v = trajectory(self.v0, epsilon, sat, self.world)
            return float(getattr(self, sensor)(v))

        if actuator in ("healthy", "no_signal"):
            return fit(float(actuator == "no_signal"), 0.0)
        if actuator == "inefficient":
            return peak(lambda x: fit(x, 0.0), *EPSILON)[1] - self.cost(1)
        low, high = STUCK_VALVE
        return max(peak(lambda x: fit(1.0, x), *r)[1] for r in ((low, high), (-high, -low))) - self.cost(1)

    def gauss(self, squares: float, variance: float) -> float:
        return float(-0.5 * (squares / variance + self.y.size * np.log(2 * np.pi * variance)))

    def healthy(self, v: A) -> float:
        return self.gauss(float(np.sum((self.y - v) ** 2)), self.white(1.0))

    def inefficient(self, v: A) -> float:
        delta = float(np.clip(float(self.y @ v) / max(float(v @ v), 1e-12), *(1.0 - np.array(EPSILON[::-1]))))
        return self.gauss(float(np.sum((self.y - delta * v) ** 2)), self.white(delta)) - self.cost(1)

    def noisy(self, v: A) -> float:
        """White or correlated noise about δv + m; the spread of its correlated part from a grid, then refined."""
        return max(self.correlated(v)[0] - self.cost(3, NOISY_TAU), self.uncorrelated(v)[0] - self.cost(3))

    def uncorrelated(self, v: A) -> Noise:
        """Log likelihood, δ, m and spread of the best white noise."""
        one = np.ones_like(v)
        delta, mean = _two(np.array([[a @ b for b in (self.y, v, one)] for a in (self.y, v, one)]))
        rest = self.y - delta * v - mean
        spread = float(np.sqrt(max(float(np.mean(rest**2)) - self.white(delta), 0.0)))
        spread = float(np.clip(spread, *NOISY_SPREAD))
        return self.gauss(float(rest @ rest), self.white(delta) + spread**2), delta, mean, spread

    def correlated(self, v: A) -> Noise:
        """The same of the best noise with the correlation time of the scenarios."""
        a = float(np.exp(-self.world.dt / NOISY_TAU))
        white = self.white(float(np.mean(NOISY_DELTA)))

        def fit(log_spread: float) -> Noise:
            spread = float(np.exp(log_spread))
            moments, log_s = _innovations(self.y, v, a, spread, white)
            delta, mean = _two(moments)
            x = np.array([1.0, -delta, -mean])
            total = -0.5 * float(x @ moments @ x + log_s + self.y.size * np.log(2 * np.pi))
            return total, delta, mean, spread

        return fit(peak(lambda x: fit(x)[0], float(np.log(NOISY_SPREAD[0])), float(np.log(NOISY_SPREAD[1])), 5)[0])

    def with_disturbance(self, sensor: str, hopeless: float) -> float:
        """Largest log likelihood under a disturbed valve; not searched where the first guess falls below `hopeless`."""
        healthy = trajectory(self.v0, 0.0, 0.0, self.world)
        middle = [float(np.mean(r)) for r in (DISTURBED_EPSILON, DISTURBED_SAT, DISTURBED_STD)]
        ranges, start, tau = [DISTURBED_EPSILON, DISTURBED_SAT, DISTURBED_STD], middle, 0.0
        if sensor == "inefficient":
            limits = (1.0 - EPSILON[1], 1.0 - EPSILON[0])
            ranges, start = [*ranges, limits], [*start, float(np.clip(self.y @ healthy / (healthy @ healthy), *limits))]
        elif sensor == "noisy":
            white, slow = self.uncorrelated(healthy), self.correlated(healthy)
            tau = NOISY_TAU if slow[0] > white[0] else 0.0
            ranges, start = [*ranges, NOISY_DELTA, NOISY_MEAN, NOISY_SPREAD], [*start, *max(white, slow)[1:]]
        low, high = np.array(ranges).T

        def fit(x: A, sign: float) -> float:
            inside = low + np.clip(x, 0.0, 1.0) * (high - low)
            return self.filtered(inside, sign, tau)

        first = (np.array(start) - low) / (high - low)
        sign = max((-1.0, 1.0), key=lambda s: fit(first, s))
        best = fit(first, sign)
        if best > hopeless:
            # Steps towards the middle of the range, so that every corner of the first simplex differs.
            corners = np.vstack([first, first + np.diag(np.where(first > 0.5, -0.3, 0.3))])
            options = {"maxfev": 35 * first.size, "initial_simplex": corners, "fatol": 0.3, "xatol": 1e-3}
            best = -float(minimize(lambda x: -fit(x, sign), first, method="Nelder-Mead", options=options).fun)
        return best - self.cost(3, DISTURBED_TAU) - self.cost(len(ranges) - 3, tau)

    def filtered(self, x: A, sign: float, tau: float) -> float:
        epsilon, sat, std, delta, mean, spread = (*(float(value) for value in x), *(1.0, 0.0, 0.0)[x.size - 3 :])
        dt, white = self.world.dt, self.white(delta) + (0.0 if tau else spread**2)
        a, b = float(np.exp(-dt / DISTURBED_TAU)), float(np.exp(-dt / tau)) if tau else 0.0
        slow = spread if tau else 0.0
        return float(disturbed(self.y, self.v0, epsilon, sign * sat, std, a, delta, mean, slow, b, white, self.world))


def _two(moments: A) -> tuple[float, float]:
    """δ and m of least squares within their ranges, from the moments of y, v and 1."""
    delta, mean = np.linalg.lstsq(moments[1:, 1:], moments[1:, 0], rcond=1e-9)[0]
    delta = float(np.clip(delta, *NOISY_DELTA))
    mean = float(np.clip((moments[2, 0] - delta * moments[2, 1]) / moments[2, 2], *NOISY_MEAN))
    return float(np.clip((moments[1, 0] - mean * moments[1, 2]) / max(moments[1, 1], 1e-12), *NOISY_DELTA)), mean
