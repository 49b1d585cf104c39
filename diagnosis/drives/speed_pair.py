"""The measured speed of a drive beside the one that its effort implies, with the noise of this mission."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum, quiet_rms, rounding_step
from diagnosis.channels.sample_status import BLIND, PAIR, sample_status
from diagnosis.drives.inputs import DriveData
from diagnosis.drives.models import RowModel
from diagnosis.drives.path import SpeedSamples
from replay.machine.config import Limits
from replay.machine.drive_model import InverseController

Array = NDArray[np.float64]

_MEAN_HEALTHY_S = 60.0
_LEAST_CORE = 0.2
_NOISE_RANGE = (0.7, 1.5)
_QUIET = 0.4
_SLOW_S, _SLACK = 0.5, 0.03
_LEAST_NOISE = 2e-3  # of the span: no implied speed is believed beyond that


@dataclass(frozen=True)
class SpeedPair:
    """Measured speed beside the implied one.

    Attributes
    ----------
    samples : SpeedSamples
        Both speeds, and how far the implied one may be out for long.
    lead : int
        Steps by which the effort answers later than the speed.
    noise, core, lsb : float
        Healthy noise of y − x, that of its exact samples, and the rounding step of y [m/s].
    exact : float
        Share of exact samples [1].
    span : float
        Largest plausible speed [m/s].
    dt : float
        Step [s].
    name : str
        Of the speed's channel.
    """

    samples: SpeedSamples
    lead: int
    noise: float
    core: float
    exact: float
    lsb: float
    span: float
    dt: float
    name: str

    def model(self) -> RowModel:
        """Noise and prior of the path of rows."""
        return RowModel(
            noise=self.noise,
            core=max(self.core, _LEAST_CORE * self.noise),
            exact=self.exact,
            constant_noise=max(self.lsb / np.sqrt(12), self.noise / 50),
            span=self.span,
            switch_cost=float(np.log(_MEAN_HEALTHY_S / self.dt * 8)),
        )


def speed_pair(data: DriveData, controller: InverseController, x: Array, limits: Limits) -> SpeedPair:
    """Put the measured speed beside the implied one.

    Parameters
    ----------
    data : DriveData
        Channels.
    controller : InverseController
        Inverse model of the drive's controller.
    x : Array, shape (n,)
        Implied speed [m/s]; NaN where the effort implies none.
    limits : Limits
        ``driving_speed`` decides where the drive is still.
    """
    status = sample_status(data.y, x, data.y_fresh, data.alive, data.dt)
    commanded = np.isfinite(data.y) & np.isfinite(data.command) & np.isfinite(data.u)
    status[data.y_fresh & commanded & ~np.isfinite(x)] = BLIND  # the effort is at its limit
    still = _QUIET * limits.driving_speed
    quiet = (np.abs(np.nan_to_num(data.command)) < still) & (np.abs(np.nan_to_num(x)) < still)
    lsb = rounding_step(data.y[status == PAIR]) if data.lsb is None else data.lsb
    noise = _mission_noise(np.where(status == PAIR, data.y - x, np.nan), data.dt, controller.noise)
    slack = _slack(x - data.command, data.dt, controller.memory_std_s / controller.memory_s)
    return SpeedPair(
        samples=SpeedSamples(data.y, x, slack, status, np.asarray(quiet)),
        lead=controller.first + len(controller.gains) - 1,
        noise=max(noise, lsb, _LEAST_NOISE * data.span),
        core=controller.core,
        exact=controller.exact,
        lsb=lsb,
        span=data.span,
        dt=data.dt,
        name=data.names[0],
    )


def _slack(error: Array, dt: float, share: float) -> Array:
    """How far the implied speed may be out where the drive is long away from its command: a share of the slow tracking error."""
    width = max(1, round(_SLOW_S / dt))
    return np.asarray((_SLACK + share) * np.abs(moving_sum(np.nan_to_num(error), width)) / width, dtype=np.float64)


def _mission_noise(residual: Array, dt: float, known: float) -> float:
    """Noise of this mission's quieter windows, no further from the known one than healthy missions differ."""
    found = quiet_rms(residual, dt)
    low, high = _NOISE_RANGE
    return known if np.isnan(found) else float(np.clip(found, low * known, high * known))
