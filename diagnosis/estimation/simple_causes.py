"""Simple causes of a channel's deviation from its reference: an offset, a loss, a gain that fades, a drift, a delay, a lag."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.lag import low_passed_at
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon
from diagnosis.results.sentence import About, Sentence
from diagnosis.results.sizes import amount
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ABOUT = 0.03  # by which a gain is uncertain, and may be beyond the table
_LATEST_S, _DELAYS = 1.0, 41
_LAGS_S, _SETTLED = (
    tuple(0.1 * 1.25**k for k in range(16)),
    4.0,
)  # time constants; times the longest, of what came before
_USUAL = 0.9  # of the samples
_SOME, _ALL = 500, slice(None)  # samples of which a likely delay is found
_ROUNDED = 1e-9  # of a sum: far more than rounding leaves of it
_OWN = 1.5  # times the noise: a healthy channel's own deviation
_LATER, _STARTS = 0.5, 11  # of a piece, within which a gain may begin to fade, and moments that are tried


@dataclass(frozen=True)
class Measured:
    """A channel beside its reference, each of shape (n,).

    Attributes
    ----------
    y, x : Array
        Channel and reference [unit].
    use : NDArray[np.bool_]
        Steps with both.
    dt : float
        Step [s].
    names : tuple[str, str]
        Of both.
    unit : str
        Of both.
    noise : float
        Root mean square of a healthy deviation [unit].
    least : float
        Smallest offset that counts [unit].
    least_loss : float
        Smallest ε that counts [1].
    """

    y: Array
    x: Array
    use: Flags
    dt: float
    names: tuple[str, str]
    unit: str
    noise: float
    least: float
    least_loss: float = 0.0


@dataclass(frozen=True)
class Cause:
    """A cause of a deviation.

    Attributes
    ----------
    mode : FaultMode
        Its row.
    words : str
        What it is.
    left : float
        Share of the deviation's power that it leaves [1].
    moves : float
        The same with the largest deviations, which the timing of moves makes [1].
    epsilon : Epsilon or None
        What is lost; None: it is no loss.
    changes, late : bool
        Whether it changes with time; whether it is a delay or a lag.
    seconds : float
        Of such a delay or lag [s].
    alone, clear : bool
        Whether no other one explains as much; whether none of another row does but such as change likewise.
    start, stop : int or None
        Step where it begins, if later than the pieces, and the one after its last, if earlier.
    at, rest : NDArray[np.intp], Array, shape (k,)
        Steps that were looked at, and what it leaves of the deviation there [unit].
    """

    mode: FaultMode
    words: str
    left: float = 1.0
    moves: float = 1.0
    epsilon: Epsilon | None = None
    changes: bool = False
    late: bool = False
    seconds: float = 0.0
    alone: bool = True
    clear: bool = True
    start: int | None = None
    stop: int | None = None
    at: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp), compare=False, repr=False)
    rest: Array = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)


def causes(y: Array, x: Array, at: NDArray[np.intp], measured: Measured) -> Iterator[Cause]:
    """Every simple cause, with what it leaves of y beside x.

    Parameters
    ----------
    y, x : Array, shape (k,)
        Channel and reference [unit] at some steps.
    at : NDArray[np.intp], shape (k,)
        These steps.
    measured : Measured
        Channel and reference whole.
    """
    off = y - x
    whole, every = max(power(off, measured), 1e-30), max(every_power(off, measured), 1e-30)

    def leaves(rest: Array, cause: Cause) -> Cause:
        return replace(
            cause, left=power(rest, measured) / whole, moves=every_power(rest, measured) / every, at=at, rest=rest
        )

    reference = measured.names[1]
    offset = float(np.mean(off))
    if abs(offset) >= measured.least:
        more = "more" if offset > 0.0 else "less"
        words = f"It reads {amount(abs(offset), measured.unit, 2)} {more} than {reference} all through it, whatever that is: an offset."
        yield leaves(off - offset, Cause(FaultMode.OUTSIDE_TABLE, words))
    gain = float(x @ y) / float(x @ x)
    yield leaves(y - gain * x, _loss((gain, gain), measured))
    when = (at - at[0]) * measured.dt
    shapes = np.column_stack([x, x * when])
    (start, slope), *_ = np.linalg.lstsq(shapes, y, rcond=None)
    if start > 1.0 + _ABOUT and slope < 0.0:  # the piece begins too early
        begins, rest, last = _later(off, x, when)
        yield leaves(rest, replace(_loss((1.0, last), measured), start=int(at[begins])))
    else:
        ends = (float(start), float(start + slope * when[-1]))
        yield leaves(y - shapes @ np.array([start, slope]), _loss(ends, measured))
    line = np.column_stack([np.ones(at.size), when])
    drift, *_ = np.linalg.lstsq(line, off, rcond=None)
    words = f"It departs from {reference} by {amount(float(drift[1]), measured.unit, 2)} a second, whatever that is: a drift."
    yield leaves(off - line @ drift, Cause(FaultMode.OUTSIDE_TABLE, words, changes=True))
    seconds, rest = _least(_delayed(at, x, measured), y, measured)
    words = Sentence(About.LATE, "It comes ", f"{1e3 * seconds:.0f}", f" ms after {reference}: a delay.")
    yield leaves(rest, _late(words, seconds))
    seconds, rest = _least(_lagged(at, x, measured), y, measured)
    yield leaves(rest, _late(f"It follows {reference} with a time constant of {plain(seconds, 2)} s: a lag.", seconds))


def _late(words: str, seconds: float) -> Cause:
    """A reading that comes late [s]."""
    return Cause(FaultMode.OUTSIDE_TABLE, words, changes=True, late=True, seconds=seconds)


class _Late(NamedTuple):
    """A reference that comes late.

    Attributes
    ----------
    seconds : Sequence[float]
        By how much, one after the other [s].
    reference : Callable[[int | slice, slice], Array]
        What it is by one of them, or by all, at some of the steps.
    """

    seconds: Sequence[float]
    reference: Callable[[int | slice, slice], Array]


def _least(late: _Late, y: Array, measured: Measured) -> tuple[float, Array]:
    """Time [s] and rest [unit], shape (k,), of what leaves least of y among references that come late.

    What leaves least of some of the samples is looked at first: its bound rules most others out.
    """

    def behind(k: int) -> Array:
        return y - late.reference(k, _ALL)

    likely = _ranked(behind(_likely(late, y)))
    bound, edge = _smaller(likely, measured), float(likely[_most(y.size)])
    least, best, rest = np.inf, 0.0, y
    for k, seconds in enumerate(late.seconds):
        off = behind(k)
        if _surely_more(off, bound, edge, measured):
            continue
        share = power(off, measured)
        if share < least or (share == least and every_power(off, measured) < every_power(rest, measured)):
            least, best, rest = share, seconds, off
    return best, rest


def _likely(late: _Late, y: Array) -> int:
    """Place of what leaves least of every so many samples of y, shape (k,)."""
    some = slice(None, None, max(1, y.size // _SOME))
    squared = (y[some] - late.reference(_ALL, some)) ** 2
    most = _most(squared.shape[1])
    return int(np.argmin(np.partition(squared, most, axis=1)[:, :most].sum(axis=1)))


def _delayed(at: NDArray[np.intp], x: Array, measured: Measured) -> _Late:
    """The reference at some steps, x there, by how much it is delayed."""
    seconds = np.linspace(0.0, _LATEST_S, _DELAYS)[1:].tolist()
    steps = np.array([round(s / measured.dt) for s in seconds])

    def reference(k: int | slice, part: slice) -> Array:
        before = measured.x[np.maximum(at[part] - steps[k, ..., np.newaxis], 0)]
        return np.where(np.isfinite(before), before, x[part])

    return _Late(seconds, reference)


def _lagged(at: NDArray[np.intp], x: Array, measured: Measured) -> _Late:
    """The same behind a lag of first order, by its time constant."""
    first = max(0, int(at[0]) - round(_SETTLED * _LAGS_S[-1] / measured.dt))
    behind = low_passed_at(measured.x[first : at[-1] + 1], _LAGS_S, measured.dt, at - first)

    def reference(k: int | slice, part: slice) -> Array:
        return np.where(np.isfinite(behind[k, ..., part]), behind[k, ..., part], x[part])

    return _Late(_LAGS_S, reference)


def _later(off: Array, x: Array, when: Array) -> tuple[int, Array, float]:
    """A gain that fades from 1 on within a piece: where it begins, what it leaves [unit], shape (k,), and the gain at last [1]."""
    tried = []
    for begins in np.linspace(0.0, _LATER * when[-1], _STARTS)[1:]:
        shape = x * np.maximum(when - begins, 0.0)
        slope = float(shape @ off) / max(float(shape @ shape), 1e-30)
        rest = off - slope * shape
        tried.append((float(rest @ rest), int(np.searchsorted(when, begins)), slope * (when[-1] - begins), rest))
    _, k, lost, rest = min(tried, key=lambda one: one[0])
    return k, rest, 1.0 + float(lost)


def _loss(gains: tuple[float, float], measured: Measured) -> Cause:
    """A gain that is steady or changes from the one to the other."""
    channel, reference = measured.names
    table = all(-_ABOUT <= g <= 1.0 + _ABOUT for g in gains)
    mode = FaultMode.INEFFICIENT if table else FaultMode.OUTSIDE_TABLE
    low, high = sorted(1.0 - g for g in gains)
    steady = gains[0] == gains[1]
    share = f"{gains[0]:.2f}" if steady else f"{gains[0]:.2f} at first and {gains[1]:.2f} at last"
    return Cause(
        mode,
        f"{channel} is {share} of {reference} all through it.",
        epsilon=Epsilon(0.5 * (low + high), low - _ABOUT, high + _ABOUT),
        changes=not steady,
    )


def below_limit(cause: Cause, measured: Measured) -> bool:
    """Whether a cause may be a loss or gain below the limit, at first and at last, or a delay of less than two readings are apart."""
    if cause.late:
        apart = np.diff(np.flatnonzero(measured.use))
        return bool(apart.size) and cause.seconds < measured.dt * float(np.median(apart))
    if cause.epsilon is None:
        return False
    ends = cause.epsilon.low + _ABOUT, cause.epsilon.high - _ABOUT
    return max(abs(x) for x in ends) < measured.least_loss


def power(off: Array, measured: Measured) -> float:
    """Mean square of a deviation, shape (k,), beyond what healthy noise has, but for its largest, which the timing of a move makes [unit²]."""
    return _smaller(_ranked(off), measured)


def _most(size: int) -> int:
    """How many of so many squares are not among the largest."""
    return int(_USUAL * size)


def _ranked(off: Array) -> Array:
    """Squares of a deviation, the largest of them at the end, shape (k,)."""
    squared = off**2
    return np.partition(squared, _most(squared.size))


def _smaller(squared: Array, measured: Measured) -> float:
    """The `power` of ranked squares, shape (k,)."""
    return max(float(np.mean(squared[: _most(squared.size)])) - (_OWN * measured.noise) ** 2, 0.0)


def _surely_more(off: Array, least: float, edge: float, measured: Measured) -> bool:
    """Whether the `power` of a deviation, shape (k,), is more than `least` by a bound that takes no order of its squares.

    The m smallest of k squares sum up to no less than all of them, each cut at an edge, less k − m times that edge [unit²].
    """
    most = _most(off.size)
    if not most:
        return False
    bound = float(np.minimum(off**2, edge).sum()) - (off.size - most) * edge
    return bound > (least + (_OWN * measured.noise) ** 2) * most + _ROUNDED * edge * off.size


def every_power(off: Array, measured: Measured) -> float:
    """Mean square of a deviation, shape (k,), beyond what healthy noise has, with its largest [unit²]."""
    return max(float(np.mean(off**2)) - (_OWN * measured.noise) ** 2, 0.0)
