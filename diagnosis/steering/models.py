"""What is known of one steering axle: plant, sensor noise and model error, from which the constants of its filters follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from diagnosis.steering.blocks import WHITE_DOF, SensorNoise, SteeringBlocks
from diagnosis.steering.filter_constants import AxleConstants, FilterConstants, SensorConstants
from diagnosis.steering.plant import SteeringPlant
from diagnosis.steering.valve_map import rates_at
from diagnosis.steering.windows import windows_of
from replay.arrays.quantiles import median_of, quantile_of

_MEAN_HEALTHY_S = 60.0
_RATE_ERROR_S = 1.0
_LAG_ERROR = 0.5  # noise of a rate whose sum over a change is as large as what a wrong lag makes of it
_STOP_SHARE, _REST_S = 0.02, 0.1  # how far from the given stop it may be, relative to it; how long an axle rests there
_DISTURBANCE_S = 0.8  # how fast a valve's disturbance and a sensor's slow noise change
_COLOURED_S = 0.08  # how fast a sensor's coloured noise changes
_IDLE_ERRORS, _IDLE_JITTER = (
    5.0,
    3.0,
)  # errors of the rate, and changes from block to block, that ask nothing of a valve
_HIDDEN_DOF = 0.02  # degrees of freedom per sample of a white part that rounding hides


@dataclass(frozen=True)
class SteeringModel:
    """What is known of one axle, from which the constants of its filters follow.

    Attributes
    ----------
    plant : SteeringPlant
        Valve and cylinder.
    noise : SensorNoise
        Of the angle.
    stop : float
        Angle of the end stops [rad].
    rate_error : float
        Standard deviation of the rate's error [rad/s].
    count : float
        Samples in a usual block.
    dt : float
        Length of a block [s].
    redundant : bool
        Whether anything is measured redundantly.
    idle_rate : float
        Commanded rate up to which nothing is asked of the valve [rad/s].
    stops : tuple[float, float]
        What the sensor reads at the lower and the upper one [rad].
    opening_measured : bool
        Whether the valve's opening is.
    lag_spread : float
        Standard deviation of the lag from motion to motion, relative to it [1].
    """

    plant: SteeringPlant
    noise: SensorNoise
    stop: float
    rate_error: float
    count: float
    dt: float
    redundant: bool
    idle_rate: float
    stops: tuple[float, float]
    opening_measured: bool = False
    lag_spread: float = 0.1

    @property
    def switch_cost(self) -> float:
        """Minus the log-probability that a row is entered in a block."""
        return float(np.log(_MEAN_HEALTHY_S / self.dt * 8))

    @property
    def mean_rounding(self) -> float:
        """What rounding leaves in the mean of a block: (q²/2π²)·exp(−4π²σ²/q²) where noise evens it out [rad²]."""
        noise = self.noise
        even = np.exp(-4 * np.pi**2 * (noise.std / noise.lsb) ** 2) if noise.lsb > 0 else 0.0
        rounding = noise.lsb**2 / (2 * np.pi**2) * even if noise.resolved else noise.step
        return float(rounding + (1e-7 * self.stop) ** 2)

    @property
    def block_variance(self) -> float:
        """Variance of a block's mean by the healthy sensor's noise [rad²]."""
        return self.noise.white / self.count + self.mean_rounding

    @property
    def rest_variance(self) -> float:
        """Variance of a healthy axle's angle at rest, before a block is measured [rad²]."""
        r = self.block_variance
        f = np.array([[1.0, self.dt], [0.0, np.exp(-self.dt / _RATE_ERROR_S)]])
        q = np.diag([0.0, (1 - f[1, 1] ** 2) * self.rate_error**2])
        p = np.diag([r, self.rate_error**2])
        for _ in range(200):  # Riccati recursion to its steady state
            p = f @ p @ f.T + q
            p -= np.outer(p[:, 0], p[0]) / (p[0, 0] + r)
        return float((f @ p @ f.T + q)[0, 0])

    @property
    def rest_cost(self) -> float:
        """What a healthy axle at rest loses per block, by its freedom, on a constant reading; and a little more.

        A constant reading must gain as much to be taken for a stuck sensor where rounding hides the noise.

        A difference of log-likelihoods [1].
        """
        return float(0.5 * np.log(1 + self.rest_variance / self.block_variance) + 0.03)

    def constants(self) -> FilterConstants:
        """Constants of the compiled filters."""
        resolved = bool(self.noise.resolved)
        return FilterConstants(
            axle=self._axle(),
            sensor=self._sensor(),
            switch_cost=self.switch_cost,
            freedom_cost=0.5 * self.dt if resolved else 0.03,
            idle_variance=1.5 * self.rest_variance,
            redundant=self.redundant,
        )

    def _axle(self) -> AxleConstants:
        plant, noise = self.plant, self.noise
        lag = max(plant.lag, 1e-4)
        return AxleConstants(
            dt=self.dt,
            valve=plant.valve,
            gain=plant.gain,
            rate_limit=plant.rate,
            play=plant.play if plant.play > 0.3 * self.noise.std else 0.0,
            lag=lag,
            rate_decay=float(np.exp(-self.dt / lag)),
            lag_error=_LAG_ERROR * float(np.hypot(self.lag_spread, plant.lag_std) * np.sqrt(lag / self.dt)),
            stop=self.stop,
            stop_up=self.stops[1],
            stop_down=self.stops[0],
            rate_error=self.rate_error,
            rate_error_decay=float(np.exp(-self.dt / _RATE_ERROR_S)),
            rate_error_s=_RATE_ERROR_S,
            idle_rate=self.idle_rate,
            opening_measured=self.opening_measured,
            angle_variance=(0.1 * self.rate_error * self.dt) ** 2,
            stop_variance=self.mean_rounding + 0.01 * noise.white,
            disturbance_decay=float(np.exp(-self.dt / _DISTURBANCE_S)),
        )

    def _sensor(self) -> SensorConstants:
        noise = self.noise
        resolved = bool(noise.resolved)
        return SensorConstants(
            white=noise.white,
            white_spread=noise.spread,
            white_dof=WHITE_DOF if resolved else _HIDDEN_DOF,
            constant=max(noise.step / 4, noise.white / 2500),
            rounding=noise.step,
            mean_rounding=self.mean_rounding,
            resolved=resolved,
            rest_cost=self.rest_cost,
            coloured_decay=float(np.exp(-self.dt / _COLOURED_S)),
        )


