"""A valve that is off its command now one way, now another: one disturbance, and not as many faults as it has rows.

What a disturbance adds changes, and passes through nothing: for a second or two the valve is where it should be, or off by what
looks like a loss or a valve that is stuck. Pieces of one valve with less healthy time between them than they last are one fault.
Each row of the tables is as probable as in the piece that speaks most against it; what none of them explains throughout is noise, where
a piece is, or in no row. That a valve stays where it is, or is dead, is not averaged away: it keeps its share of the time, and a
piece of some length that surely is that stays a fault of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.decision.episodes import without_healthy_between
from diagnosis.decision.severity import PROBABLY_TOTAL, risk_of
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.limited import believed
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import TOTAL, FaultMode, Side, State

_QUIET_S = 4.0  # healthy between two pieces: more ends a fault, as does more than either of them lasts
_SURE = 0.9  # of two pieces of different rows: two faults
_MOMENT_S, _SHARE = (
    1.0,
    0.2,
)  # of a piece that surely is stuck or dead, and of the fault around it: less is a moment of that
_NAMED = 4
Part = tuple[str, str]
Row = tuple[str, str]


def with_disturbances_as_one(assessments: Mapping[Part, Assessment], dt: float) -> dict[Part, Assessment]:
    """Assessments in which pieces of one disturbance of a valve that is measured are one finding, with their course.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    dt : float
        Step [s].
    """
    return {
        part: _joined(a, dt) if part[1] == Side.ACTUATOR and len(a.findings) > 1 else a
        for part, a in assessments.items()
    }


def _joined(a: Assessment, dt: float) -> Assessment:
    measured = sorted((f for f in a.findings if _measured(f)), key=lambda f: f.start)
    told, pieces = [f for f in a.findings if not _measured(f)], list[Finding]()
    states = a.states.copy()
    for chain in _chains(measured, a, dt):
        one = _one(chain, dt)
        if one is None:
            told += chain
            continue
        told.append(one)
        pieces += chain
        for f in chain:
            inside = states[f.start : f.stop]
            inside[inside == CODE[State(f.mode.value)]] = CODE[State(one.mode.value)]
    if not pieces:
        return a
    joined = believed(replace(a, states=states, findings=tuple(sorted(told, key=lambda f: f.start))))
    return without_healthy_between(joined, pieces)


def _measured(f: Finding) -> bool:
    return f.side is Side.ACTUATOR and f.tier is Tier.DIRECT


def _chains(findings: Sequence[Finding], a: Assessment, dt: float) -> list[list[Finding]]:
    """Findings in order of time, those together that may be one."""
    chains: list[list[Finding]] = []
    for f in findings:
        if chains and _goes_on(chains[-1], f, a, dt):
            chains[-1].append(f)
        else:
            chains.append([f])
    return [part for chain in chains for part in _without_dead(chain, dt)]


def _goes_on(chain: Sequence[Finding], f: Finding, a: Assessment, dt: float) -> bool:
    """Whether less is healthy between a chain and the next finding than either of them lasts, and not both are sure of rows that differ."""
    sure = {g.mode for g in chain if g.probability >= _SURE and not _brief(g, dt)}
    if sure and f.probability >= _SURE and not _brief(f, dt) and f.mode not in sure:
        return False
    last = max(g.stop for g in chain)
    quiet = np.count_nonzero(a.states[last : f.start] == CODE[State.HEALTHY]) * dt
    longer = max(last - chain[0].start, f.stop - f.start) * dt
    return bool(quiet <= min(_QUIET_S, longer))


def _without_dead(chain: list[Finding], dt: float) -> list[list[Finding]]:
    """A chain parted at pieces that surely are stuck or dead, and for more than a moment of it."""
    whole = sum(f.stop - f.start for f in chain)
    out: list[list[Finding]] = [[]]
    for f in chain:
        if _is_dead(f, whole, dt):
            out += [[f], []]
        else:
            out[-1].append(f)
    return [part for part in out if part]


def _is_dead(f: Finding, whole: int, dt: float) -> bool:
    """Whether a piece surely is stuck or dead, for more than a moment of a chain of `whole` steps of faults."""
    return risk_of(f) >= PROBABLY_TOTAL and not (_brief(f, dt) and f.stop - f.start < _SHARE * whole)


def _brief(f: Finding, dt: float) -> bool:
    return (f.stop - f.start) * dt < _MOMENT_S


def _one(chain: Sequence[Finding], dt: float) -> Finding | None:
    """A chain as one finding; None where it is one already, or pieces of the one row that may come and go."""
    rows = {f.mode for f in chain}
    if len(chain) < 2 or (len(rows) == 1 and not chain[0].mode.varying):
        return None
    p = _rows(chain)
    side = chain[0].side.value
    own = {row: x for row, x in p.items() if row[0] == side and row[1] != State.HEALTHY.value}
    best = max(own, key=lambda row: (own[row], row[1] == FaultMode.NOISY.value))
    mode = FaultMode(best[1])
    alike = [f for f in chain if f.mode is mode] or list(chain)
    longest = max(alike, key=lambda f: f.stop - f.start)
    known = [f.detected for f in chain if f.detected is not None]
    return replace(
        longest,
        start=chain[0].start,
        stop=max(f.stop for f in chain),
        mode=mode,
        probability=own[best],
        hypotheses=tuple(sorted((Hypothesis(*row, x) for row, x in p.items() if x > 0.0), key=lambda h: -h.p)),
        epsilon=None if mode.total else _size(chain),
        sat=longest.sat if len(rows) == 1 else None,
        course=(*longest.course, _course(chain, longest, dt)),
        detected=min(known) if known else None,
    )


def _rows(chain: Sequence[Finding]) -> dict[Row, float]:
    """How probable each row is of all pieces together [1]; sums up to 1."""
    side = chain[0].side.value
    length = np.array([f.stop - f.start for f in chain], dtype=np.float64)
    weight = length / length.sum()
    each = [_by_row(f) for f in chain]
    healthy = float(sum(w * p.get(("none", State.HEALTHY.value), 0.0) for w, p in zip(weight, each, strict=True)))
    fits, total = dict[Row, float](), dict[Row, float]()
    for mode in FaultMode:
        row = (side, mode.value)
        if mode.total:
            total[row] = float(sum(w * p.get(row, 0.0) for w, p in zip(weight, each, strict=True)))
        else:
            fits[row] = min(p.get(row, 0.0) / max(x for r, x in p.items() if r[0] == side) for p in each)
    rest = 1.0 - max(fits.values())
    noise = any(f.mode.varying for f in chain)
    for mode, share in ((FaultMode.NOISY, 0.5 * noise), (FaultMode.OUTSIDE_TABLE, 1.0 - 0.5 * noise)):
        fits[side, mode.value] += share * rest
    left = max(0.0, 1.0 - healthy - sum(total.values()))
    scale = left / sum(fits.values())
    return {
        ("none", State.HEALTHY.value): healthy,
        **total,
        **{row: scale * x for row, x in fits.items()},
    }


def _by_row(f: Finding) -> dict[Row, float]:
    """Hypotheses of one piece by row, all that are healthy as one."""
    out: dict[Row, float] = {}
    for h in f.hypotheses:
        row = ("none", h.mode) if h.mode == State.HEALTHY.value else (h.side, h.mode)
        out[row] = out.get(row, 0.0) + h.p
    return out


def _size(chain: Sequence[Finding]) -> Epsilon | None:
    """ε̂ of the pieces whose row has one, each by its time, between the least and the most that any of them may have lost."""
    known = [(f.epsilon, f.stop - f.start) for f in chain if f.epsilon is not None and f.mode not in TOTAL]
    if not known:
        return None
    mean = sum(e.value * n for e, n in known) / sum(n for _, n in known)
    return Epsilon(mean, min(e.low for e, _ in known), max(e.high for e, _ in known))


def _course(chain: Sequence[Finding], longest: Finding, dt: float) -> str:
    """What the pieces look like, in a sentence."""
    spans = ", ".join(f"{f.start * dt:.1f}–{f.stop * dt:.1f} s" for f in chain[:_NAMED])
    more = f" and {len(chain) - _NAMED} more" if len(chain) > _NAMED else ""
    looks = len({f.mode for f in chain})
    rows = f", which look like {looks} rows in turn" if looks > 1 else ""
    return (
        f"It shows in {len(chain)} stretches ({spans}{more}){rows}; between them less was healthy than they last: one fault that comes and goes. "
        f"Readings and sizes above are of {longest.start * dt:.1f}–{longest.stop * dt:.1f} s."
    )
