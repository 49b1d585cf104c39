"""Pieces of one fault that a single cause explains better than the rows which were found one after the other.

An offset looks stuck where nothing moves, like a loss where all moves one way, and like noise elsewhere; so do a reading that comes
late and a gain that fades. Where one of them explains the pieces of a part together, and no other one does, it is what is stated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.healthy_gaps import parted
from diagnosis.estimation.simple_causes import Cause, Measured, below_limit, causes, every_power, power
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, is_about
from replay.arrays.quantiles import median_of
from replay.faults import FaultMode, State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_GAP_S = 3.0  # between pieces of one fault
_LEAST_S, _LEAST, _MOST = 1.0, 20, 200_000  # of a cluster: seconds, samples; samples that are looked at of a long one
_LEFT = 0.06  # of the power of a deviation: what a cause leaves of it, at most
# what any cause of another row leaves, at least: times what the cause leaves, and of the power
_RIVAL, _RIVAL_LEFT = 3.0, 0.15
_LEFT_OF_ONE = 0.2  # of the power of one of many pieces, that their common cause leaves of it
_NEAR = 0.05  # of the power, likewise, beside an offset: noise leaves as much of a loss
_FAR, _FAR_LEFT = 5.0, 0.006  # both likewise, beside a cause that leaves nothing
_NOTHING = 0.01  # of the power, that a cause may leave beside what a gain with an offset does
_FOLLOWS = 0.9  # correlation with the reference of a channel that is neither stuck nor dead
# that a cause which explains so much is it; of a loss beside an offset that does
_P, _P_EITHER, _P_OFFSET = 0.95, 0.5, 0.4
_EARLY_S = 0.5  # by which a piece may begin before what deviates
_P_FADES, _P_DRIFTS = 0.7, 0.2  # the same of a gain that fades beside a drift
_P_UNCLEAR, _P_UNCLEAR_DRIFTS = 0.5, 0.1  # and beside other rows as well
_UNCLEAR = "It stays nearly where it is while its reference moves, so that other rows explain nearly as much."
_EITHER_DRIFTS = "Its reference hardly changes meanwhile, so that a drift explains as much."
_EITHER = "Its reference hardly changes meanwhile, so that an offset explains as much."
_NOTHING_WRONG = Hypothesis("none", State.HEALTHY.value, 1.0 - _P)
# of the root mean square: a deviation that is no healthy one; of the pieces, that it takes at most
_MARKED, _MOSTLY = 0.5, 0.9
# times the noise, by which a reading is usually off what a loss leaves: noise of its own, whatever its moves add; ...
_RESTLESS = 5.0
_STEADILY, _EVEN = 1.6, 1.8  # ... and where they add little: root mean square, times what is usual
_BEYOND = 3.0  # times the noise: a deviation that a cause is looked for
_OWN = 1.5  # times the noise: less than that nobody sees


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
    common = cause_of([f for near in clusters for f in near], measured) if len(clusters) > 1 else None
    if common is not None and (not common.alone or (common.changes and not common.late)):
        common = None  # what changed between two pieces may have changed anyhow
    for pieces in clusters:
        near = pieces
        shared = common is not None and _explains(common, near, measured)
        cause = replace(common, start=None, stop=None) if common is not None and shared else cause_of(near, measured)
        lost = all(f.mode is FaultMode.INEFFICIENT for f in near)
        wide = _as_far_as_it_shows(near, out[-1].stop if out else 0, measured) if lost else near
        offset = cause_of(wide, measured) if wide != near else None
        if offset is not None and offset.alone and offset.epsilon is None and not offset.changes:
            near, cause = wide, offset  # what a loss, say, explains of a part is an offset's by the rest
        told = cause is None or (cause.alone and all(f.mode == cause.mode for f in near))
        small = cause is not None and below_limit(cause, measured) and all(f.mode.varying for f in near)
        if told or small or cause is None:
            out += near
            continue
        parts = parted(near, cause, measured)
        out += [joined(near, cause)] if len(parts) < 2 else [f for p in parts for f in with_one_cause(p, measured)]
    return out


def _explains(common: Cause, near: Sequence[Finding], measured: Measured) -> bool:
    """Whether a cause that explains all pieces of a part together explains some of them by themselves: else each is what it is."""
    first, last = np.searchsorted(common.at, [near[0].start, max(f.stop for f in near)])
    if first == last:
        return True
    at, rest = common.at[first:last], common.rest[first:last]
    off = (measured.y - measured.x)[at]
    left, whole = power(rest, measured), power(off, measured)
    if left > _LEFT_OF_ONE * whole:
        return False
    piece = np.searchsorted([f.start for f in near], at, "right")
    rests = all(f.mode.total for f in near) and power(_about(measured.y[at], piece), measured) == 0.0
    return left == 0.0 or not rests


def _clusters(findings: Sequence[Finding], gap: int) -> Iterator[list[Finding]]:
    near: list[Finding] = []
    for f in sorted(findings, key=lambda f: f.start):
        if near and f.start - max(g.stop for g in near) > gap:
            yield near
            near = []
        near.append(f)
    if near:
        yield near


def _as_far_as_it_shows(near: list[Finding], least: int, measured: Measured) -> list[Finding]:
    """Pieces with the time before, from step `least` on, and behind them in which the channel is off its reference all the time."""
    first, last = near[0].start, max(f.stop for f in near)
    reach = round(_GAP_S / measured.dt)
    low, high = max(min(least, first), first - reach), min(measured.y.size, last + reach)
    off = np.abs(measured.y[low:high] - measured.x[low:high])
    known = np.flatnonzero(measured.use[low:high] & np.isfinite(off))
    healthy = low + known[off[known] <= _BEYOND * measured.noise]
    before, behind = healthy[healthy < first], healthy[healthy >= last]
    start = int(before[-1]) + 1 if before.size else low
    stop = int(behind[0]) if behind.size else high
    if max(first - start, stop - last) * measured.dt < _EARLY_S:
        return near
    ends = [replace(near[0], start=start), *near[1:]]
    return [*ends[:-1], replace(ends[-1], stop=max(ends[-1].stop, stop))]


def cause_of(near: Sequence[Finding], measured: Measured) -> Cause | None:
    """What explains all pieces at once; None where nothing does, or more than one thing."""
    first, last = near[0].start, min(max(f.stop for f in near), measured.y.size)
    inside = np.zeros(last - first, np.bool_)
    for f in near:
        inside[f.start - first : f.stop - first] = True
    y, x = measured.y[first:last], measured.x[first:last]
    inside &= measured.use[first:last] & np.isfinite(y) & np.isfinite(x)
    at = np.flatnonzero(inside)
    if at.size < _LEAST:
        return None
    least = max(
        _LEAST, _LEAST_S / (measured.dt * float(median_of(np.diff(at))))
    )  # readings may be further apart than steps
    if at.size < least:
        return None
    at = at[:: -(-at.size // _MOST)]
    y, x, at = y[at], x[at], first + at
    if all(f.mode.total for f in near) and _rests(y, np.searchsorted([f.start for f in near], at, "right"), measured):
        return None
    off = np.abs(y - x)
    big = np.flatnonzero(off > max(_BEYOND * measured.noise, _MARKED * float(np.sqrt(np.mean(off**2)))))
    part = _lasting_part(big, at, measured)
    cause = _explanation(y, x, at, measured)
    # no row explains all pieces of what changes
    apart = cause is not None and cause.changes and cause.left <= _NOTHING and len({f.mode for f in near}) > 1
    if cause is not None and (cause.alone or apart or all(f.mode.varying for f in near)):
        k = _lasting(big, at, measured)
        early = (at[k] - at[0]) * measured.dt >= _EARLY_S
        if early and cause.epsilon is not None and _nothing_asked(cause, x[:k], measured):
            shown = _explanation(y[k:], x[k:], at[k:], measured)  # what rests before it speaks for no loss
            same = shown is None or (shown.alone and shown.mode is cause.mode)
            return cause if same or shown is None else replace(shown, start=int(at[k]))
        return _from_where_it_shows(cause, y - x, x, at, int(big[0]) if big.size else 0, measured)
    if not least <= at[part].size < _MOSTLY * at.size:
        return None
    cause = _explanation(y[part], x[part], at[part], measured)  # a piece that began too early hides what it is
    if cause is None or not cause.alone or cause.changes:
        return None
    behind = (y - x)[part.stop :]
    healthy = not behind.size or power(behind, measured) <= (_BEYOND * measured.noise) ** 2
    return replace(cause, start=int(at[part][0]), stop=int(at[part][-1]) + 1 if healthy else None)


def _rests(y: Array, piece: NDArray[np.intp], measured: Measured) -> bool:
    """Whether a channel stays where it is in every piece: it sticks, wherever that is."""
    return every_power(_about(y, piece), measured) <= measured.noise**2


def _about(y: Array, piece: NDArray[np.intp]) -> Array:
    """Values of a channel less their mean in each piece, shape (k,)."""
    mean = np.bincount(piece, weights=y) / np.maximum(np.bincount(piece), 1)
    return np.asarray(y - mean[piece])


def _nothing_asked(cause: Cause, x: Array, measured: Measured) -> bool:
    """Whether a loss would not have shown beside a reference, for want of motion."""
    assert cause.epsilon is not None
    return x.size > 0 and float(median_of(np.abs(cause.epsilon.value * x))) <= _OWN * measured.noise


def _lasting(big: NDArray[np.intp], at: NDArray[np.intp], measured: Measured) -> int:
    """Place of the first of the large deviations that no move of a moment makes; 0 without one."""
    ahead = np.searchsorted(at[big], at[big] + _EARLY_S / measured.dt) - np.arange(big.size)
    there = np.searchsorted(at, at[big] + _EARLY_S / measured.dt) - big
    lasts = big[2 * ahead > there]
    return int(lasts[0]) if lasts.size else 0


def _lasting_part(big: NDArray[np.intp], at: NDArray[np.intp], measured: Measured) -> slice:
    """Places from the first of the large deviations that no move of a moment makes to the last one; none without one."""
    first = _lasting(big, at, measured)
    last = at.size - 1 - _lasting(at.size - 1 - big[::-1], at[-1] - at[::-1], measured)
    return slice(first, last + 1) if big.size else slice(0, 0)


def _from_where_it_shows(cause: Cause, off: Array, x: Array, at: NDArray[np.intp], k: int, measured: Measured) -> Cause:
    """A steady cause from step k on, where a deviation shows, if it would have shown before as well."""
    if cause.changes or (at[k] - at[0]) * measured.dt < _EARLY_S:
        return cause
    expected = np.full(k, np.mean(off[k:])) if cause.epsilon is None else cause.epsilon.value * x[:k]
    absent = np.mean(off[:k] ** 2) < _MARKED**2 * np.mean(expected**2)
    return replace(cause, start=int(at[k])) if absent else cause


def _explanation(y: Array, x: Array, at: NDArray[np.intp], measured: Measured) -> Cause | None:
    """The cause that explains y beside x at some steps; where several do, a loss if it is one of them. None where none does."""
    if not (np.std(x) > 0.0 and np.std(y) > 0.0 and power(y - x, measured) > (_BEYOND * measured.noise) ** 2):
        return None
    found = list(causes(y, x, at, measured))
    steady, changing = (min((c for c in found if c.changes is flag), key=lambda c: c.left) for flag in (False, True))
    # what changes with time explains more than what does not, always
    clearly = changing.left <= _NOTHING and steady.left > max(_FAR * changing.left, _FAR_LEFT)
    best = changing if clearly or (steady.left > _LEFT and changing.left < steady.left) else steady
    # what a rival leaves where something moves counts, beyond what the best cause leaves there
    others = min((max(c.left, c.moves - best.moves) for c in found if c.mode is not best.mode), default=np.inf)
    rests = every_power(y - np.mean(y), measured) / max(every_power(y - x, measured), 1e-30)
    stuck = max(power(y - np.mean(y), measured) / max(power(y - x, measured), 1e-30), rests - best.moves)
    if best.left <= _NOTHING and not best.changes and others <= _NOTHING:
        losses = [c for c in found if c.mode is FaultMode.INEFFICIENT and not c.changes and c.left <= _NOTHING]
        noisy = _restless(y - _steadily(y, x), measured)
        return replace(losses[0], alone=False) if losses and not noisy else None
    steady_offset = not best.changes and best.epsilon is None
    if best.left > _LEFT or not _far(min(others, stuck), best, _NEAR if steady_offset else _RIVAL_LEFT):
        return _fading(y, x, found, stuck, measured)
    if not best.late and best.left > _NOTHING and float(np.corrcoef(x, y)[0, 1]) < _FOLLOWS:
        return None
    rest = _biased(y, x, measured)
    if best.changes:
        return best if _far(rest, best, _RIVAL_LEFT) else _fading(y, x, found, stuck, measured)
    if best.mode is FaultMode.INEFFICIENT and _restless(y - float(x @ y) / float(x @ x) * x, measured):
        return None
    return best if best.left < max(_NOTHING, _RIVAL * rest) else None


def _biased(y: Array, x: Array, measured: Measured) -> float:
    """Share of a deviation's power that a loss with a bias leaves, which is the row of noise."""
    gain, _ = np.linalg.lstsq(np.column_stack([x, np.ones(x.size)]), y, rcond=None)[0]
    rest = y - float(np.clip(gain, 0.0, 1.0)) * x
    return power(rest - np.mean(rest), measured) / max(power(y - x, measured), 1e-30)


