"""Stretches of extra effort as faults, and on which side they are: a sensor that loses gain jumps, a load bends.

In a closed loop a sensor that reads low and a drive that is loaded, or less effective, take the same extra effort. What
tells them apart is the onset: the sensor's reading drops at once by ε·v, the drive's speed falls with its lag.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.drives.load import LoadTrack
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from replay.faults import FaultMode, Side
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


def onset_of(y: Array, start: int, wanted: float, dt: float) -> Onset:
    """Look for a jump of y around sample `start`; see `Onset`."""
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


def load_findings(
    load: LoadTrack, between: float, y: Array, dt: float, limits: Limits, name: str, *, open_loop: bool
) -> list[Finding]:
    """Stretches of probable extra load as loss of effectiveness: ε = load / (expected + load).

    Parameters
    ----------
    load : LoadTrack
        Extra load over the mission.
    between : float
        Standard deviation of a healthy mission's own offset [unit of effort].
    y : Array, shape (n,)
        Measured speed [m/s].
    dt : float
        Step [s].
    limits : Limits
        What counts.
    name : str
        Channel of the effort, for the text.
    open_loop : bool
        Whether the controller cannot have met a fault of the sensor, so that its effort tells about the drive alone.
    """
    sure = np.nan_to_num(load.probability) >= limits.min_probability
    edge = np.flatnonzero(np.diff(np.r_[False, sure, False].astype(np.int8)))
    out = []
    for a, b in zip(edge[::2], edge[1::2], strict=True):
        level, expected = load.level[a:b], np.maximum(np.abs(load.expected[a:b]), 1e-9)
        share = level / (expected + level)
        epsilon, p = float(np.mean(share)), float(np.mean(load.probability[a:b]))
        seconds = float(b - a) * load.length * dt
        if epsilon < limits.min_epsilon or seconds < _LEAST_S or float(np.mean(level)) < _LEAST_LOAD * between:
            continue
        start, stop = int(a) * load.length, int(b) * load.length
        speed = float(np.nanmean(np.abs(y[start:stop])))
        onset = onset_of(y, start, epsilon * speed, dt)
        side = Side.ACTUATOR if open_loop else onset.side
        varying = float(np.ptp(share)) > 0.5 * epsilon and side is Side.ACTUATOR
        mode = FaultMode.NOISY if varying else FaultMode.INEFFICIENT
        sat = None
        if varying:
            mean, rms = -float(np.mean(level)), float(np.sqrt(np.mean(level**2)))
            sat = Sat(mean, rms, -float(np.max(level)), -float(np.min(level)), "of full opening")
        shares: tuple[Hypothesis, ...]
        if side is Side.SENSOR_OR_ACTUATOR:
            shares = (Hypothesis("actuator", mode.value, p / 2), Hypothesis("sensor", mode.value, p / 2))
        else:
            shares = (Hypothesis(side.value, mode.value, p),)
        out.append(
            Finding(
                start=start,
                stop=stop,
                side=side,
                mode=mode,
                probability=p,
                hypotheses=(*shares, Hypothesis("none", "healthy", 1 - p)),
                epsilon=Epsilon(epsilon, float(np.min(share)), float(np.max(share))),
                sat=sat,
                evidence=_sentences(
                    name, float(np.mean(level)), float(np.mean(expected)), seconds, side, onset, open_loop
                ),
                tier="drive",
            )
        )
    return out


def _sentences(
    name: str, level: float, expected: float, seconds: float, side: Side, onset: Onset, open_loop: bool
) -> tuple[str, ...]:
    lines = [
        f"{name} was {level:.3g} above the {expected:.3g} that healthy missions needed for the same speed, over {seconds:.0f} s."
    ]
    if open_loop:
        lines.append("The recorded controller met no fault of the sensor, so the drive itself took more.")
    elif side is Side.SENSOR:
        lines.append(
            f"The measured speed dropped by {onset.seen:.3g} m/s at once; a sensor that lost this much gain drops by "
            f"{onset.wanted:.3g} m/s, a loaded drive falls with its lag."
        )
    elif side is Side.ACTUATOR:
        lines.append(
            f"A sensor that lost this much gain would have dropped by {onset.wanted:.3g} m/s at once; no more than "
            f"{onset.seen:.3g} m/s was seen."
        )
    else:
        lines.append("Without a clear onset, a sensor that reads low and a loaded or less effective drive look alike.")
    if side is not Side.SENSOR:
        lines.append("An extra load and a loss of effectiveness look alike here.")
    return tuple(lines)
