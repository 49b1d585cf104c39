"""What is identified of a pair in the mission itself: delay, noise, rounding step, and where the log is too slow for its command."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.held import Held, held_reference, news_alone
from diagnosis.channels.noise import (
    moving_sum,
    relative_lag,
    shifted,
    unresolved,
    usual_distance,
    white_noise,
    white_part,
)
from diagnosis.channels.relation import Relation, relation_of
from diagnosis.channels.sample_status import BLIND, PAIR, SKIP, sample_status
from diagnosis.direct.gain_spread import LEAST_SPREAD, GainSpread, GainWindows, gain_windows
from diagnosis.direct.inputs import Pair
from diagnosis.direct.uncertainty import HealthyNoise, uncertainty_of
from diagnosis.estimation.fault_models import ModeModel
from diagnosis.estimation.samples import Samples
from replay.arrays.numeric import without_nan
from replay.arrays.quantiles import quantile_of
from replay.arrays.sliding import largest_within
from replay.faults import Side
from replay.machine.config import Limits

Array = NDArray[np.float64]

_MAX_LAG_S = 0.05
_WHOLE = 0.25
_NEARLY_ALL = 0.8  # of the mission
_JUMP = 3.5  # times the noise
_COARSE, _COARSE_COST = (
    0.3,
    0.2,
)  # where a log is too slow for its commands, what is left of them looks like a fault's drift
_AROUND = 11
_SETTLED = 3
_SPARSE = 1.5  # steps between news, from which on a channel is slower than the timeline


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
    relation : Relation
        How y follows its reference.
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
    own : HealthyNoise
        Noise of y − x.
    kind_spread : GainSpread
        By how much the gains of healthy channels of its kind vary.
    """

    pair: Pair
    relation: Relation
    samples: Samples
    model: ModeModel
    lsb: float
    unresolved: NDArray[np.bool_]
    unresolved_share: float = 0.0
    own: HealthyNoise = field(default_factory=HealthyNoise)
    kind_spread: GainSpread = field(default_factory=lambda: GainSpread(LEAST_SPREAD, 0.0))

    @property
    def lag(self) -> float:
        """Delay of y against its reference [steps]."""
        return self.relation.delay

    @property
    def coarse(self) -> bool:
        """Whether the log is too slow for its commands."""
        return self.unresolved_share > 0

    @cached_property
    def instruments(self) -> Array | None:
        """Signals that drive x but know nothing of the fault; of a coarse log that has none x but for its quick part. Shape (n, k)."""
        known = None if self.pair.instruments is None else self.pair.instruments()
        if not self.coarse or known is not None:
            return known
        out = np.zeros((self.pair.y.size, 1))
        out[self.news] = _neighbours(self.samples.x[self.news])
        return out

    @cached_property
    def news(self) -> slice | NDArray[np.intp]:
        """Samples that bring something new: all, or those that do where others come more often on the timeline.

        Indices, shape (k,), or a slice of the n samples.
        """
        return _news(np.isin(self.samples.status, (PAIR, BLIND)))[0]

    def gain_spread(self, start: int, stop: int) -> GainSpread:
        """By how much a healthy gain varies outside of a fault; that of its kind where the fault leaves too little of the mission."""
        return self._gains.spread(self.model.span, start, stop) or self.kind_spread

    @property
    def own_spread(self) -> GainSpread | None:
        """The same over the whole mission, a fault's part of it included; None where it moves little."""
        return self._gains.spread(self.model.span)

    @cached_property
    def usually_off(self) -> float:
        """By how much y is off its reference at most, nearly all of the mission [unit]; infinite where both are never known."""
        y, x, status, *_ = self.samples
        use = np.isin(status, (PAIR, BLIND)) & np.isfinite(y) & np.isfinite(x)
        return float(quantile_of(np.abs(y - x)[use], _NEARLY_ALL)) if use.any() else np.inf

    def with_kind_spread(self, spread: GainSpread) -> IdentifiedPair:
        """The same pair with how much the gain of such channels usually varies."""
        same = replace(self, kind_spread=spread)
        same.__dict__["_gains"] = self._gains  # a cached property, of which nothing changes
        return same

    @cached_property
    def _gains(self) -> GainWindows:
        return gain_windows(self.samples, self.pair.dt)

    @cached_property
    def holds(self) -> tuple[NDArray[np.signedinteger[Any]], NDArray[np.signedinteger[Any]]]:
        """Where y begins to hold a value other than 0, and for how many steps. Both of shape (k,)."""
        known = np.flatnonzero(self.pair.fresh & np.isfinite(self.pair.y))
        values = self.pair.y[known]
        first = known[np.flatnonzero(np.r_[True, values[1:] != values[:-1]])] if known.size else known
        length = np.diff(np.r_[first, self.pair.y.size])
        moving = self.pair.y[first] != 0.0
        small, keep = np.int32 if self.pair.y.size < 1 << 31 else np.intp, self.pair.store.keep
        return keep(first[moving].astype(small)), keep(length[moving].astype(small))

    @cached_property
    def way(self) -> Array:
        """Sum of the sizes of the reference up to each sample [unit], shape (n + 1,)."""
        return self.pair.store.keep(np.r_[0.0, np.cumsum(np.abs(without_nan(self.samples.x)))])

    @cached_property
    def texture(self) -> Texture:
        """Noise and rounding step of both measurements."""
        pair = self.pair
        known = np.isin(self.samples.status, (PAIR, BLIND))
        y, x = pair.y[known], self.samples.x[known]
        white, own = (float(np.nan_to_num(white_noise(z, pair.dt))) for z in (y, x))
        return Texture(y.size, white, self.lsb, own)


