"""Driving time by true row and reported state, exact between the times at which anything changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.evaluation.aligned import Compared
from diagnosis.evaluation.counts import BANDS, COLUMNS, CONTACT, EPSILON_BANDS, SIDES, TRUE_STATES, Counts, band_of
from diagnosis.evaluation.spans import Span, codes_at, covered, length
from replay.faults import Side

Array = NDArray[np.float64]
Codes = NDArray[np.int64]

_HEALTHY, _INEFFICIENT = TRUE_STATES.index("healthy"), TRUE_STATES.index("inefficient")
_UNDECIDED = COLUMNS.index("undecided")
_FREE, _SLIP, _MASKED = range(len(CONTACT))


def state_time(group: Compared) -> Counts:
    """Count the time of all components; the events are left out."""
    total = Counts()
    healthy, by_speed, by_contact = [], [], []
    for component in group.states:
        _add_component(group, component, total)
        spans = _without_faults(group, component)
        healthy.append(group.window[1] - group.window[0] - length(group.faulty[component]))
        by_speed.append(spans["speed"])
        by_contact.append(spans["contact"])
    parts = {"speed": np.mean(by_speed, axis=0), "contact": np.mean(by_contact, axis=0)}
    return Counts(
        seconds=total.seconds,
        healthy_s=float(np.mean(healthy)),
        parts=total.parts,
        healthy_parts=dict(total.healthy_parts) | parts,
    )


def _pieces(
    group: Compared, component: str, more: Sequence[tuple[float, float, int]]
) -> tuple[Array, Array, Array, Codes, Codes]:
    """Cut the window where anything of a component changes: ends, middles, and codes of speed (−1 unknown) and slip."""
    speed = [] if group.speeds is None else group.speeds.bands(component, group.shift)
    spans: list[Span] = [*group.driving[component], *group.masked[component], *group.slip[component], group.window]
    spans += [(a, b) for a, b, _ in (*more, *speed)]
    cuts = np.unique(np.clip(np.array(spans).ravel(), *group.window))
    middle = (cuts[1:] + cuts[:-1]) / 2
    slips = codes_at(middle, [(a, b, _SLIP) for a, b in group.slip[component]], _FREE)
    return cuts[:-1], cuts[1:], middle, codes_at(middle, speed, -1), slips


def _inside(start: Array, stop: Array, spans: Sequence[Span]) -> NDArray[np.bool_]:
    """Pieces that lie within spans; the pieces are cut at their ends."""
    return np.asarray(covered(stop, spans) > covered(start, spans))


def _without_faults(group: Compared, component: str) -> dict[str, Array]:
    """Driving time without a fault of a component, by speed and contact [s]."""
    start, stop, _, speed, slips = _pieces(group, component, [(a, b, 0) for a, b in group.faulty[component]])
    keep = _inside(start, stop, group.driving[component]) & ~_inside(start, stop, group.faulty[component])
    width = stop - start
    out = {name: np.zeros(BANDS[name]) for name in ("speed", "contact")}
    np.add.at(out["contact"], slips[keep], width[keep])
    keep &= speed >= 0
    np.add.at(out["speed"], speed[keep], width[keep])
    return out


def _add_component(group: Compared, component: str, total: Counts) -> None:
    """Add the driving time of a component to the confusions of both sides (in place)."""
    mine = [f for f in group.faults if f.truth.component == component]
    true = {
        s: [
            (f.start, f.stop, _index(f.truth.mode, TRUE_STATES, -1), band_of(f.truth.epsilon, EPSILON_BANDS))
            for f in mine
            if f.truth.side == s
        ]
        for s in SIDES
    }
    told = {s: [(a, b, _index(m, COLUMNS, _UNDECIDED)) for a, b, m in group.states[component][s]] for s in SIDES}
    either = [
        (float(a), float(b), _index(r["mode"], COLUMNS, _UNDECIDED))
        for a, b, r in zip(group.start, group.stop, group.rows, strict=True)
        if r["component"] == component and r["side"] == Side.SENSOR_OR_ACTUATOR
    ]
    coded = [*either, *(f[:3] for s in SIDES for f in true[s]), *(span for s in SIDES for span in told[s])]
    start, stop, t, speed, slips = _pieces(group, component, coded)
    width = stop - start
    row = {s: codes_at(t, [f[:3] for f in true[s]], _HEALTHY) for s in SIDES}
    claim = codes_at(t, either, -1)
    drives = _inside(start, stop, group.driving[component])
    for side, other in (SIDES, SIDES[::-1]):
        column = np.where(claim < 0, codes_at(t, told[side], _UNDECIDED), _union_column(claim, row[side], row[other]))
        counted = drives & (row[side] >= 0)
        hidden = _inside(start, stop, group.hidden(component, side))
        keep = counted & ~hidden
        np.add.at(total.seconds[side], (row[side][keep], column[keep]), width[keep])
        epsilon = codes_at(t, [(a, b, band) for a, b, _, band in true[side]], -1)
        contact = np.where(hidden, _MASKED, slips)
        for name, band, use in (("epsilon", epsilon, keep), ("speed", speed, keep), ("contact", contact, counted)):
            of_band = use & (band >= 0)
            place = (band[of_band], row[side][of_band], column[of_band])
            np.add.at(total.parts[name][side], place, width[of_band])


def _index(name: str, names: Sequence[str], default: int) -> int:
    return names.index(name) if name in names else default


def _union_column(claim: Codes, mine: Codes, other: Codes) -> Codes:
    """Column of one side where a fault of either side was reported.

    Where one side is inefficient as claimed, the claim stands for that side and says nothing bad of a healthy other.
    Where both sides are healthy it is wrong on both. Any other truth leaves the side undecided: the claim names none.
    """
    fulfilled = (claim == _INEFFICIENT) & ((mine == _INEFFICIENT) | (other == _INEFFICIENT))
    false = (mine == _HEALTHY) & (other == _HEALTHY)
    stands = np.where((mine == _INEFFICIENT) | (mine == _HEALTHY), mine, _UNDECIDED)
    return np.where(fulfilled, stands, np.where(false, claim, _UNDECIDED))
