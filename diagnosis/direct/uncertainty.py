"""How far a healthy channel may be from what its reference lets expect: white noise that may grow, and passing mismatch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.habit import Habit
from diagnosis.channels.noise import moving_sum, slow_mismatch, usual_distance, usual_rounding, white_noise, white_part
from diagnosis.channels.noise_growth import NoiseGrowth, noise_growth
from diagnosis.channels.relation import Relation
from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.inputs import Pair
from diagnosis.estimation.fault_models import MISMATCH_S, ModeModel
from diagnosis.results.fault_rows import codes_of
from replay.arrays.numeric import without_nan
from replay.arrays.quantiles import quantile_of
from replay.faults import Side

Array = NDArray[np.float64]

_MEAN_HEALTHY_S = 60.0
_SMOOTH_S, _MOTION_S = 0.02, 0.005
_LEAST_CONSTANT = 0.02  # of the noise
_MOST_MOTION = {
    Side.SENSOR: 1.0,
    Side.ACTUATOR: 6.0,
}  # mismatch by timing: of what the reference changes by within 5 ms
_MOST_SHARE = 0.1  # no healthy instrument's noise is more of its reading: what deviates by more is a fault's
_MOST_SLOW = 0.03  # of the span: a mismatch that lasts is a fault's beyond this
_SIBLINGS, _ALIKE, _SLACK = 3, 1.4, 0.01  # channels of one kind; how far one may be off the usual: times, and shares
_LOUDER = 3.0  # times the usual noise: what lasts of a mismatch is no noise beyond this
_REPEATS = 20  # news in a window of repeats
_PLAY, _PLAY_S = (
    0.35,
    0.5,
)  # of the play: what is not known of the side on which a valve stands; for how long it stands there
_JITTER = 3.0  # times its noise: what a valve's command may be off what it was of late, and the valve need not answer
_COUNTED = 1.0 / 6.0  # variance of a time between two ticks, of its step squared
_SOUND = 0.4  # quantile of windows that stands for healthy ones


class HealthyNoise(NamedTuple):
    """Noise of one healthy channel beside its reference.

    Attributes
    ----------
    floor, share : float
        White noise, as `diagnosis.channels.noise_growth.NoiseGrowth` has it, without the rounding of counted times.
    motion : float
        Passing mismatch per change of the reference within 5 ms to either side [1].
    unresolved : float
        Share of the power of the reference's quick changes that shows up as a residual [1].
    """

    floor: float = 0.0
    share: float = 0.0
    motion: float = 0.0
    unresolved: float = 0.0

    def exceeds(self, usual: HealthyNoise) -> bool:
        """Whether anything of it is more than channels of one kind differ by."""
        slack = HealthyNoise(0.0, _SLACK, _SLACK, _SLACK)
        return any(mine > _ALIKE * other + more for mine, other, more in zip(self, usual, slack, strict=True))


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Noise of a pair.

    Attributes
    ----------
    model : ModeModel
        Noise and prior.
    lsb : float
        Rounding step of y [unit].
    white, passing, constant : Array, shape (n,)
        As in `diagnosis.estimation.samples.Samples`.
    own : HealthyNoise
        What of it was found, or taken from others of its kind.
    """

    model: ModeModel
    lsb: float
    white: Array
    passing: Array
    constant: Array
    own: HealthyNoise


