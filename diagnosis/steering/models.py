"""Constants of the steering filters: plant, sensor noise and model error of one axle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.blocks import WHITE_DOF, SensorNoise, SteeringBlocks
from diagnosis.steering.identification import SteeringPlant, windows_of
from diagnosis.steering.step_kernel import DISTURBANCE_S, SENSOR_DRIFT_S

Array = NDArray[np.float64]

_MEAN_HEALTHY_S = 60.0
_LOAD_S = 1.0


@dataclass(frozen=True)
class SteeringModel:
    """Constants of the filters of one axle.

    Attributes
    ----------
    plant : SteeringPlant
        Valve and cylinder.
    noise : SensorNoise
        Of the angle.
    stop : float
        Angle of the end stops [rad].
    load : float
        Standard deviation of the rate's error [rad/s].
    count : float
        Samples in a usual block.
    dt : float
        Length of a block [s].
    twice : bool
        Whether something is measured twice.
    """

    plant: SteeringPlant
    noise: SensorNoise
    stop: float
    load: float
    count: float
    dt: float
    twice: bool

    @property
    def switch_cost(self) -> float:
        """Minus the log-probability that a row is entered in a block."""
        return float(np.log(_MEAN_HEALTHY_S / self.dt * 8))

    def _freedom(self, r: float) -> float:
        """What a healthy axle at rest loses per block, by its freedom, on a constant reading; and a little more.

        A constant reading must gain as much to be taken for a stuck sensor where rounding hides the noise.
        """
        f = np.array([[1.0, self.dt], [0.0, np.exp(-self.dt / _LOAD_S)]])
        q = np.diag([0.0, (1 - f[1, 1] ** 2) * self.load**2])
        p = np.diag([r, self.load**2])
        for _ in range(200):  # Riccati recursion to its steady state
            p = f @ p @ f.T + q
            p -= np.outer(p[:, 0], p[0]) / (p[0, 0] + r)
        p = f @ p @ f.T + q
        return float(0.5 * np.log(1 + p[0, 0] / r) + 0.03)

    def packed(self) -> Array:
        """Parameters in the order of the compiled scan."""
        noise = self.noise
        lag = max(self.plant.lag, 1e-4)
        # what rounding leaves in a mean that noise does not even out: (q²/2π²)·exp(−4π²σ²/q²)
        even = np.exp(-4 * np.pi**2 * (noise.std / noise.lsb) ** 2) if noise.lsb > 0 else 0.0
        rounding = noise.lsb**2 / (2 * np.pi**2) * even if noise.resolved else noise.step
        rounding += (1e-7 * self.stop) ** 2
        constant = max(noise.step / 4, noise.white / 2500)
        return np.array(
            [
                self.dt,
                np.exp(-self.dt / lag),
                self.plant.gain,
                self.plant.rate,
                self.stop,
                self.load,
                np.exp(-self.dt / _LOAD_S),
                noise.white,
                constant,
                WHITE_DOF if noise.resolved else 0.02,
                noise.spread,
                lag,
                (0.1 * self.load * self.dt) ** 2,
                rounding + 0.01 * noise.white,
                rounding,
                self.switch_cost,
                0.5 * self.dt if noise.resolved else 0.03,
                max(0.02, self.plant.misfit) ** 2,
                noise.step,
                self._freedom(noise.white / self.count + rounding),
                float(self.twice),
                np.exp(-self.dt / DISTURBANCE_S),
                np.exp(-self.dt / SENSOR_DRIFT_S),
            ]
        )


def model_of(blocks: SteeringBlocks, plant: SteeringPlant, noise: SensorNoise, stop: float) -> SteeringModel:
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
    """
    windows = windows_of(blocks, noise, stop, 0.5)
    predicted = windows.predicted(plant.gain, plant.rate, plant.lag)
    off = np.abs(windows.rate - predicted)[windows.good & (np.abs(predicted) < 0.05 * plant.rate)]
    load = 0.0
    if off.size >= 8:
        load = float(np.sqrt(max((np.quantile(off, 0.4) / 0.524) ** 2 - windows.noise**2, 0.0)))
    known = blocks.count[blocks.count > 0]
    count = float(np.median(known)) if known.size else 1.0
    twice = bool(np.isfinite(blocks.second).any())
    return SteeringModel(plant, noise, stop, max(load, 5e-4 * plant.rate), count, blocks.dt, twice)
