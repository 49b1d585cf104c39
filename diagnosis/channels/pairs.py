"""A channel beside its reference: what a sample of it says, its noise, and what a delay between the two explains."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum, rounding_step, slow_mismatch, usual_distance, white_noise, white_part
from diagnosis.channels.repeats import FALSE_SPELLS
from diagnosis.estimation import fault_models
from diagnosis.estimation.segments import Run
from replay.faults import FaultMode, Side
from replay.machine.config import Noise

Array = NDArray[np.float64]

_MEAN_HEALTHY_S = 60.0
_EDGE_S = 0.1
_SPOOL_DELAY_S = 0.005
_SENSOR_DELAY_S = 0.01
_AROUND = 11
_SETTLED = 7
_JUMPY = 0.6  # share of a command's size that jumps between samples, where there is nothing else to it
_FLIPS = 25  # samples in a row on one side of a command that switches to and fro between samples


@dataclass(frozen=True, eq=False)
class Pair:
    """A channel and its reference.

    Attributes
    ----------
    side : Side
        `SENSOR` or `ACTUATOR`.
    y, x : Array, shape (n,)
        Measured value and reference, SI; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new sample of y.
    alive : NDArray[np.bool_], shape (n,)
        Whether another channel of y's source delivers.
    quiet : NDArray[np.bool_], shape (n,)
        Where the component is neither commanded nor moving.
    dt : float
        Step [s].
    unit : str
        Unit of y.
    span : float
        Largest plausible magnitude [unit].
    y_name, x_name : str
        Canonical names, for the text.
    known_noise : Noise
        From the machine file.
    instruments : Array, shape (n, k), or None
        Signals that drive x but know nothing of the fault; see `diagnosis.estimation.fault_size`.
    moved : Array, shape (n,), or None
        x delayed as y is; None: x.
    """

    side: Side
    y: Array
    x: Array
    fresh: NDArray[np.bool_]
    alive: NDArray[np.bool_]
    quiet: NDArray[np.bool_]
    dt: float
    unit: str
    span: float
    y_name: str
    x_name: str
    known_noise: Noise
    instruments: Array | None = None
    moved: Array | None = None

    @cached_property
    def texture(self) -> tuple[int, float, float, float]:
        """Number of new samples of y, their white noise and rounding step, and the reference's white noise there."""
        known = self.fresh & np.isfinite(self.y)
        y, x = self.y[known], (self.x if self.moved is None else self.moved)[known]
        lsb = self.known_noise.lsb if self.known_noise.lsb is not None else rounding_step(y)
        white, own = (float(np.nan_to_num(white_noise(z, self.dt))) for z in (y, x))
        return y.size, white, lsb, own


def sample_status(
    y: Array, x: Array, fresh: NDArray[np.bool_], alive: NDArray[np.bool_], dt: float
) -> NDArray[np.int8]:
    """Status of every step for `modes`: a pair, a silent y beside living siblings, or nothing new."""
    status = np.full(y.size, fault_models.SKIP, dtype=np.int8)
    known = np.isfinite(y)
    status[fresh & known & np.isfinite(x)] = fault_models.PAIR
    silent = ~known & alive
    edge = round(_EDGE_S / dt)
    for part in (slice(0, edge), slice(max(0, y.size - edge), y.size)):
        if not silent[part].all() or edge * 2 < y.size:
            silent[part] &= False
    status[silent] = fault_models.SILENT
    return status


