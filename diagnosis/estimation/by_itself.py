"""A finding of noise whose deviation a simple cause explains wherever it shows: what moves with its reference, or along a line, is no noise.

Beside other pieces that the same cause does not explain, or with a while in which nothing deviates, one cause for all of it is not found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.one_cause import cause_of, joined
from diagnosis.estimation.simple_causes import Cause, Measured, below_limit
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode

_DEVIATES, _OF_ALL = 4.0, 0.2  # times the noise, and the root mean square of the whole: what a cause is looked for in
_BRIDGED_S, _SHORTEST_S = 0.5, 0.75
_EDGE_S, _EDGE = (
    0.2,
    0.1,
)  # at either end, where a channel goes and returns with its lag: at most so long, and of a stretch
_NOTHING_LEFT = 0.9  # ε of a channel that is stuck or dead, whatever else would explain it
_MOST_OFF = 0.9  # of the readings: the largest tenth of what they are off by may be a move's timing
_ALL = 0.9  # of the deviation's power, that lies in stretches which a cause explains


def told_by_itself(finding: Finding, measured: Measured) -> list[Finding]:
    """A finding of noise as the causes that explain it wherever it deviates, without losses that do not count; else as it is.

    Parameters
    ----------
    finding : Finding
        Of one side.
    measured : Measured
        Its channel and reference.
    """
    if finding.mode is not FaultMode.NOISY:
        return [finding]
    found, share = causes_where_off(finding, measured)
    return found if share > _ALL else [finding]


def causes_where_off(finding: Finding, measured: Measured, least: float = 0.0) -> tuple[list[Finding], float]:
    """The causes that explain the stretches of a finding which deviate, as findings, and the share of its deviation's power in them.

    Parameters
    ----------
    finding : Finding
        Of one side.
    measured : Measured
        Its channel and reference.
    least : float
        What a stretch is off by at least to be told, root mean square but for what the timing of moves makes [unit]. A loss below the
        limit is left out as well.
    """
    part = slice(finding.start, finding.stop)
    off = np.abs(measured.y - measured.x)[part]
    off = np.where(measured.use[part] & np.isfinite(off), off, 0.0)
    whole = float(np.sum(off**2))
    usual = float(np.sqrt(whole / max(int(np.count_nonzero(off)), 1)))
    found, power = [], 0.0
    for start, stop in _stretches(off > max(_DEVIATES * measured.noise, _OF_ALL * usual), measured.dt):
        inside = off[start:stop]
        if _usually(inside) < least:
            continue
        piece = replace(finding, start=finding.start + start, stop=finding.start + stop)
        cause = _cause(piece, measured)
        if cause is not None:
            power += float(np.sum(inside**2))
            if not below_limit(cause, measured):
                found.append(joined([piece], cause))
    return found, power / max(whole, 1e-30)


def _usually(off: NDArray[np.float64]) -> float:
    """Root mean square of all but the largest of what a stretch is off by where it is, shape (n,) [unit]."""
    there = np.sort(off[off > 0.0])
    return float(np.sqrt(np.mean(there[: max(1, int(_MOST_OFF * there.size))] ** 2))) if there.size else 0.0


def _stretches(off: NDArray[np.bool_], dt: float) -> Sequence[tuple[int, int]]:
    """Stretches that deviate, each without a gap of half a second in which nothing does."""
    at = np.flatnonzero(off)
    if not at.size:
        return []
    apart = np.flatnonzero(np.diff(at) * dt > _BRIDGED_S)
    first, last = at[np.r_[0, apart + 1]], at[np.r_[apart, at.size - 1]] + 1
    return [(int(a), int(b)) for a, b in zip(first, last, strict=True) if (b - a) * dt >= _SHORTEST_S]


def _cause(piece: Finding, measured: Measured) -> Cause | None:
    """What explains a stretch, or all of it but its ends."""
    edge = min(round(_EDGE_S / measured.dt), int(_EDGE * (piece.stop - piece.start)))
    inner = replace(piece, start=piece.start + edge, stop=piece.stop - edge)
    cause = cause_of([piece], measured) or cause_of([inner], measured)
    stays = cause is not None and cause.epsilon is not None and cause.epsilon.value > _NOTHING_LEFT
    return None if cause is None or stays else replace(cause, start=None, stop=None)
