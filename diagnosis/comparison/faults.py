"""Faults of two missions of one machine, matched by component, side and row; times differ and are not compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.comparison.found import FoundFault, Sides, keys_of
from diagnosis.comparison.gone import Newer, why_not_resolved
from diagnosis.comparison.losses import Losses, loss_change
from diagnosis.decision.wording import join_words
from diagnosis.results.candidates import unclear_words
from diagnosis.results.comparison_document import Change, Status, Trend
from diagnosis.results.fault_rows import mode_words
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Kind, Severity, Tier
from replay.faults import FaultMode, Side

_LONGER, _LEAST_S = 2.0, 1.0


@dataclass(frozen=True)
class FaultChange:
    """What became of one fault.

    Attributes
    ----------
    status : Status
        ``new``, ``changed``, ``unchanged``, ``resolved``, or ``not_seen_again``: gone while nothing shows that it is
        repaired, because the side was not assessed, or because the fault came and went in the older mission as well.
    trend : Trend
        Of a changed fault: ``worse``, ``better``, or ``other``; else empty.
    component, kind, side, mode : str, Kind, Side, FaultMode
        Of the newer fault, else of the older one.
    older, newer : FoundFault or None
        The fault in either mission.
    changes : tuple[Change, ...]
        ``row``, ``side``, ``severity``, ``epsilon``, ``duration``, ``loss`` (that of its part over the whole mission): what
        changed.
    note : str
        Sentence about what limits the statement; may be empty.
    """

    status: Status
    trend: Trend
    component: str
    kind: Kind
    side: Side
    mode: FaultMode
    older: FoundFault | None
    newer: FoundFault | None
    changes: tuple[Change, ...] = ()
    note: str = ""


def is_worse(change: FaultChange) -> bool:
    """Whether a fault is new or worse and of at least low severity."""
    found = change.newer
    return (
        found is not None
        and found.severity is not Severity.INFO
        and (change.status == "new" or change.trend == "worse")
    )


def match_faults(
    older: Sequence[FoundFault],
    newer: Sequence[FoundFault],
    older_sides: Sides,
    seen: Newer,
    words: MachineWords,
    losses: Losses | None = None,
) -> list[FaultChange]:
    """Match faults one to one: same side and row, then same row where one side is not told apart, then same side.

    Faults whose kind is unclear are of the same row where they may be.

    Parameters
    ----------
    older, newer : Sequence[FoundFault]
        From `found_faults`.
    older_sides : Mapping
        What was assessed in the older mission, by component and side.
    seen : Newer
        What the newer mission could show.
    words : MachineWords
        How to speak of the machine.
    losses : Losses or None
        Mission-wide ε̂ [1] of the parts in both missions.

    Returns
    -------
    list[FaultChange]
        New and worse ones first, then what else changed, what is gone, and what stayed.
    """
    left, out = list(older), []
    open_: list[FoundFault] = list(newer)
    for alike in (_same, _maybe_same, _same_row, _same_side):
        rest = []
        for b in open_:
            a = next((a for a in left if a.component == b.component and alike(a, b)), None)
            if a is None:
                rest.append(b)
                continue
            left.remove(a)
            out.append(_both(a, b, losses or {}))
        open_ = rest
    out += [_change("new", None, b, note=_unseen_before(b, older_sides, words)) for b in open_]
    for a in left:
        why = why_not_resolved(a, seen, words)
        out.append(
            _change("not_seen_again" if why else "resolved", a, None, note=why or _other_faults(a, newer, words))
        )
    return sorted(out, key=_order)


def _order(c: FaultChange) -> tuple[int, int, str, str, str]:
    rank = ("new", "worse", "other", "better", "not_seen_again", "resolved", "unchanged").index(c.trend or c.status)
    fault = c.newer or c.older
    severity = fault.severity.rank if fault else 0
    return rank, -severity, c.component, c.side, c.mode


def _same(a: FoundFault, b: FoundFault) -> bool:
    return a.side == b.side and a.mode == b.mode


def _maybe_same(a: FoundFault, b: FoundFault) -> bool:
    return a.side == b.side and _may_be_one_row(a, b)


def _may_be_one_row(a: FoundFault, b: FoundFault) -> bool:
    """Whether two faults are of one row, or may be: one whose kind is unclear may be of any of its rows."""
    return not {a.mode.value, *a.rows}.isdisjoint({b.mode.value, *b.rows}) if a.rows or b.rows else a.mode == b.mode


def _same_row(a: FoundFault, b: FoundFault) -> bool:
    return a.mode == b.mode and Side.SENSOR_OR_ACTUATOR in (a.side, b.side)


def _same_side(a: FoundFault, b: FoundFault) -> bool:
    return a.side == b.side


def _change(
    status: Status,
    a: FoundFault | None,
    b: FoundFault | None,
    trend: Trend = "",
    changes: tuple[Change, ...] = (),
    note: str = "",
) -> FaultChange:
    fault = b or a
    assert fault is not None
    return FaultChange(status, trend, fault.component, fault.kind, fault.side, fault.mode, a, b, changes, note)


def _both(a: FoundFault, b: FoundFault, losses: Losses) -> FaultChange:
    """A fault of both missions."""
    loss = _loss(a, b, losses)
    severity, epsilon, duration = _sign(a.severity.rank, b.severity.rank), _epsilon(a, b), _duration(a, b)
    differs: dict[Change, bool] = {
        "row": not _may_be_one_row(a, b),
        "side": a.side != b.side,
        "severity": bool(severity),
        "epsilon": bool(epsilon),
        "duration": bool(duration),
        "loss": bool(loss),
    }
    changes = tuple(name for name, is_so in differs.items() if is_so)
    if not changes:
        return _change("unchanged", a, b)
    signs = [severity] if severity else [epsilon, duration, loss]
    return _change("changed", a, b, "worse" if 1 in signs else "better" if -1 in signs else "other", changes)


def _sign(a: float, b: float) -> int:
    return (b > a) - (b < a)


def _epsilon(a: FoundFault, b: FoundFault) -> int:
    """+1 or −1 where ε̂ of the fault grew or shrank; 0 between different rows."""
    x, y = a.epsilon, b.epsilon
    return 0 if x is None or y is None or a.mode != b.mode else loss_change(x, y)


def _loss(a: FoundFault, b: FoundFault, losses: Losses) -> int:
    """+1 or −1 where the loss of the part over the whole mission grew or shrank, of a fault that is such a loss in both."""
    if not a.mode is b.mode is FaultMode.INEFFICIENT:
        return 0
    signs = [loss_change(*losses[key]) for key in keys_of(b.component, b.side) if key in losses]
    return 1 if 1 in signs else -1 if -1 in signs else 0


def _duration(a: FoundFault, b: FoundFault) -> int:
    """+1 or −1 where time and share of the judged time both changed by more than a factor of two, and by a second."""
    if abs(a.seconds - b.seconds) < _LEAST_S:
        return 0
    pairs = [(a.seconds, b.seconds)]
    if a.share is not None and b.share is not None:
        pairs.append((a.share, b.share))
    if all(y > _LONGER * x for x, y in pairs):
        return 1
    return -1 if all(x > _LONGER * y for x, y in pairs) else 0


def _unseen_before(b: FoundFault, sides: Sides, words: MachineWords) -> str:
    keys = keys_of(b.component, b.side)
    for key in keys:
        side = sides.get(key)
        if side is None or not side.assessed:
            part = "This part" if len(keys) == 1 else f"The {words.part_name(b.kind, key[1])}"
            how = "not judged" if side is None else side.short_words
            return f"{part} was {how} in the older mission: the fault may be older."
    return ""


def _words(f: FoundFault) -> str:
    return unclear_words(f.side, f.rows) if f.rows else mode_words(f.side, f.mode)


def _other_faults(a: FoundFault, newer: Sequence[FoundFault], words: MachineWords) -> str:
    """Say that a part whose fault is gone has another one, or that its fault may be taken for one of the other side."""
    keys = set(keys_of(a.component, a.side))
    near = [b for b in newer if b.component == a.component and b.severity is not Severity.INFO]
    own = [b for b in near if keys & set(keys_of(b.component, b.side))]
    if own:
        modes = join_words(list(dict.fromkeys(_words(b) for b in own)))
        return f"The part is not healthy: in the newer mission it is {modes}."
    other = next((b for b in near if Tier.DIRECT not in (a.tier, b.tier)), None)
    if other is None:
        return ""
    return (
        f"In the newer mission the {words.part_words(other.kind, other.component, other.side)} is "
        f"{_words(other)}; without second measurements one can be taken for the other."
    )
