"""Whether the effort of a drive takes part in changes of the load: without power it cannot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_PAIRS = 5  # blocks and the next, whose changes are compared
_MOST_CHANGE, _LEAVES, _FINEST = (
    0.5,
    2.5,
    0.02,
)  # of its largest change; usual deviations of an effort; of its usual size, which those are at least
_WINDOW, _APART = 8, 7.0  # blocks; standard errors by which means of so many differ, of the many that a span has
_MANY, _CHANCE = 80, 3.5  # blocks; standard errors of a correlation that is none
_USUAL = 0.9  # quantile of an effort that is its usual size
_LEAST_ALIKE, _ALIKE = 12, 0.5  # blocks; correlation of an effort that takes its part in what another one does


def unanswered(effort: Array, load: Array, driving: Flags, span: tuple[int, int]) -> bool:
    """Whether an effort does not follow changes of the load in a span as it does elsewhere.

    At one speed two loops may share the load in any way, and one of them have none of it; a change takes effort from each. Arrays of shape (b,).
    """
    inside = np.zeros(effort.size, bool)
    inside[span[0] : span[1]] = True
    here, error = _followed(effort, load, driving & inside)
    elsewhere, _ = _followed(effort, load, driving & ~inside)
    return abs(here) + 2.0 * error < abs(elsewhere)


def answers(effort: Array, load: Array, span: tuple[int, int]) -> bool:
    """Whether an effort, small as it is in a span, leaves its own value there: without power it cannot.

    It may do so when the load changes most, or for some seconds by more than the noise of its blocks leaves of so many. Both of shape (b,).
    """
    part = slice(*span)
    own, change = effort[part], np.abs(np.diff(load[part], prepend=load[span[0]]))
    known = np.isfinite(own)
    if not known.any():
        return False
    off = np.abs(own - np.median(own[known]))
    finest = _FINEST * float(np.nanquantile(np.abs(effort), _USUAL))
    usual = max(1.4826 * float(np.median(off[known])), finest)
    most = change > _MOST_CHANGE * float(change.max())
    about = known & np.convolve(most, np.ones(3), mode="same").astype(bool)
    if about.any() and float(np.mean(off[about])) > _LEAVES * usual:
        return True
    sound = own[known]
    if sound.size < 2 * _WINDOW:
        return False
    means = np.convolve(sound, np.ones(_WINDOW) / _WINDOW, mode="valid")
    middle = sound[_WINDOW // 2 : _WINDOW // 2 + means.size]
    noise = float(np.std(middle - means)) / np.sqrt(1.0 - 1.0 / _WINDOW)
    return bool(np.ptp(means) > max(_APART * noise / np.sqrt(_WINDOW), 2.0 * finest))


def goes_with(effort: Array, others: Sequence[Array], span: tuple[int, int]) -> bool:
    """Whether an effort, small as it is in a span, goes up and down with that of another drive there: without power it cannot.

    The inner drive of a curve carries little and takes its part in every change of the load. All of shape (b,).
    """
    own = effort[slice(*span)]
    return any(_together(own, o[slice(*span)]) for o in others)


def _together(a: Array, b: Array) -> bool:
    """Whether two efforts agree in values and in changes, beyond chance and in good part. Both of one shape (k,)."""
    known = np.isfinite(a) & np.isfinite(b)
    if np.count_nonzero(known) < _LEAST_ALIKE:
        return False
    pairs = (a[known], b[known]), (np.diff(a)[known[1:] & known[:-1]], np.diff(b)[known[1:] & known[:-1]])
    least = max(_ALIKE, _CHANCE / np.sqrt(np.count_nonzero(known)))
    return all(x.size > 1 and min(np.std(x), np.std(y)) > 0.0 and np.corrcoef(x, y)[0, 1] > least for x, y in pairs)


def is_noise(effort: Array, others: Sequence[Array]) -> bool:
    """Whether an effort has nothing of what any other one does, and nothing of its own that lasts. Each of shape (b,)."""
    known = np.isfinite(effort)
    if np.count_nonzero(known) < _MANY:
        return False
    own = effort[known]
    pairs = [(own, x[known]) for x in others] + [(own[1:], own[:-1])]
    return all(abs(_alike(*pair)) < _CHANCE / np.sqrt(own.size) for pair in pairs)


def _alike(a: Array, b: Array) -> float:
    """Correlation of what is known of both [1], 0 where one of them does not change. Both of one shape (k,)."""
    known = np.isfinite(a) & np.isfinite(b)
    if np.count_nonzero(known) < _MANY or min(np.std(a[known]), np.std(b[known])) == 0.0:
        return 0.0
    return float(np.corrcoef(a[known], b[known])[0, 1])


def _followed(effort: Array, load: Array, use: Flags) -> tuple[float, float]:
    """Change of an effort by that of the load from block to block, and its standard error [1]; infinite where nothing changes."""
    pairs = use[1:] & use[:-1] & np.isfinite(np.diff(effort))
    own, other = np.diff(effort)[pairs], np.diff(load)[pairs]
    power = float(other @ other)
    if own.size < _LEAST_PAIRS or power == 0.0:
        return 0.0, np.inf
    share = float(own @ other) / power
    return share, float(np.sqrt(np.sum((own - share * other) ** 2) / (own.size - 1) / power))
