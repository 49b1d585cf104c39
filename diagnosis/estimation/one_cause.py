"""Pieces of one fault that a single cause explains better than the rows which were found one after the other.

An offset looks stuck where nothing moves, like a loss where all moves one way, and like noise elsewhere; so do a reading that comes
late and a gain that fades. Where one of them explains the pieces of a part together, and no other one does, it is what is stated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sizes import amount
from replay.faults import FaultMode, State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_GAP_S = 3.0  # between pieces of one fault
_LEAST_S, _LEAST, _MOST = 1.0, 40, 200_000  # of a cluster: seconds, samples; samples that are looked at of a long one
_LEFT = 0.06  # of the power of a deviation: what a cause leaves of it, at most
# what any cause of another row leaves, at least: times what the cause leaves, and of the power
_RIVAL, _RIVAL_LEFT = 3.0, 0.15
_NEAR = 0.05  # of the power, likewise, beside an offset: noise leaves as much of a loss
_FAR, _FAR_LEFT = 5.0, 0.015  # both likewise, beside a cause that leaves nothing
_ABOUT = 0.03  # by which a gain is uncertain, and may be beyond the table
_NOTHING = 0.01  # of the power, that a cause may leave beside what a gain with an offset does
_FOLLOWS = 0.9  # correlation with the reference of a channel that is neither stuck nor dead
_P = 0.95  # that a cause which explains so much is it
_LATEST_S, _DELAYS = 1.0, 41
_NOTHING_WRONG = Hypothesis("none", State.HEALTHY.value, 1.0 - _P)
_USUAL = 0.9  # of the samples
# times the noise, by which a reading is usually off what a loss leaves: noise of its own, whatever its moves add; ...
_RESTLESS = 5.0
_STEADILY, _EVEN = 1.6, 1.8  # ... and where they add little: root mean square, times what is usual
_OWN, _BEYOND = 1.5, 3.0  # times the noise: a healthy channel's own deviation, and one that a cause is looked for


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
    """

    y: Array
    x: Array
    use: Flags
    dt: float
    names: tuple[str, str]
    unit: str
    noise: float
    least: float


@dataclass(frozen=True)
class _Cause:
    """A cause, the share of the deviation's power that it leaves, its words, and ε̂ where it is a loss."""

    mode: FaultMode
    left: float
    words: str
    epsilon: Epsilon | None = None
    changes: bool = False  # with time
    late: bool = False


def with_one_cause(findings: Sequence[Finding], measured: Measured) -> list[Finding]:
    """Findings of one part, those that one cause explains joined.

    Parameters
    ----------
    findings : Sequence[Finding]
        Of one side, in order of time.
    measured : Measured
        Its channel and reference.
    """
    out: list[Finding] = []
    clusters = list(_clusters(findings, round(_GAP_S / measured.dt)))
    common = _cause_of([f for near in clusters for f in near], measured) if len(clusters) > 1 else None
    if common is not None and common.changes and not common.late:
        common = None  # what changed between two pieces may have changed anyhow
    for near in clusters:
        cause = common or _cause_of(near, measured)
        out += near if cause is None or all(f.mode == cause.mode for f in near) else [_joined(near, cause)]
    return out


def _clusters(findings: Sequence[Finding], gap: int) -> Iterator[list[Finding]]:
    near: list[Finding] = []
    for f in sorted(findings, key=lambda f: f.start):
        if near and f.start - max(g.stop for g in near) > gap:
            yield near
            near = []
        near.append(f)
    if near:
        yield near