def _fading(y: Array, x: Array, found: Sequence[Cause], stuck: float, measured: Measured) -> Cause | None:
    """A gain that fades and leaves nothing, whatever else may leave as little; None where that is not so, or noise is left beside its rivals."""
    fades = next((c for c in found if c.changes and c.epsilon is not None), None)
    steadily = next((c.left for c in found if c.epsilon is not None and not c.changes), None)
    if fades is None or steadily is None:  # a gain that is the same at both ends changes nothing
        return None
    if fades.mode is not FaultMode.INEFFICIENT or fades.left > _NOTHING or not _far(steadily, fades, _RIVAL_LEFT):
        return None
    steady = (c.left for c in found if c.mode is not fades.mode and (c.late or not c.changes))
    far = min(*steady, stuck) > _RIVAL_LEFT and _far(_biased(y, x, measured), fades, _RIVAL_LEFT)
    if not far and _restless(fades.rest, measured):
        return None
    return replace(fades, alone=False, clear=far)


def _steadily(y: Array, x: Array) -> Array:
    """What a gain and an offset together make of a reference [unit], shape (k,)."""
    line = np.column_stack([x, np.ones(x.size)])
    return np.asarray(line @ np.linalg.lstsq(line, y, rcond=None)[0])


def _restless(rest: Array, measured: Measured) -> bool:
    """Whether a reading is most of the time off what explains it by more than noise; `rest` [unit], shape (k,), is what that leaves."""
    usual = 1.4826 * float(median_of(np.abs(rest)))
    even = float(np.std(rest)) < _EVEN * usual
    return usual > (_STEADILY if even else _RESTLESS) * measured.noise


