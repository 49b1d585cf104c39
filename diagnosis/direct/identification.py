"""What is identified of a pair in the mission itself: delay, noise, rounding step, and where the log is too slow for its command."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import (
    moving_sum,
    relative_lag,
    rounding_step,
    shifted,
    slow_mismatch,
    unresolved,
    usual_distance,
    white_noise,
)
from diagnosis.channels.sample_status import BLIND, PAIR, sample_status
from diagnosis.direct.inputs import Pair
from diagnosis.estimation.fault_models import ModeModel
from diagnosis.estimation.samples import Samples
from diagnosis.results.fault_rows import codes_of
from replay.faults import Side
from replay.machine.config import Limits

Array = NDArray[np.float64]

_MAX_LAG_S = 0.05
_MEAN_HEALTHY_S = 60.0
_COARSE_COST = 0.2  # where a log is too slow for its commands, what is left of them looks like a fault's drift
_AROUND = 11
_SETTLED = 7


class Texture(NamedTuple):
    """Fine structure of both measurements, in the channel's unit.

    Attributes
    ----------
    readings : int
        Number of new samples of y.
    white, lsb : float
        Their white noise and rounding step.
    reference_white : float
        White noise of the reference at the same samples.
    """

    readings: int
    white: float
    lsb: float
    reference_white: float


@dataclass(frozen=True, eq=False)
class IdentifiedPair:
    """A pair with what was identified of it.

    Attributes
    ----------
    pair : Pair
        Channel, reference and circumstances.
    lag : float
        Delay of y against its reference [steps].
    samples : Samples
        The channel beside the reference, which is delayed as y is.
    model : ModeModel
        Noise and prior.
    lsb : float
        Rounding step of y [unit].
    unresolved : NDArray[np.bool_], shape (n,)
        Samples that cannot be judged because the command changes too fast for the log.
    unresolved_share : float
        Share of the power of the command's quick changes that shows up as a residual; 0 where all is resolved.
    """

    pair: Pair
    lag: float
    samples: Samples
    model: ModeModel
    lsb: float
    unresolved: NDArray[np.bool_]
    unresolved_share: float = 0.0

    @property
    def coarse(self) -> bool:
        """Whether the log is too slow for its commands."""
        return self.unresolved_share > 0

    @cached_property
    def instruments(self) -> Array | None:
        """Signals that drive x but know nothing of the fault; of a coarse log x but for its quick part. Shape (n, k)."""
        return _neighbours(self.samples.x) if self.coarse else self.pair.instruments

    @cached_property
    def texture(self) -> Texture:
        """Noise and rounding step of both measurements."""
        pair = self.pair
        known = pair.fresh & np.isfinite(pair.y)
        y, x = pair.y[known], self.samples.x[known]
        lsb = pair.known_noise.lsb if pair.known_noise.lsb is not None else rounding_step(y)
        white, own = (float(np.nan_to_num(white_noise(z, pair.dt))) for z in (y, x))
        return Texture(y.size, white, lsb, own)


def identify(pair: Pair, limits: Limits) -> IdentifiedPair:
    """Find delay and noise of a pair, and what of it the log does not resolve.

    Parameters
    ----------
    pair : Pair
        Channel, reference and circumstances.
    limits : Limits
        The smallest saturation term that counts bounds the mismatch of two healthy instruments.
    """
    usable = pair.fresh & np.isfinite(pair.y) & np.isfinite(pair.x)
    max_lag = max(1, round(_MAX_LAG_S / pair.dt)) if pair.dt <= _MAX_LAG_S else 0
    least_lag = 0 if pair.side is Side.ACTUATOR else -max_lag
    lag = relative_lag(pair.y, pair.x, usable & ~pair.quiet, least_lag, max_lag)
    x = pair.store.keep(shifted(pair.x, lag))
    status = sample_status(pair.y, x, pair.fresh, pair.alive, pair.dt)
    model, lsb = mode_model(pair, x, status, 0.25 * limits.min_sat)
    blind, share = np.zeros(x.size, dtype=np.bool_), 0.0
    if pair.side is Side.ACTUATOR:  # a command may jump from step to step, a speed may not
        paired = status == PAIR
        blind, share = unresolved(np.where(paired, pair.y - x, np.nan), x, paired, model.noise, pair.dt)
        if share:
            blind &= _unsettled(x, model.noise)
            status[blind & paired] = BLIND
            model = replace(model, drift_cost=model.drift_cost + _COARSE_COST)
    return IdentifiedPair(pair, lag, Samples(pair.y, x, status, pair.quiet), model, lsb, blind, share)


def mode_model(pair: Pair, x: Array, status: NDArray[np.int8], tolerance: float) -> tuple[ModeModel, float]:
    """Noise of the channel, found from the mission where the machine file does not give it, and its rounding step."""
    paired = status == PAIR
    fresh_y = pair.y[paired]
    lsb = pair.known_noise.lsb if pair.known_noise.lsb is not None else rounding_step(fresh_y)
    residual = np.where(paired, pair.y - x, np.nan)
    period = pair.dt * max(1.0, usual_distance(paired) if fresh_y.size > 1 else 1.0)
    white = white_noise(residual[paired], period)
    slow = slow_mismatch(residual, paired & ~pair.quiet, pair.dt)
    measured = max(np.nan_to_num(white), np.nan_to_num(slow))
    noise = max(measured, pair.known_noise.std or 0.0, lsb / np.sqrt(12), 1e-5 * pair.span)
    # a stuck sensor has no noise left, a stuck valve is still read by a noisy spool sensor
    constant = max(lsb / np.sqrt(12), noise / 50) if pair.side is Side.SENSOR else noise
    rate = 1.0 / period
    # a command is known to the last digit, a second speed has noise of its own
    own = white_noise(pair.x[paired], period) if pair.side is Side.SENSOR else 0.0
    explained = min(0.5, np.nan_to_num(own) ** 2 / noise**2)
    rows = len(codes_of(pair.side)) - 1  # every one of both sides is as probable as the others
    model = ModeModel(
        noise=noise,
        constant_noise=constant,
        tolerance=tolerance,
        span=pair.span,
        switch_cost=float(np.log(_MEAN_HEALTHY_S * rate * 2 * rows)),
        dt=period,
        own_cost=-0.5 * float(np.log(1.0 - explained)),
        side=pair.side,
    )
    return model, lsb


def _unsettled(x: Array, noise: float) -> NDArray[np.bool_]:
    """Where a reference changes within three samples by more than the noise, shape (n,)."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    known = np.nan_to_num(x)
    return np.asarray(maximum_filter1d(known, _SETTLED) - minimum_filter1d(known, _SETTLED) > 2 * noise)


def _neighbours(x: Array) -> Array:
    """Mean of the samples around each one, itself and the next ones left out, shape (n, 1): x but for its quick part."""
    known = np.nan_to_num(x)
    return ((moving_sum(known, _AROUND) - moving_sum(known, 3)) / (_AROUND - 3))[:, np.newaxis]
