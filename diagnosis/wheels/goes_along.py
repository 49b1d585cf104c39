"""A wheel whose valve seems stuck while its speed goes along with what its command asks: off by a constant, which no row of the tables has.

A stuck valve holds its wheel at one speed, whatever is asked; what other wheels drag along with them follows their speed by a share, and its
command runs away from it. A valve that opens by a constant too much, and a sensor that reads a constant too much, let the wheel follow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, is_about
from diagnosis.wheels.findings import WheelFindings
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

_WINDOW_S, _FEW, _SETTLES_S = 0.2, 10, 1.0  # means of so long, so many of them, after so long
_MOVES, _NOISES = 0.01, 1.5  # of the span, and times its noise: by which the speed must vary
_LEFT, _SHARE = 0.4, (0.9, 1.5)  # of what varies, and by which share of what is expected, where it goes along
_ROW = 0.06  # of a fault: that it is the row all the same
_WORDS = (
    "The {wheel} goes faster and slower as its command asks, a constant apart: a {valve} that is stuck would not. The {valve} may open by a constant too "
    "much or too little, or the {wheel.sensor} read so: command and speed do not tell, the {position} would."
)


def off_by_a_constant(
    found: WheelFindings, y: Array, expected: Array, dt: float, span: float, noise: float
) -> WheelFindings:
    """Findings in which a valve that seems stuck, but lets its wheel follow, is one outside the tables, its side left open.

    Parameters
    ----------
    found : WheelFindings
        Of one wheel.
    y, expected : Array, shape (n,)
        Measured speed, and that of a healthy wheel [m/s].
    dt : float
        Sample [s].
    span, noise : float
        Largest plausible speed, and the sensor's noise [m/s].
    """

    def judged(f: Finding) -> Finding:
        stuck = f.side is Side.ACTUATOR and f.mode is FaultMode.STUCK
        start = f.start + round(_SETTLES_S / dt)
        part = slice(start, f.stop)
        if not stuck or not goes_along(
            y[part], expected[part], round(_WINDOW_S / dt), max(_MOVES * span, noise * _NOISES)
        ):
            return f
        return _open(f)

    return replace(found, findings=[judged(f) for f in found.findings])


def goes_along(y: Array, expected: Array, width: int, least: float) -> bool:
    """Whether a speed varies as it is expected to, but for a constant.

    Parameters
    ----------
    y, expected : Array, shape (n,)
        Speeds [m/s].
    width : int
        Samples of a mean.
    least : float
        By how much it must vary, root mean square [m/s].
    """
    width = max(width, 1)
    count = y.size // width
    if count < _FEW:
        return False
    seen, told = (np.mean(x[: count * width].reshape(count, width), axis=1) for x in (y, expected))
    known = np.isfinite(seen) & np.isfinite(told)
    if np.count_nonzero(known) < _FEW:
        return False
    seen, told = seen[known] - seen[known].mean(), told[known] - told[known].mean()
    varies, asked = float(np.std(seen)), float(told @ told)
    if varies < least or asked <= 0.0:
        return False
    share = float(seen @ told) / asked
    return float(np.std(seen - told)) <= _LEFT * varies and _SHARE[0] <= share <= _SHARE[1]


def _open(f: Finding) -> Finding:
    fault = sum(h.p for h in f.hypotheses if h.mode != State.HEALTHY.value)
    row = _ROW * fault
    either = Side.SENSOR_OR_ACTUATOR
    named = [
        Hypothesis(either.value, FaultMode.OUTSIDE_TABLE.value, fault - row),
        Hypothesis(Side.ACTUATOR.value, FaultMode.STUCK.value, row),
        Hypothesis("none", State.HEALTHY.value, 1.0 - fault),
    ]
    said = tuple(e for e in f.evidence if not is_about(e, About.CASES, About.RIVAL))
    return replace(
        f,
        side=either,
        mode=FaultMode.OUTSIDE_TABLE,
        probability=fault - row,
        hypotheses=tuple(sorted(named, key=lambda h: -h.p)),
        epsilon=None,
        sat=None,
        evidence=(_WORDS, *said),
    )