def _far(rival: float, best: Cause, least: float) -> bool:
    """Whether a rival leaves far more of the power than the best cause does; little is far beside nothing."""
    return rival >= (max(_FAR * best.left, _FAR_LEFT) if best.left <= _NOTHING else max(_RIVAL * best.left, least))


def _said(cause: Cause) -> tuple[float, float, tuple[str, ...]]:
    """How probable a cause is, and an offset or a drift in its place, and a sentence on its rivals, if it has any."""
    if cause.alone:
        return _P, 0.0, ()
    if not cause.changes:
        return _P_EITHER, _P_OFFSET, (_EITHER,)
    return (_P_FADES, _P_DRIFTS, (_EITHER_DRIFTS,)) if cause.clear else (_P_UNCLEAR, _P_UNCLEAR_DRIFTS, (_UNCLEAR,))


def joined(near: Sequence[Finding], cause: Cause) -> Finding:
    """One finding over all pieces."""
    longest = max(near, key=lambda f: f.stop - f.start)
    p, offset, rival = _said(cause)
    stated = {cause.mode.value, *(() if cause.alone else (FaultMode.OUTSIDE_TABLE.value,))}
    rest = {h.mode: h for h in longest.hypotheses if h.mode not in stated}
    total = sum(h.p for h in rest.values())
    left = 1.0 - p - offset
    others = (
        [replace(h, p=left * h.p / total) for h in rest.values()] if total > 0.0 else [replace(_NOTHING_WRONG, p=left)]
    )
    if offset:
        others.append(Hypothesis(longest.side.value, FaultMode.OUTSIDE_TABLE.value, offset))
    named = Hypothesis(longest.side.value, cause.mode.value, p)
    start = near[0].start if cause.start is None else cause.start
    stop = max(f.stop for f in near) if cause.stop is None else cause.stop
    raised = [f.detected for f in near if f.detected is not None and start <= f.detected < stop]
    figures = tuple(e for e in longest.evidence if is_about(e, About.DEVIATION, About.CASES, About.TIMES))
    pieces = f"This alone leaves {100 * cause.left:.0f} % of the deviation's power over {len(near)} pieces that were found one after the other."
    return replace(
        longest,
        start=start,
        stop=stop,
        mode=cause.mode,
        probability=p,
        hypotheses=(named, *sorted(others, key=lambda h: -h.p)),
        epsilon=cause.epsilon,
        sat=None,
        evidence=(cause.words, *rival, *((pieces,) if len(near) > 1 else ()), *figures),
        detected=min(raised, default=None),
    )
