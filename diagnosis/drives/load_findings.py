"""Stretches of extra effort as faults, and on which side they are: a sensor that loses gain jumps, a load bends.

In a closed loop a sensor that reads low and a drive that is loaded, or less effective, take the same extra effort. What
tells them apart is the onset: the sensor's reading drops at once by ε·v, the drive's speed falls with its lag.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.drives.inputs import DriveData
from diagnosis.drives.load import LoadTrack
from diagnosis.results.assessment import Finding
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.sentence import About, Sentence, lasting
from diagnosis.results.vocabulary import Tier
from replay.arrays.runs import runs_of
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits

Array = NDArray[np.float64]

_LEAST_S = 2.0
_LEAST_LOAD = 2.0  # of a finding [standard deviations of a mission's offset]
_AROUND_S = 1.5
_SIDE_BY_SIDE = 3  # samples compared on each side of a jump
_PLAIN = 6.0  # size from which a jump cannot be overlooked [standard deviations of healthy changes]


@dataclass(frozen=True)
class Onset:
    """Change of the measured speed at the beginning of an extra effort.

    Attributes
    ----------
    seen : float
        Largest drop of the speed's magnitude between neighbouring samples [m/s]; NaN where the onset is not in the log.
    wanted : float
        Drop that a sensor's loss of gain would have made [m/s].
    noise : float
        Standard deviation of healthy changes [m/s].
    """

    seen: float
    wanted: float
    noise: float

    @property
    def side(self) -> Side:
        """Side of the fault; both where such a jump could be overlooked."""
        if np.isnan(self.seen) or self.wanted < _PLAIN * self.noise:
            return Side.SENSOR_OR_ACTUATOR
        return Side.SENSOR if self.seen > 0.6 * self.wanted else Side.ACTUATOR


@dataclass(frozen=True)
class LoadStretch:
    """One stretch of probable extra load.

    Attributes
    ----------
    start, stop : int
        Samples, half open.
    seconds : float
        Length [s].
    probability : float
        Mean over its steps.
    mean_load, mean_expected : float
        Mean extra and healthy effort [unit of effort].
    epsilon : Epsilon
        Share of the load in the effort, with its smallest and largest value.
    spread : float
        Largest minus smallest share [1].
    sat : Sat
        The load as a saturation term.
    """

    start: int
    stop: int
    seconds: float
    probability: float
    mean_load: float
    mean_expected: float
    epsilon: Epsilon
    spread: float
    sat: Sat

    @classmethod
    def of(cls, load: LoadTrack, first: int, last: int, dt: float) -> LoadStretch:
        """Steps [first, last) of a track."""
        level, expected = load.level[first:last], np.maximum(np.abs(load.expected[first:last]), 1e-9)
        share = level / (expected + level)
        mean, rms = -float(np.mean(level)), float(np.sqrt(np.mean(level**2)))
        return cls(
            start=first * load.length,
            stop=last * load.length,
            seconds=float(last - first) * load.length * dt,
            probability=float(np.mean(load.probability[first:last])),
            mean_load=float(np.mean(level)),
            mean_expected=float(np.mean(expected)),
            epsilon=Epsilon(float(np.mean(share)), float(np.min(share)), float(np.max(share))),
            spread=float(np.ptp(share)),
            sat=Sat(mean, rms, -float(np.max(level)), -float(np.min(level)), "of full opening"),
        )


def onset_of(y: Array, start: int, wanted: float, dt: float) -> Onset:
    """Look for a jump of y around sample `start`; see `Onset`. `y` of shape (n,), `dt` in s."""
    n = _SIDE_BY_SIDE
    size = np.abs(y)
    ahead = np.convolve(size, np.ones(n) / n, mode="valid")
    change = np.full(y.size, np.nan)
    if ahead.size > n:
        change[n : n + ahead.size - n] = ahead[n:] - ahead[:-n]
    known = change[np.isfinite(change)]
    if not known.size:
        return Onset(float("nan"), wanted, float("inf"))
    noise = 1.4826 * float(np.median(np.abs(known - np.median(known))))
    reach = round(_AROUND_S / dt)
    near = change[max(0, start - reach) : start + reach]
    inside = np.isfinite(near)
    if start <= reach or not inside.any():
        return Onset(float("nan"), wanted, noise)
    return Onset(-float(np.min(near[inside])), wanted, noise)


def load_findings(data: DriveData, load: LoadTrack, between: float, limits: Limits) -> list[Finding]:
    """Stretches of probable extra load as loss of effectiveness: ε = load / (expected + load).

    Parameters
    ----------
    data : DriveData
        The drive.
    load : LoadTrack
        Extra load over the mission.
    between : float
        Standard deviation of a healthy mission's own offset [unit of effort].
    limits : Limits
        What counts.
    """
    return [_finding(stretch, data) for stretch in load_stretches(load, between, limits, data.dt)]


def load_stretches(load: LoadTrack, between: float, limits: Limits, dt: float) -> list[LoadStretch]:
    """Stretches of extra load that are findings; parameters are those of `load_findings`, `dt` the distance of samples [s]."""
    sure = np.nan_to_num(load.probability) >= limits.min_probability
    out = []
    for a, b in runs_of(sure):
        stretch = LoadStretch.of(load, a, b, dt)
        if (
            stretch.epsilon.value >= limits.min_epsilon
            and stretch.seconds >= _LEAST_S
            and stretch.mean_load >= _LEAST_LOAD * between
        ):
            out.append(stretch)
    return out


def _finding(stretch: LoadStretch, data: DriveData) -> Finding:
    """One stretch as a fault, on the side that its onset tells."""
    speed = float(np.nanmean(np.abs(data.y[stretch.start : stretch.stop])))
    epsilon, p = stretch.epsilon, stretch.probability
    onset = onset_of(data.y, stretch.start, epsilon.value * speed, data.dt)
    # the effort of a controller that cannot have met a sensor's fault tells about the drive alone
    side = Side.ACTUATOR if data.open_loop else onset.side
    varying = stretch.spread > 0.5 * epsilon.value and side is Side.ACTUATOR
    mode = FaultMode.NOISY if varying else FaultMode.INEFFICIENT
    shares: tuple[Hypothesis, ...]
    if side is Side.SENSOR_OR_ACTUATOR:
        shares = tuple(Hypothesis(part.value, mode.value, p / 2) for part in (Side.ACTUATOR, Side.SENSOR))
    else:
        shares = (Hypothesis(side.value, mode.value, p),)
    return Finding(
        start=stretch.start,
        stop=stretch.stop,
        side=side,
        mode=mode,
        probability=p,
        hypotheses=(*shares, Hypothesis("none", State.HEALTHY.value, 1 - p)),
        epsilon=epsilon,
        sat=stretch.sat if varying else None,
        evidence=_sentences(stretch, onset, side, data),
        tier=Tier.DRIVE,
    )


def _sentences(stretch: LoadStretch, onset: Onset, side: Side, data: DriveData) -> tuple[str, ...]:
    """What decided, in figures."""
    effort = (
        f"{data.names[2]} was {plain(stretch.mean_load)} above the {plain(stretch.mean_expected)} that healthy missions needed for "
        f"the same speed, over {lasting(stretch.seconds, 0)}."
    )
    lines: list[str] = [Sentence(About.EFFORT, effort)]
    if data.open_loop:
        lines.append("The recorded controller met no fault of the sensor, so the drive itself took more effort.")
    elif side is Side.SENSOR:
        dropped = (
            f"The measured speed dropped by {plain(onset.seen)} {{speed_unit}} at once; a sensor that lost this much gain drops by "
            f"{plain(onset.wanted)} {{speed_unit}}, a loaded drive falls with its lag."
        )
        lines.append(Sentence(About.ONSET, dropped))
    elif side is Side.ACTUATOR:
        bent = (
            f"A sensor that lost this much gain would have dropped by {plain(onset.wanted)} {{speed_unit}} at once; no more than "
            f"{plain(onset.seen)} {{speed_unit}} was seen."
        )
        lines.append(Sentence(About.ONSET, bent))
    else:
        lines.append(
            "Without a clear onset, a sensor that reads low and a loaded or less effective drive are not distinguished."
        )
    if side is not Side.SENSOR:
        lines.append("An extra load and a loss of effectiveness cannot be distinguished here.")
    return tuple(lines)