def _cause_of(near: Sequence[Finding], measured: Measured) -> _Cause | None:
    """What explains all pieces at once; None where nothing does, or more than one thing."""
    first, last = near[0].start, min(max(f.stop for f in near), measured.y.size)
    inside = np.zeros(last - first, np.bool_)
    for f in near:
        inside[f.start - first : f.stop - first] = True
    y, x = measured.y[first:last], measured.x[first:last]
    inside &= measured.use[first:last] & np.isfinite(y) & np.isfinite(x)
    if np.count_nonzero(inside) < max(_LEAST, _LEAST_S / measured.dt):
        return None
    at = np.flatnonzero(inside)
    at = at[:: -(-at.size // _MOST)]
    y, x, at = y[at], x[at], first + at
    if not (np.std(x) > 0.0 and np.std(y) > 0.0 and _power(y - x, measured) > (_BEYOND * measured.noise) ** 2):
        return None
    causes = list(_causes(y, x, at, measured))
    best = min((c for c in causes if not c.changes), key=lambda c: c.left)
    if best.left > _LEFT:  # what changes with time explains more than what does not, always
        best = min(causes, key=lambda c: c.left)
    others = min((c.left for c in causes if c.mode is not best.mode), default=np.inf)
    others = min(others, _power(y - np.mean(y), measured) / max(_power(y - x, measured), 1e-30))  # stuck
    steady_offset = not best.changes and best.epsilon is None
    if best.left > _LEFT or not _far(others, best, _NEAR if steady_offset else _RIVAL_LEFT):
        return None
    if not best.late and best.left > _NOTHING and float(np.corrcoef(x, y)[0, 1]) < _FOLLOWS:
        return None
    both = np.column_stack([x, np.ones(x.size)])  # a loss with a bias is the row of noise
    rest = _power(y - both @ np.linalg.lstsq(both, y, rcond=None)[0], measured) / max(_power(y - x, measured), 1e-30)
    if best.changes:
        return best if _far(rest, best, _RIVAL_LEFT) else None
    if best.mode is FaultMode.INEFFICIENT and _restless(y, x, measured):
        return None
    return best if best.left < max(_NOTHING, _RIVAL * rest) else None


def _restless(y: Array, x: Array, measured: Measured) -> bool:
    """Whether a reading is most of the time off its share of the reference by more than noise."""
    rest = y - float(x @ y) / float(x @ x) * x
    usual = 1.4826 * float(np.median(np.abs(rest)))
    even = float(np.std(rest)) < _EVEN * usual
    return usual > (_STEADILY if even else _RESTLESS) * measured.noise


def _far(rival: float, best: _Cause, least: float) -> bool:
    """Whether a rival leaves far more of the power than the best cause does; little is far beside nothing."""
    return rival >= (max(_FAR * best.left, _FAR_LEFT) if best.left <= _NOTHING else max(_RIVAL * best.left, least))


def _causes(y: Array, x: Array, at: NDArray[np.intp], measured: Measured) -> Iterator[_Cause]:
    """Every simple cause, with what it leaves of y beside x at some steps."""
    off = y - x
    whole = max(_power(off, measured), 1e-30)
    reference = measured.names[1]
    offset = float(np.mean(off))
    if abs(offset) >= measured.least:
        more = "more" if offset > 0.0 else "less"
        yield _Cause(
            FaultMode.OUTSIDE_TABLE,
            _power(off - offset, measured) / whole,
            f"It reads {amount(abs(offset), measured.unit, 2)} {more} than {reference} all through it, whatever that is: an offset.",
        )
    gain = float(x @ y) / float(x @ x)
    yield _loss(_power(y - gain * x, measured) / whole, (gain, gain), measured)
    when = (at - at[0]) * measured.dt
    shapes = np.column_stack([x, x * when])
    (start, slope), *_ = np.linalg.lstsq(shapes, y, rcond=None)
    ends = (float(start), float(start + slope * when[-1]))
    yield _loss(_power(y - shapes @ np.array([start, slope]), measured) / whole, ends, measured)
    line = np.column_stack([np.ones(at.size), when])
    drift, *_ = np.linalg.lstsq(line, off, rcond=None)
    yield _Cause(
        FaultMode.OUTSIDE_TABLE,
        _power(off - line @ drift, measured) / whole,
        f"It departs from {reference} by {amount(float(drift[1]), measured.unit, 2)} a second, whatever that is: a drift.",
        changes=True,
    )
    late = []
    for delay in np.linspace(0.0, _LATEST_S, _DELAYS)[1:]:
        before = measured.x[np.maximum(at - round(delay / measured.dt), 0)]
        late.append((_power(y - np.where(np.isfinite(before), before, x), measured) / whole, float(delay)))
    left, delay = min(late)
    yield _Cause(
        FaultMode.OUTSIDE_TABLE,
        left,
        f"It comes {1e3 * delay:.0f} ms after {reference}: a delay.",
        changes=True,
        late=True,
    )


def _loss(left: float, gains: tuple[float, float], measured: Measured) -> _Cause:
    """A gain that is steady or changes from the one to the other."""
    channel, reference = measured.names
    table = all(-_ABOUT <= g <= 1.0 + _ABOUT for g in gains)
    mode = FaultMode.INEFFICIENT if table else FaultMode.OUTSIDE_TABLE
    low, high = sorted(1.0 - g for g in gains)
    steady = gains[0] == gains[1]
    share = f"{gains[0]:.2f}" if steady else f"{gains[0]:.2f} at first and {gains[1]:.2f} at last"
    return _Cause(
        mode,
        left,
        f"{channel} is {share} of {reference} all through it.",
        Epsilon(0.5 * (low + high), low - _ABOUT, high + _ABOUT),
        changes=not steady,
    )


def _power(off: Array, measured: Measured) -> float:
    """Mean square of a deviation beyond what healthy noise has, but for its largest, which the timing of a move makes."""
    squared = off**2
    most = int(_USUAL * squared.size)
    return max(float(np.mean(np.partition(squared, most)[:most])) - (_OWN * measured.noise) ** 2, 0.0)


def _joined(near: Sequence[Finding], cause: _Cause) -> Finding:
    """One finding over all pieces."""
    longest = max(near, key=lambda f: f.stop - f.start)
    rest = {h.mode: h for h in longest.hypotheses if h.mode != cause.mode}
    total = sum(h.p for h in rest.values())
    others = [replace(h, p=(1.0 - _P) * h.p / total) for h in rest.values()] if total > 0.0 else [_NOTHING_WRONG]
    named = Hypothesis(longest.side.value, cause.mode.value, _P)
    raised = [f.detected for f in near if f.detected is not None]
    figures = tuple(e for e in longest.evidence if e.startswith(("Residual,", "Over ")) or "times as probable" in e)
    pieces = f"This alone leaves {100 * cause.left:.0f} % of the deviation's power over {len(near)} pieces that were found one after the other."
    return replace(
        longest,
        start=near[0].start,
        stop=max(f.stop for f in near),
        mode=cause.mode,
        probability=_P,
        hypotheses=(named, *sorted(others, key=lambda h: -h.p)),
        epsilon=cause.epsilon,
        sat=None,
        evidence=(cause.words, *((pieces,) if len(near) > 1 else ()), *figures),
        detected=min(raised, default=None),
    )
