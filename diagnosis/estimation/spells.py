"""Spells of a loss within one finding of noise: a channel that follows its reference but for some spells, in which it is a share of it.

A valve with hysteresis deviates a little all the time. Where that is more than its usual noise, the path through the rows takes spells and
what lies between them for one noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, is_about
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_WINDOW_S, _FEW = 0.25, 5  # s; readings of one
_MOVES = 10.0  # times the noise, root mean square: a reference beside which a share shows
_LOST, _LEFT = 0.1, 0.1  # of the gain: what is lost at least, and what is left
_SHORTEST_S, _BRIDGED_S = 0.75, 0.5
_LEAST_USUAL = 12  # windows that follow: the median of their deviation is usual
# times that, or the noise, what a share leaves: losses left 0.8 to 2.0 on tuning machines, disturbances beside a loss 5
_AS_USUAL, _OF_LOSS = 2.2, 0.07  # and what is lost
_IN_SPELLS, _MOST = 0.85, 0.75  # of the deviation's power, and of its time at most
_P, _P_NOISE = 0.85, 0.1


@dataclass(frozen=True)
class _Windows:
    """Windows of a channel, each of shape (windows,), and their width [samples].

    `count` readings, sums of squares `yy`, `xx` and of products `xy`; `gain` by least squares, NaN where nothing tells, and mean
    square `off` of y − x.
    """

    width: int
    count: Array
    yy: Array
    xy: Array
    xx: Array
    gain: Array
    off: Array


def in_spells(finding: Finding, measured: Measured) -> list[Finding]:
    """A finding of noise as the spells of a loss that it is made of, if between them the channel follows as usual; else as it is.

    Parameters
    ----------
    finding : Finding
        Of one side.
    measured : Measured
        Its channel and reference.
    """
    if finding.mode is not FaultMode.NOISY:
        return [finding]
    windows = _windows(measured)
    lost = windows.gain < 1.0 - _LOST
    follows = np.abs(windows.gain - 1.0) <= _LOST
    if np.count_nonzero(follows) < _LEAST_USUAL:
        return [finding]
    usual = float(np.median(np.sqrt(windows.off[follows])))
    first, last = finding.start // windows.width, -(-finding.stop // windows.width)
    spells = [_trimmed(s, windows) for s in _stretches(lost, follows, first, last)]
    if not spells or not all(_is_share(s, windows, usual, measured) for s in spells):
        return [finding]  # what else there is would be left untold
    inside = np.zeros(lost.size, np.bool_)
    for start, stop in spells:
        inside[start:stop] = True
    part = slice(first, last)
    power, within = float(np.nansum(windows.off[part])), float(np.nansum(windows.off[part][inside[part]]))
    if within < _IN_SPELLS * power or float(inside[part].mean()) > _MOST:
        return [finding]
    return [_as_loss(finding, s, windows, measured) for s in spells]


def _windows(measured: Measured) -> _Windows:
    width = max(1, round(_WINDOW_S / measured.dt))
    n = measured.y.size // width
    use = (measured.use & np.isfinite(measured.y) & np.isfinite(measured.x))[: n * width].reshape(n, width)
    y, x = (np.where(use, z[: n * width].reshape(n, width), 0.0) for z in (measured.y, measured.x))
    count = use.sum(axis=1)
    xx, xy, yy = ((a * b).sum(axis=1) for a, b in ((x, x), (x, y), (y, y)))
    enough = (count >= min(_FEW, width)) & (xx > count * (_MOVES * measured.noise) ** 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        gain = np.where(enough, xy / xx, np.nan)
        off = np.where(count > 0, (yy - 2.0 * xy + xx) / count, np.nan)
    return _Windows(width, count, yy, xy, xx, gain, np.maximum(off, 0.0))


def _stretches(lost: Flags, follows: Flags, first: int, last: int) -> list[tuple[int, int]]:
    """Stretches of windows that lose, within [first, last): what tells nothing, and a brief while that follows, is bridged."""
    bridged, shortest = (max(1, round(s / _WINDOW_S)) for s in (_BRIDGED_S, _SHORTEST_S))
    out: list[tuple[int, int]] = []
    for k in np.flatnonzero(lost[first:last]) + first:
        if out and np.count_nonzero(follows[out[-1][1] : k]) <= bridged and k - out[-1][1] <= 8 * bridged:
            out[-1] = (out[-1][0], int(k) + 1)
        else:
            out.append((int(k), int(k) + 1))
    return [(a, b) for a, b in out if np.count_nonzero(lost[a:b]) >= shortest]


def _gain(spell: tuple[int, int], windows: _Windows) -> float:
    """Gain over a spell by least squares."""
    part = slice(*spell)
    return float(windows.xy[part].sum() / max(windows.xx[part].sum(), 1e-300))


def _trimmed(spell: tuple[int, int], windows: _Windows) -> tuple[int, int]:
    """A spell without the ends that lose less than half of what it loses: hysteresis beside a small command, or a part of a window."""
    loses = windows.gain[slice(*spell)] < 0.5 * (1.0 + _gain(spell, windows))
    inner = np.flatnonzero(loses)
    return (spell[0] + int(inner[0]), spell[0] + int(inner[-1]) + 1) if inner.size else spell


def _is_share(spell: tuple[int, int], windows: _Windows, usual: float, measured: Measured) -> bool:
    """Whether a share of the reference leaves no more of the channel than is usual where it follows."""
    part = slice(*spell)
    count, yy, xy, xx = (z[part] for z in (windows.count, windows.yy, windows.xy, windows.xx))
    gain = _gain(spell, windows)
    squares = np.maximum(yy - 2.0 * gain * xy + gain**2 * xx, 0.0)[count > 0] / count[count > 0]
    left, lost = float(np.sqrt(np.median(squares))), float(np.sqrt(np.nanmedian(windows.off[part])))
    return gain >= _LEFT and left <= min(_AS_USUAL * max(usual, measured.noise), _OF_LOSS * lost)


def _as_loss(finding: Finding, spell: tuple[int, int], windows: _Windows, measured: Measured) -> Finding:
    """The finding in one of its spells."""
    gain = windows.gain[slice(*spell)]
    lost = 1.0 - gain[np.isfinite(gain)]
    low, middle, high = np.quantile(lost, (0.05, 0.5, 0.95))
    start, stop = (max(finding.start, spell[0] * windows.width), min(finding.stop, spell[1] * windows.width))
    side = finding.side.value
    words = (
        f"{measured.names[0]} is {1.0 - middle:.2f} of {measured.names[1]} from {start * measured.dt:.2f} s to {stop * measured.dt:.2f} s, "
        "which leaves no more than is usual, and follows it beside that."
    )
    rows = ((FaultMode.INEFFICIENT, _P), (FaultMode.NOISY, _P_NOISE), (FaultMode.OUTSIDE_TABLE, 1.0 - _P - _P_NOISE))
    known = finding.detected is not None and start <= finding.detected < stop
    figures = tuple(e for e in finding.evidence if is_about(e, About.TIMES))
    return replace(
        finding,
        start=start,
        stop=stop,
        detected=finding.detected if known else None,
        mode=FaultMode.INEFFICIENT,
        probability=_P,
        hypotheses=tuple(Hypothesis(side, mode.value, p) for mode, p in rows),
        epsilon=Epsilon(float(middle), max(0.0, float(low)), min(1.0, float(high))),
        sat=None,
        evidence=(words, *figures),
    )
