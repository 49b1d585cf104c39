"""The measured opening of a steering valve beside its command, whatever the model of the axle says: it opens as it is told, or it does not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.by_itself import causes_where_off
from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.arrays.numeric import bridged
from replay.arrays.sliding import largest_within, smallest_within
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LATEST_S, _LATE, _AT_MOST_S = (
    0.3,
    3.0,
    0.6,
)  # after its command: of any healthy valve; times what it usually is late by; of that at most
_MOSTLY, _REACH = 0.98, 0.8  # of the readings; of how far the command goes, its rarest twentieths left out
_FEW, _ASKED = 12, 0.3  # readings; of full opening, that the command goes at least: beside less a loss does not show
_OFF = 0.05  # of full opening, root mean square: a healthy valve with a zero of its own is off by less


def latest(usual: float, dt: float) -> int:
    """By how much a healthy opening may be later than its command [steps]: ramps and pilot stages are no faults; `usual`, `dt` in s."""
    return max(1, round(min(max(_LATEST_S, _LATE * usual), _AT_MOST_S) / dt))


def opens_as_told(y: Array, x: Array, use: Flags, reach: int, *, loss: float, least: float) -> bool:
    """Whether an opening lies where its command was within the last moment, and goes nearly as far as it.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Measured opening and command [fraction of full opening].
    use : Flags, shape (n,)
        Steps with both that bring something new.
    reach : int
        How long ago its command may have been there [steps].
    loss, least : float
        By which share, and by how much [fraction of full opening], an opening may be off that counts as no fault.
    """
    if np.count_nonzero(use) < _FEW:
        return False
    known = bridged(x)
    low, high = (limit(known, reach, 0)[use] for limit in (smallest_within, largest_within))
    inside = (y[use] >= low - least - loss * np.abs(low)) & (y[use] <= high + least + loss * np.abs(high))
    way, told = (float(np.quantile(z[use], 0.95) - np.quantile(z[use], 0.05)) for z in (y, x))
    return float(np.mean(inside)) >= _MOSTLY and told >= _ASKED and way + 2.0 * least >= _REACH * told


def off_command(findings: Sequence[Finding], measured: Measured) -> list[Finding]:
    """Findings of an opening that is off its command where none is yet, and what simple cause explains it.

    Parameters
    ----------
    findings : Sequence[Finding]
        Of the valve, by the model of its axle.
    measured : Measured
        Its opening, and its command with the lag that it has.
    """
    size = measured.y.size
    noisy = Hypothesis(Side.ACTUATOR.value, FaultMode.NOISY.value, 1.0)
    whole = Finding(0, size, Side.ACTUATOR, FaultMode.NOISY, 1.0, (noisy,), None, None, (), Tier.DIRECT)
    found, _ = causes_where_off(whole, measured, _OFF)
    return [f for f in found if all(f.stop <= g.start or f.start >= g.stop for g in findings)]