def uncertainty_of(
    pair: Pair,
    x: Array,
    spread: Array,
    status: NDArray[np.int8],
    tolerance: float,
    relation: Relation,
    usual: HealthyNoise | None = None,
    most: float | None = None,
) -> Uncertainty:
    """Noise of a pair, found from the mission where the machine file does not give it.

    Parameters
    ----------
    pair : Pair
        Channel, reference and circumstances.
    x : Array, shape (n,)
        What a healthy channel reads.
    spread : Array, shape (n,)
        By how much it may be off because the channel holds its values [unit].
    status : NDArray[np.int8], shape (n,)
        As in `diagnosis.channels.sample_status`, without repeats within the habit.
    tolerance : float
        Slow mismatch of two healthy instruments [unit].
    relation : Relation
        How the channel follows its reference.
    usual : HealthyNoise or None
        What healthy channels of its kind have; None: what this one has.
    most : float or None
        Noise of a healthy channel of its kind at standstill, at most [unit]; None: what this one has.
    """
    paired, habit = status == PAIR, pair.habit
    news = pair.y[paired]
    lsb = pair.known_noise.lsb if pair.known_noise.lsb is not None else usual_rounding(news)
    residual = np.where(paired, pair.y - x, np.nan)
    period = pair.dt * max(1.0, usual_distance(paired) if news.size > 1 else 1.0)
    size = np.abs(without_nan(x))
    counted = habit.rounding(size) ** 2 * _COUNTED
    if usual is None:
        growth = _growth(residual[paired], size[paired], counted[paired], period)
        growth = NoiseGrowth(growth.floor, min(growth.share, _MOST_SHARE))
    else:
        growth = NoiseGrowth(usual.floor, usual.share)
    relative = _relative_white(pair, growth, size, counted)
    evened = residual / np.sqrt(relative)
    moving = (~pair.quiet & (spread < tolerance))[paired]
    most = growth.floor if usual is not None else most
    noise = _noise(pair, evened[paired], moving, lsb, period, most)
    repeats = repeated_share(news, lsb, period, habit)
    # a stuck sensor has no noise left, a stuck valve is still read by a noisy spool sensor
    constant = noise
    if pair.side is Side.SENSOR:
        constant = max(lsb / math.sqrt(12), noise * min(1.0, max(_LEAST_CONSTANT, repeats)))
    moved = _moved(x, pair.dt)
    own = min(_motion_share(evened, moved, paired, pair.dt), _MOST_MOTION[pair.side]) if usual is None else usual.motion
    play = max(0.0, (_PLAY * relation.play) ** 2 - tolerance**2)

    def passing(spread: Array, moved: Array) -> Array:
        return np.asarray(1.0 + np.nan_to_num(spread**2 + play + (own * moved) ** 2) / tolerance**2)

    rows = len(codes_of(pair.side)) - 1  # every one of both sides is as probable as the others
    model = ModeModel(
        noise=noise,
        constant_noise=constant,
        tolerance=tolerance,
        span=pair.span,
        switch_cost=math.log(_MEAN_HEALTHY_S / period * 2 * rows),
        dt=period,
        mismatch_s=_PLAY_S if relation.play else MISMATCH_S,
        own_cost=-0.5 * math.log(1.0 - _explained(pair, paired, noise, period)),
        jitter=_JITTER * noise if pair.side is Side.ACTUATOR else 0.0,
        side=pair.side,
    )
    return Uncertainty(
        model=model,
        lsb=lsb,
        white=relative,
        passing=pair.store.map(passing, spread, moved),
        constant=_constant(pair, relative, counted, noise, constant),
        own=HealthyNoise(growth.floor, growth.share, own),
    )


def usual_of_kind(found: Sequence[HealthyNoise]) -> HealthyNoise | None:
    """Noise of a healthy one of several channels of one kind: faults leave the medians alone; None where they are few."""
    if len(found) < _SIBLINGS:
        return None
    return HealthyNoise(*(float(x) for x in quantile_of(np.array(found), 0.5, axis=0, method="lower")))


def most_noise_of_kind(noise: Sequence[float]) -> float | None:
    """Noise at standstill that a healthy one of several channels of one kind has at most [unit]: a fault that lasts is none.

    None where they are few.
    """
    return _LOUDER * float(quantile_of(noise, 0.5, method="lower")) if len(noise) >= _SIBLINGS else None


def _growth(residual: Array, size: Array, counted: Array, period: float) -> NoiseGrowth:
    """White noise of consecutive news, without the rounding of counted times."""
    power = np.maximum(white_part(residual) ** 2 - counted, 0.0)
    found = noise_growth(power, size, period) if power.size else None
    return found if found is not None else NoiseGrowth(float(np.nan_to_num(white_noise(residual, period))), 0.0)


