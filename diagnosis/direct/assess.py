"""Direct evidence: a measurement beside an independent one of the same quantity.

L4 with v against v_true for a sensor, L8 with u_applied against u_a for an actuator; the same for steering angles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.debounce import FLICKER_S, debounced
from diagnosis.channels.sample_status import PAIR, SILENT
from diagnosis.direct.columns import evidence_columns
from diagnosis.direct.consistency import with_consistent
from diagnosis.direct.findings import FaultsFound, find_faults
from diagnosis.direct.identification import IdentifiedPair, identify
from diagnosis.direct.inputs import Pair
from diagnosis.estimation.viterbi import most_probable
from diagnosis.results.assessment import CODE, Assessment
from diagnosis.results.evidence_columns import steps_of
from diagnosis.results.loss import loss_of
from diagnosis.results.plain_numbers import plain
from diagnosis.results.sizes import amount, not_reported
from diagnosis.results.vocabulary import Tier
from replay.faults import Side, State
from replay.machine.config import Limits

_WEARING = (CODE[State.HEALTHY], CODE[State.INEFFICIENT])


def assess_pair(pair: Pair, limits: Limits) -> Assessment:
    """Judge a channel by its reference.

    Parameters
    ----------
    pair : Pair
        Channel, reference and circumstances.
    limits : Limits
        Smallest ε and saturation term that count.
    """
    return assess_identified(identify(pair, limits), limits)


def assess_identified(found: IdentifiedPair, limits: Limits) -> Assessment:
    """Judge a channel by its reference, as `assess_pair` does."""
    pair = found.pair
    path = most_probable(with_consistent(found.samples, found.model.noise), found.model, pair.store)
    faults = find_faults(path, found, limits)
    states = _states(found, faults)
    y, x, status, *_ = found.samples
    pictured = evidence_columns(found, path, steps_of(faults.findings, x.size, pair.dt))
    return Assessment(
        states=states,
        reasons=_reasons(pair.side),
        findings=tuple(faults.findings),
        columns=pictured.columns,
        closeups=pictured.closeups,
        loss=loss_of(y, x, (status == PAIR) & np.isin(states, _WEARING), pair.dt),
        tier=Tier.DIRECT,
        notes=_notes(found, faults.below),
    )


def _states(found: IdentifiedPair, faults: FaultsFound) -> NDArray[np.int8]:
    """State of every sample: faults, healthy where something moves, else not excited or no data."""
    pair, unresolved = found.pair, found.unresolved.copy()
    for run in faults.timing:
        unresolved[run.start : run.stop] = True
    brief = round(FLICKER_S / pair.dt)
    quiet = ~debounced(~pair.quiet, brief, brief)
    states = np.where(quiet, CODE[State.NOT_EXCITED], CODE[State.HEALTHY]).astype(np.int8)
    known = np.isfinite(pair.y) & np.isfinite(pair.x)
    states[~known & (found.samples.status != SILENT)] = CODE[State.NO_DATA]
    states[unresolved & known] = CODE[State.NOT_ASSESSED]
    for f in faults.findings:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    return states


def _reasons(side: Side) -> dict[State, str]:
    """Why a state that is no judgement was given."""
    return {
        State.NOT_EXCITED: "the {valve} is commanded to rest, and rests"
        if side is Side.ACTUATOR
        else "nothing moves, by both measurements",
        State.NO_DATA: "no samples",
        State.NOT_ASSESSED: "the command changes faster than the log's rate or the {valve}'s lag can resolve"
        if side is Side.ACTUATOR
        else "the residual may come from a delay or from the rounding of the channel",
    }


def _notes(found: IdentifiedPair, below: int) -> tuple[str, ...]:
    """Figures that the judgement used."""
    pair = found.pair
    relation, ms = found.relation, 1e3
    parts = [
        f"{pair.y_name} against {pair.x_name}: noise {amount(found.model.noise, pair.unit, 2)}",
        f"rounding step {amount(found.lsb, pair.unit, 2)}",
        f"delay {plain(relation.delay * pair.dt * ms)} ms",
    ]
    if relation.lag:
        parts.append(f"lag {plain(relation.lag * ms, 2)} ms")
    if relation.play:
        parts.append(f"hysteresis {amount(relation.play, pair.unit, 2)}")
    if pair.habit.travel:
        parts.append(f"values held for {plain(pair.habit.travel, 2)} m of travel")
    elif pair.habit.stepwise:
        parts.append(f"values held for {plain(pair.habit.window * ms, 2)} ms")
    figures = ", ".join(parts) + "."
    if not below:
        return (figures,)
    return (
        figures,
        not_reported(below, pair.y_name),
    )
