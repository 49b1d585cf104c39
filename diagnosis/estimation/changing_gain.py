"""A loss that comes and goes within one finding: to a constant gain it looks like noise, and yet nothing shakes.

A second at a time the channel is a share of its reference, never more than all of it, and that share changes slowly.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from diagnosis.estimation.simple_causes import Measured, every_power
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, is_about
from replay.faults import FaultMode

Array = NDArray[np.float64]

_WINDOW_S, _FEW, _FEW_READINGS = 1.0, 5, 10
_MOVES = 10.0  # times the noise, root mean square: a reference beside which a share shows
_LEFT = 0.1  # of the deviation's power, that the shares leave
_LEFT_OF_ONE = 0.2  # of what one share leaves, likewise: noise of a second's correlation leaves a third and more
_ABOUT = 0.05  # by which a share is uncertain, and may be beyond the table
_NOT_YET = 0.1  # of the gain: a window that has lost less is one of before
_CHANGES, _SLOWLY = 0.15, 3.0  # of the gain, by which it changes; times that, the sum of all its changes
_RIVAL = 2.0  # times what the shares leave: what an offset that changes as slowly leaves, at least
_P, _P_EITHER, _P_OFFSET = 0.8, 0.5, 0.4
_EITHER = "An offset that changes as slowly explains as much."


def as_changing_gain(finding: Finding, measured: Measured) -> Finding:
    """A finding of noise as the loss that it is, where a share of the reference that changes slowly leaves hardly anything of it.

    Parameters
    ----------
    finding : Finding
        Of one side.
    measured : Measured
        Its channel and reference.
    """
    if finding.mode is not FaultMode.NOISY:
        return finding
    at, windows = _windows(finding, measured)
    if len(windows) < _FEW:
        return finding
    gains = np.array([float(x @ y) / float(x @ x) for y, x in windows])
    usual = np.median(
        sliding_window_view(np.pad(gains, 1, mode="edge"), 3), axis=1
    )  # a single window may be a reversal's
    spread = float(np.ptp(usual))
    slowly = float(np.abs(np.diff(usual)).sum()) <= _SLOWLY * spread
    if _left_by(gains, windows, measured) > _LEFT_OF_ONE * _left_by_one(windows, measured):
        return finding
    before = int(np.argmax(np.append(usual < 1.0 - _NOT_YET, True)))  # windows in which nothing is lost yet
    gains, usual, windows = gains[before:], usual[before:], windows[before:]
    if spread < _CHANGES or not slowly or len(windows) < _FEW:
        return finding
    if usual.min() < -_ABOUT or usual.max() > 1.0 + _ABOUT:
        return finding
    off = [y - x for y, x in windows]
    whole = max(every_power(np.concatenate(off), measured), 1e-30)
    left = _left_by(gains, windows, measured) / whole
    offset = every_power(np.concatenate([z - np.mean(z) for z in off]), measured) / whole
    if left > _LEFT:
        return finding
    either = offset < max(_RIVAL * left, 0.5 * _LEFT)
    p, rest = (_P_EITHER, _P_OFFSET) if either else (_P, 0.5 * (1.0 - _P))
    side = finding.side.value
    named = [Hypothesis(side, FaultMode.INEFFICIENT.value, p), Hypothesis(side, FaultMode.OUTSIDE_TABLE.value, rest)]
    noise = Hypothesis(side, FaultMode.NOISY.value, 1.0 - p - rest)
    lost = 1.0 - usual
    words = (
        f"{measured.names[0]} is a share of {measured.names[1]} that changes slowly, from {usual.max():.2f} to {usual.min():.2f}; "
        f"this leaves {100 * left:.0f} % of the deviation's power."
    )
    figures = tuple(e for e in finding.evidence if is_about(e, About.DEVIATION, About.TIMES))
    start = at[before] if before else finding.start
    known = finding.detected is not None and finding.detected >= start  # what raised it before was none of it
    return replace(
        finding,
        start=start,
        detected=finding.detected if known else None,
        mode=FaultMode.INEFFICIENT,
        probability=p,
        hypotheses=(*named, noise),
        epsilon=Epsilon(
            float(np.mean(lost)),
            max(0.0, float(lost.min()) - _ABOUT),
            min(1.0, float(lost.max()) + _ABOUT),
        ),
        sat=None,
        evidence=(words, *((_EITHER,) if either else ()), *figures),
    )


def _left_by(gains: Array, windows: list[tuple[Array, Array]], measured: Measured) -> float:
    """Power of what a share for every window, shape (windows,), leaves of them [unit²]."""
    return every_power(np.concatenate([y - g * x for (y, x), g in zip(windows, gains, strict=True)]), measured)


def _left_by_one(windows: list[tuple[Array, Array]], measured: Measured) -> float:
    """Power of what one share of the reference leaves of all windows [unit²]."""
    y, x = (np.concatenate(z) for z in zip(*windows, strict=True))
    return every_power(y - float(x @ y) / float(x @ x) * x, measured)


def _windows(finding: Finding, measured: Measured) -> tuple[list[int], list[tuple[Array, Array]]]:
    """First steps, and channel and reference, of every second of a finding in which the reference tells what share of it the channel is."""
    width = max(1, round(_WINDOW_S / measured.dt))
    at, out = [], []
    for start in range(finding.start, min(finding.stop, measured.y.size) - width // 2, width):
        part = slice(start, min(start + width, finding.stop))
        y, x = measured.y[part], measured.x[part]
        use = measured.use[part] & np.isfinite(y) & np.isfinite(x)
        y, x = y[use], x[use]
        if x.size >= _FEW_READINGS and float(np.sqrt(np.mean(x**2))) > _MOVES * measured.noise:
            at.append(start)
            out.append((y, x))
    return at, out