def unsettled(x: Array, noise: float) -> NDArray[np.bool_]:
    """Where a reference changes within three samples by more than the noise, shape (n,)."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    known = np.nan_to_num(x)
    return np.asarray(maximum_filter1d(known, _SETTLED) - minimum_filter1d(known, _SETTLED) > 2 * noise)


def neighbours(x: Array) -> Array:
    """Mean of the samples around each one, itself and the next ones left out, shape (n, 1): x but for its quick part."""
    known = np.nan_to_num(x)
    return ((moving_sum(known, _AROUND) - moving_sum(known, 3)) / (_AROUND - 3))[:, np.newaxis]


def timing_explains(pair: Pair, run: Run, mode: FaultMode, share: float) -> bool:
    """Whether a deviation may be nothing but a delay between y and its reference, or its rounding.

    Shorter than a spool sensor's delay; or, where a log is too slow for its commands: what changes from sample to
    sample is as large, or y is x with its sign at other moments, or a constant y is met by most samples of x. For a
    speed: shorter than half a second and no more than 10 ms of the reference's slope, or a reading that rests beside a
    reference that hardly moves, no longer than its noise allows. Whatever the rate, the answer to a command of which
    nothing is left but jumps between samples depends on the valve's lag.
    """
    part = slice(run.start, run.stop)
    x = pair.x if pair.moved is None else pair.moved
    y, ref = pair.y[part], x[part]
    seconds = (run.stop - run.start) * pair.dt
    off = np.abs(y - ref)
    deviation = float(np.sqrt(np.nanmean(off**2))) if np.isfinite(off).any() else np.inf
    if pair.side is Side.SENSOR:
        slope = np.gradient(np.nan_to_num(x[max(0, run.start - 1) : run.stop + 1]), pair.dt)
        moves = float(np.sqrt(np.mean(slope**2))) * _SENSOR_DELAY_S
        if mode in (FaultMode.STUCK, FaultMode.NO_SIGNAL):
            return _rests_by_chance(pair, run, deviation)
        return mode is FaultMode.NOISY and seconds < 0.5 and deviation < moves
    if seconds <= _SPOOL_DELAY_S:
        return True
    gone = mode in (FaultMode.STUCK, FaultMode.NO_SIGNAL)
    jumps = _sudden(pair.x, run)
    if not gone and deviation < 2 * jumps and jumps > _JUMPY * float(np.sqrt(np.nanmean(ref**2))):
        return True
    if not share:
        return False
    if gone:
        return run.size < _FLIPS or (np.isfinite(deviation) and float(np.nanmedian(off)) < 0.5 * deviation)
    if mode is not FaultMode.NOISY:
        return False
    sudden = max(_sudden(z, run) for z in (pair.x, pair.y))
    size = np.sqrt(np.nanmean((np.abs(y) - np.abs(pair.x[part])) ** 2))
    return bool(sudden > 0.3 * deviation or size < 0.3 * deviation)


def _sudden(x: Array, run: Run) -> float:
    """Root mean square of what changes from sample to sample in a run."""
    first = max(0, run.start - 1)
    return float(np.sqrt(np.mean(white_part(x[first : run.stop + 1])[run.start - first :][: run.size] ** 2)))


def _rests_by_chance(pair: Pair, run: Run, deviation: float) -> bool:
    """Whether a healthy sensor's noise may keep its readings as close as they are, beside a reference that explains them.

    Within w = ptp(y) + lsb one reading is with probability erf(w / (√8·noise)) at most; see `diagnosis.channels.repeats`.
    """
    if not np.isfinite(pair.y[run.start : run.stop]).all():
        return False  # a silent channel does not rest
    y = pair.y[run.start : run.stop][pair.fresh[run.start : run.stop]]
    count, white, lsb, own = pair.texture
    if not y.size or deviation > 2.5 * math.hypot(white, own):
        return False
    noise = math.sqrt(max(white**2 - lsb**2 / 12, 0.0))
    close = math.erf((float(np.ptp(y)) + lsb) / (math.sqrt(8.0) * noise)) if noise else 1.0
    return bool(count * close ** (y.size - 1) > FALSE_SPELLS)


def mode_model(
    pair: Pair, x: Array, status: NDArray[np.int8], tolerance: float
) -> tuple[fault_models.ModeModel, float]:
    """Noise of the channel, found from the mission where the machine file does not give it."""
    fresh_y = pair.y[status == fault_models.PAIR]
    lsb = pair.known_noise.lsb if pair.known_noise.lsb is not None else rounding_step(fresh_y)
    residual = np.where(status == fault_models.PAIR, pair.y - x, np.nan)
    period = pair.dt * max(
        1.0,
        float(
            usual_distance(status == fault_models.PAIR),
        )
        if fresh_y.size > 1
        else 1.0,
    )
    white = white_noise(residual[status == fault_models.PAIR], period)
    slow = slow_mismatch(residual, (status == fault_models.PAIR) & ~pair.quiet, pair.dt)
    measured = max(np.nan_to_num(white), np.nan_to_num(slow))
    noise = max(measured, pair.known_noise.std or 0.0, lsb / np.sqrt(12), 1e-5 * pair.span)
    # a stuck sensor has no noise left, a stuck valve is still read by a noisy spool sensor
    constant = max(lsb / np.sqrt(12), noise / 50) if pair.side is Side.SENSOR else noise
    rate = 1.0 / period
    # a command is known to the last digit, a second speed has noise of its own
    own = white_noise(pair.x[status == fault_models.PAIR], period) if pair.side is Side.SENSOR else 0.0
    explained = min(0.5, np.nan_to_num(own) ** 2 / noise**2)
    model = fault_models.ModeModel(
        noise=noise,
        constant_noise=constant,
        tolerance=tolerance,
        span=pair.span,
        switch_cost=float(np.log(_MEAN_HEALTHY_S * rate * 8)),
        dt=period,
        own_cost=-0.5 * float(np.log(1.0 - explained)),
    )
    return model, lsb