def _noise(
    pair: Pair, evened: Array, moving: NDArray[np.bool_], lsb: float, period: float, most: float | None
) -> float:
    """Noise of y − x at standstill from the news: white, or slower; no more than `most` where that is known."""
    slow = min(float(np.nan_to_num(slow_mismatch(evened, moving, period))), _MOST_SLOW * pair.span)
    measured = max(float(np.nan_to_num(white_noise(evened, period))), slow)
    if most is not None:
        measured = min(measured, most)
    return float(max(measured, pair.known_noise.std or 0.0, lsb / math.sqrt(12), 1e-5 * pair.span))


def _relative_white(pair: Pair, growth: NoiseGrowth, size: Array, counted: Array) -> Array:
    """Variance of the white noise at every sample as a share of that at standstill, shape (n,)."""
    if growth.share == 0.0 and not pair.habit.tick:
        return pair.store.ones(size.size)
    floor = max(growth.floor, 1e-5 * pair.span)

    def relative(size: Array, counted: Array) -> Array:
        return np.asarray(1.0 + ((growth.share * size) ** 2 + counted) / floor**2)

    return pair.store.map(relative, size, counted)


def _explained(pair: Pair, paired: NDArray[np.bool_], noise: float, period: float) -> float:
    """Share of the noise that is the reference's own: a command is known to the last digit, a second speed is not."""
    if pair.side is Side.ACTUATOR:
        return 0.0
    return min(0.5, float(np.nan_to_num(white_noise(pair.x[paired], period))) ** 2 / noise**2)


def _constant(pair: Pair, relative: Array, counted: Array, noise: float, constant: float) -> Array:
    """Variance of a stuck channel as a share of the least: a value may last as long as rounding hides the noise."""
    if not pair.habit.tick or pair.side is Side.ACTUATOR:
        return pair.store.ones(relative.size)
    from scipy.special import erf

    own = np.maximum(noise**2 * relative - counted, 1e-12)
    hidden = erf(np.sqrt(counted / _COUNTED / (8.0 * own)))
    return pair.store.keep(np.maximum(1.0, noise**2 * relative * hidden**2 / constant**2))


def _moved(x: Array, dt: float) -> Array:
    """Change of x within 5 ms to either side, half of it [unit], shape (n,)."""
    reach, filled = max(1, round(_MOTION_S / dt)), without_nan(x)
    moved = np.zeros(x.size)
    moved[reach:-reach] = 0.5 * np.abs(filled[2 * reach :] - filled[: -2 * reach])
    return moved


def _motion_share(evened: Array, moved: Array, paired: NDArray[np.bool_], dt: float) -> float:
    """Passing mismatch per change of the reference: what of the residual is not white and grows with that."""
    width = max(1, round(_SMOOTH_S / dt))
    number = moving_sum(paired, width)
    smooth = moving_sum(np.where(paired, evened, 0.0), width) / np.maximum(number, 1)
    growth = noise_growth(np.where(number > 0, smooth**2, np.nan), moved, dt)
    return growth.share if growth is not None else 0.0


def repeated_share(news: Array, lsb: float, period: float, habit: Habit) -> float:
    """Probability that a healthy, moving channel gives the same value twice [1], by what it does and by its rounding.

    The noise of a channel within a rounding step shows by p = erf(lsb / (√8·noise)) at most, which is 1 without noise.

    `news` holds the new values in turn, shape (k,); `lsb` and what is compared with it are in the channel's unit,
    `period` in s.
    """
    count = news.size // _REPEATS
    share = 0.0
    if count >= 3:
        windows = news[: count * _REPEATS].reshape(count, _REPEATS)
        same = (np.diff(windows, axis=1) == 0.0).mean(axis=1)
        moving = same < 1.0
        share = float(quantile_of(same[moving], _SOUND)) if np.count_nonzero(moving) >= 3 else 0.0
    if lsb <= 0.0:
        return share
    white = float(np.nan_to_num(white_noise(news, period)))
    noise = math.sqrt(max(white**2 - habit.rounding_noise(lsb), 0.0))
    return max(share, math.erf(lsb / (math.sqrt(8.0) * noise)) if noise > 0.0 else 1.0)