def identify(
    pair: Pair,
    limits: Limits,
    usual: HealthyNoise | None = None,
    given: Relation | None = None,
    most: float | None = None,
) -> IdentifiedPair:
    """Find how a channel follows its reference, its noise, and what of it the log does not resolve.

    Parameters
    ----------
    pair : Pair
        Channel, reference and circumstances.
    limits : Limits
        The smallest saturation term that counts bounds the mismatch of two healthy instruments.
    usual : HealthyNoise or None
        What healthy channels of its kind have; None: what this one has.
    given : Relation or None
        How channels of its kind follow their reference; None: as this one does.
    most : float or None
        Noise of a healthy channel of its kind at standstill, at most [unit]; None: what this one has.
    """
    dt, sensor = pair.dt, pair.side is Side.SENSOR
    habit = pair.habit
    held = held_reference(pair.x, habit, dt) if habit.stepwise else Held(pair.x, np.zeros(pair.x.size))
    hold = habit.hold(without_nan(held.mean))
    relation = _relation(pair, held.mean, hold, sensor) if given is None else given
    x = pair.store.keep(relation.expected(held.mean, dt))
    spread = without_nan(shifted(held.spread, relation.delay))
    status = sample_status(pair.y, x, pair.fresh, pair.alive, dt)
    if habit.stepwise:
        status = news_alone(status, pair.y, hold, dt)
    doubt = uncertainty_of(pair, x, spread, status, 0.25 * limits.min_sat, relation, usual, most)
    model = doubt.model
    own, white, blind, share = doubt.own, doubt.white, np.zeros(x.size, dtype=np.bool_), 0.0
    if not sensor:  # a command may jump from step to step, a speed may not
        paired = status == PAIR
        known = None if usual is None else usual.unresolved
        at, steps = _news(paired)
        power, share = unresolved(
            np.where(paired, pair.y - x, np.nan)[at], x[at], paired[at], model.noise, steps * dt, known
        )
        own = own._replace(unresolved=share)
        if share:
            more = np.zeros(x.size)
            more[at] = power / model.noise**2
            white = pair.store.keep(white + more)
            blind[at] = _unsettled(x[at], model.noise * np.sqrt(white[at]))
            status[blind & paired] = BLIND
            model = replace(model, drift_cost=model.drift_cost + _COARSE_COST * min(1.0, share / _COARSE))
    samples = Samples(pair.y, x, status, pair.quiet, white, doubt.passing, doubt.constant)
    return IdentifiedPair(pair, relation, samples, model, doubt.lsb, blind, share, own)


def _news(paired: NDArray[np.bool_]) -> tuple[slice | NDArray[np.intp], float]:
    """Samples to look at for what changes from one to the next, and their usual distance in steps."""
    steps = usual_distance(paired) if np.count_nonzero(paired) > 1 else 1.0
    return (slice(None), 1.0) if steps < _SPARSE else (np.flatnonzero(paired), steps)


def _relation(pair: Pair, x: Array, hold: Array, sensor: bool) -> Relation:
    """How y follows a reference that is already held as y is."""
    usable = pair.fresh & np.isfinite(pair.y) & np.isfinite(x) & ~pair.quiet
    if pair.habit.stepwise:
        status = np.where(usable, PAIR, SKIP).astype(np.int8)
        usable = news_alone(status, pair.y, hold, pair.dt) == PAIR
    most = max(1, round(_MAX_LAG_S / pair.dt)) if pair.dt <= _MAX_LAG_S else 0
    delays = (-most if sensor else 0, most)
    delay = relative_lag(pair.y, x, usable, *delays)
    if abs(delay - round(delay)) < _WHOLE:  # what one computer samples is late by whole steps
        delay = float(round(delay))
    start = Relation(delay=delay)
    return relation_of(pair.y, x, usable, start, pair.dt, delays, 0.0 if sensor else pair.span)


def _unsettled(x: Array, noise: Array) -> NDArray[np.bool_]:
    """Within three samples of a jump of the reference that noise does not explain, shape (n,)."""
    return largest_within(np.abs(white_part(without_nan(x))), _SETTLED, _SETTLED) > _JUMP * noise


def _neighbours(x: Array) -> Array:
    """Mean of the samples around each one, itself and the next ones left out, shape (n, 1): x but for its quick part."""
    known = without_nan(x)
    return ((moving_sum(known, _AROUND) - moving_sum(known, 3)) / (_AROUND - 3))[:, np.newaxis]
