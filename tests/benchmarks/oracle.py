"""Likelihood of each pair of rows for one stretch of one wheel, by an oracle that knows plant and ground (see `bound`)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

A = NDArray[np.float64]

ROWS = ("healthy", "stuck", "no_signal", "inefficient", "noisy")
# Ranges from which the scenarios draw their faults (`replay.simulation.schedule.draw_fault`).
EPSILON, STUCK_VALVE = (0.25, 0.75), (0.04, 0.14)
NOISY_DELTA, NOISY_MEAN, NOISY_SPREAD, NOISY_TAU = (0.5, 0.75), (-0.05, 0.05), (0.015, 0.1), 0.05
DISTURBED_EPSILON, DISTURBED_SAT, DISTURBED_STD, DISTURBED_TAU = (0.3, 0.5), (0.05, 0.12), (0.05, 0.12), 0.8
# Prior of a stretch: healthy, one row of one side, one of both.
LOG_PRIOR = (np.log(0.5), np.log(0.5 * 6 / 7 / 8), np.log(0.5 / 7 / 16))


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
def trajectories(v0, epsilon, sat, w):  # type: ignore[no-untyped-def]
    """τ v̇ = −v + flow(u_v) − droop·F with u_v = (1−ε)u + ε·sat, shape (hypotheses, n)."""
    out = np.empty((epsilon.size, w.u.size))
    for g in range(epsilon.size):
        v = v0
        for k in range(w.u.size):
            out[g, k] = v
            flow, _ = _flow(k, (1.0 - epsilon[g]) * w.u[k] + epsilon[g] * sat[g], w)
            force, _ = _force(k, v, w)
            v += w.dt / w.tau * (flow - v - w.droop * force)
    return out


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

    def cost(self, parameters: int) -> float:
        return 0.5 * parameters * float(np.log(self.y.size))

    def pairs(self) -> Iterator[tuple[str, str, float]]:
        """Every pair of rows with the logarithm of its probability, up to a constant."""
        n, cell = self.y.size, float(np.log(self.lsb))
        if np.ptp(self.y) == 0.0:
            silent = self.y[0] == 0.0
            yield ("no_signal" if silent else "stuck"), "healthy", LOG_PRIOR[1] + (0.0 if silent else cell)
            return  # noise above the resolution: no other row gives one value for long
        for actuator in ROWS:
            for sensor in ("healthy", "inefficient", "noisy"):
                sides = (sensor != "healthy") + (actuator != "healthy")
                fit = self.with_disturbance(sensor) if actuator == "noisy" else self.best(sensor, actuator)
                yield sensor, actuator, fit + n * cell + LOG_PRIOR[sides]

    def best(self, sensor: str, actuator: str) -> float:
        """Largest log likelihood over the actuator row's parameter, found by three ever finer grids."""
        if actuator in ("healthy", "no_signal"):
            return self.grid(sensor, np.array([float(actuator == "no_signal")]), np.zeros(1))[0]
        ranges = [EPSILON] if actuator == "inefficient" else [STUCK_VALVE, (-STUCK_VALVE[1], -STUCK_VALVE[0])]
        found = -np.inf
        for low, high in ranges:
            a, b = low, high
            for _ in range(3):
                x = np.linspace(a, b, 9)
                weak = actuator == "inefficient"
                fits = self.grid(sensor, x if weak else np.ones(9), np.zeros(9) if weak else x)
                i = int(np.argmax(fits))
                found = max(found, fits[i])
                a, b = max(low, x[i] - (b - a) / 8), min(high, x[i] + (b - a) / 8)
        return found - self.cost(1)

    def grid(self, sensor: str, epsilon: A, sat: A) -> list[float]:
        """Log likelihood of a sensor row for each hypothesis of the valve."""
        return [getattr(self, sensor)(v) for v in trajectories(self.v0, epsilon, sat, self.world)]

    def gauss(self, squares: float, variance: float) -> float:
        return float(-0.5 * (squares / variance + self.y.size * np.log(2 * np.pi * variance)))

    def healthy(self, v: A) -> float:
        return self.gauss(float(np.sum((self.y - v) ** 2)), self.white(1.0))

    def inefficient(self, v: A) -> float:
        delta = float(np.clip((self.y @ v) / max(v @ v, 1e-12), *(1.0 - np.array(EPSILON[::-1]))))
        return self.gauss(float(np.sum((self.y - delta * v) ** 2)), self.white(delta)) - self.cost(1)

    def noisy(self, v: A) -> float:
        """White or correlated noise about δv + m; the spread of its correlated part from a grid, then refined."""
        return max(self.noise_of(v)[0], self.noise_of(v, 0.0)[0]) - self.cost(3)

    def noise_of(self, v: A, tau: float = NOISY_TAU) -> tuple[float, float, float, float]:
        """Log likelihood, δ, m and spread of the best noise with a correlation time."""
        a = float(np.exp(-self.world.dt / tau)) if tau else 0.0
        best: tuple[float, float, float, float] = (-np.inf, 0.62, 0.0, 0.05)
        for factor in (0.0, 1.25, 1.12, 1.05):
            around = (best[3] / max(factor, 1.0), best[3] * factor)
            for spread in np.clip(around, *NOISY_SPREAD) if factor else np.geomspace(*NOISY_SPREAD, 5):
                moments, log_s = _innovations(self.y, v, a, spread, self.white(best[1]))
                delta, mean = _two(moments)
                x = np.array([1.0, -delta, -mean])
                fit = -0.5 * float(x @ moments @ x + log_s + self.y.size * np.log(2 * np.pi))
                best = max(best, (fit, delta, mean, float(spread)))
        return best

    def with_disturbance(self, sensor: str) -> float:
        """Largest log likelihood under a disturbed valve, by a search that narrows around the best point."""
        rng = np.random.default_rng(self.y.size)
        healthy = trajectories(self.v0, np.zeros(1), np.zeros(1), self.world)[0]
        tau, spread = 0.0, 0.0
        if sensor == "noisy":
            (white_fit, *_), (slow_fit, _, _, slow) = self.noise_of(healthy, 0.0), self.noise_of(healthy)
            tau, spread = (NOISY_TAU, slow) if slow_fit > white_fit else (0.0, self.noise_of(healthy, 0.0)[3])
        ranges = np.array([DISTURBED_EPSILON, DISTURBED_SAT, DISTURBED_STD, (1.0, 1.0), (0.0, 0.0), (spread, spread)])
        if sensor == "inefficient":
            ranges[3] = 1.0 - np.array(EPSILON[::-1])
        elif sensor == "noisy":
            ranges[3:5] = NOISY_DELTA, NOISY_MEAN
            ranges[5] = np.clip([0.7 * spread, 1.3 * spread], *NOISY_SPREAD)
        found = -np.inf
        for sign in (-1.0, 1.0):
            middle, width, best = ranges.mean(axis=1), ranges[:, 1] - ranges[:, 0], -np.inf
            for _ in range(3):
                points = np.vstack([middle, middle + width * rng.uniform(-0.5, 0.5, (9, 6))])
                for x in np.clip(points, ranges[:, 0], ranges[:, 1]):
                    fit = self.filtered(x, sign, tau)
                    if fit > best:
                        best, middle = fit, x
                width = 0.5 * width
            found = max(found, best)
        return found - self.cost(3 + {"healthy": 0, "inefficient": 1, "noisy": 3}[sensor])

    def filtered(self, x: A, sign: float, tau: float) -> float:
        epsilon, sat, std, delta, mean, spread = (float(value) for value in x)
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