def model_of(
    blocks: SteeringBlocks, plant: SteeringPlant, noise: SensorNoise, stop: float, lag_spread: float = 0.1
) -> SteeringModel:
    """Constants of an axle's filters; the rate's error comes from windows in which nothing is steered.

    Parameters
    ----------
    blocks : SteeringBlocks
        The axle.
    plant : SteeringPlant
        Valve and cylinder.
    noise : SensorNoise
        Of the angle.
    stop : float
        Angle of the end stops [rad].
    lag_spread : float
        As of `SteeringModel`.
    """
    windows = windows_of(blocks, noise, stop, 0.5)
    predicted = windows.predicted(plant.valve, plant.lag, plant.play)
    residual = np.abs(windows.rate - predicted)[windows.good & (np.abs(predicted) < 0.05 * plant.rate)]
    error = 0.0
    if residual.size >= 8:
        error = float(np.sqrt(max((quantile_of(residual, 0.4) / 0.524) ** 2 - windows.noise**2, 0.0)))
    known = blocks.count[blocks.count > 0]
    count = float(median_of(known)) if known.size else 1.0
    redundant = bool(blocks.redundancy.known.any())
    measured = bool(np.isfinite(blocks.redundancy.opening).any())
    error = max(error, 5e-4 * plant.rate)
    jitter = float(median_of(np.abs(np.diff(rates_at(blocks.u, plant.valve))))) if blocks.u.size > 1 else 0.0
    idle = max(_IDLE_ERRORS * error, _IDLE_JITTER * jitter)
    return SteeringModel(
        plant, noise, stop, error, count, blocks.dt, redundant, idle, _stops(blocks, noise, stop), measured, lag_spread
    )


def _stops(blocks: SteeringBlocks, noise: SensorNoise, stop: float) -> tuple[float, float]:
    """What the sensor reads at the end stops [rad]: where the axle rests next to them, else what the machine file says."""
    usual = blocks.mean[(blocks.count > 0) & (blocks.power > 0.1 * noise.white) & (blocks.power < 10 * noise.white)]
    out = []
    for side in (-1.0, 1.0):
        near = side * usual
        near = near[np.abs(near / stop - 1) < _STOP_SHARE]
        resting = near[near > near.max(initial=0.0) - max(4 * noise.std, noise.lsb)]
        found = float(median_of(resting)) if resting.size * blocks.dt > _REST_S else stop
        out.append(side * found)
    return out[0], out[1]
