"""The figures of an evaluation, from its counts: over all, by severity and by excitation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import inf
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from diagnosis.evaluation.confusion import confusion_figures, mean
from diagnosis.evaluation.counts import (
    COLUMNS,
    CONTACT,
    EPSILON_BANDS,
    REPORT_OUTCOMES,
    SIDES,
    SPEED_BANDS,
    Counts,
    FaultOutcome,
    ReportOutcome,
    band_of,
)
from diagnosis.evaluation.document import (
    SCHEMA,
    AllFigures,
    BandFigures,
    ContactFigures,
    Figures,
    MissionFigures,
    ModeFigures,
    ResultRow,
    ScoresDocument,
)
from diagnosis.evaluation.evaluate import MissionScores
from diagnosis.evaluation.event_scores import event_figures, precision_of, recall_of
from diagnosis.evaluation.reliability import probability_bins, reliability
from diagnosis.results.result import to_json
from diagnosis.results.vocabulary import Severity
from replay.faults import TOTAL, Side

Array = NDArray[np.float64]

_DRIVING_BANDS = ((0.0, 0.5), (0.5, 0.9), (0.9, 1.0))
_T = TypeVar("_T")


def figures(counts: Counts) -> Figures:
    """All figures as JSON values; None where there is nothing to divide by.

    Parameters
    ----------
    counts : Counts
        Of one mission or of many.

    Returns
    -------
    Figures
        ``sides``, ``events``, ``onset_error_s``, ``detection_delay_s``, ``end_error_s``, ``epsilon``,
        ``false_alarms``; the same by row in ``modes`` and by band in ``by_epsilon``, ``by_speed`` and ``by_contact``;
        recall ``by_excitation`` (share of driving), precision ``by_severity`` as reported; ``reliability``, and its
        bins over all as ``calibration``.
    """
    judged = [r for r in counts.reports if r.outcome in REPORT_OUTCOMES]
    return {
        **_all_figures(counts.faults, judged, counts.seconds, counts.healthy_s),
        "modes": _modes(counts, judged),
        "by_epsilon": _by_epsilon(counts, judged),
        "by_speed": _by_speed(counts, judged),
        "by_contact": _by_contact(counts, judged),
        "by_excitation": [
            {"low": low, "high": high, **recall_of(mine)}
            for (low, high), mine in _split(
                counts.faults, lambda f: band_of(f.driving_share, _DRIVING_BANDS), _DRIVING_BANDS
            )
        ],
        "by_severity": [
            {"severity": s, **precision_of([r for r in judged if r.severity == s])} for s in reversed(Severity)
        ],
        "reliability": reliability(judged),
        "calibration": probability_bins(judged),
    }


def scores_document(
    names: Sequence[tuple[str, str]], scores: Sequence[MissionScores], pooled: Mapping[str, Figures]
) -> ScoresDocument:
    """The document of an evaluation.

    Parameters
    ----------
    names : Sequence[tuple[str, str]]
        Result and truth file of each mission.
    scores : Sequence[MissionScores]
        Counts of each.
    pooled : Mapping[str, Figures]
        Figures of all missions together, by group.
    """
    rows = [_result_row(result, truth, mission) for (result, truth), mission in zip(names, scores, strict=True)]
    return {"schema": SCHEMA, "results": rows, "all": dict(pooled)}


def _result_row(result: str, truth: str, mission: MissionScores) -> ResultRow:
    row: ResultRow = {
        "result": result,
        "truth": truth,
        "left_out": list(mission.left_out),
        "not_driven": list(mission.not_driven),
    }
    if "wheel" in mission.groups:
        row["wheel"] = _mission_figures(mission.groups["wheel"])
    if "steer" in mission.groups:
        row["steer"] = _mission_figures(mission.groups["steer"])
    return row


def _mission_figures(counts: Counts) -> MissionFigures:
    return {
        **figures(counts),
        "faults": [to_json(f) for f in counts.faults],
        "reported": [to_json(r) for r in counts.reports],
    }


def _all_figures(
    faults: Sequence[FaultOutcome], judged: Sequence[ReportOutcome], seconds: Mapping[str, Array], healthy_s: float
) -> AllFigures:
    sides = {side: confusion_figures(seconds[side]) for side in SIDES}
    return {"sides": sides, **event_figures(faults, judged, healthy_s)}


def _split(
    items: Sequence[_T], band: Callable[[_T], int | None], bands: Sequence[tuple[float, float]]
) -> list[tuple[tuple[float, float], list[_T]]]:
    """Items of each band."""
    places = [band(item) for item in items]
    return [(edges, [x for x, p in zip(items, places, strict=True) if p == k]) for k, edges in enumerate(bands)]


def _modes(counts: Counts, judged: Sequence[ReportOutcome]) -> list[ModeFigures]:
    """By row of the tables; a report of either side belongs to both."""
    out: list[ModeFigures] = []
    for side in SIDES:
        rows = confusion_figures(counts.seconds[side])["rows"]
        for mode in sorted({f.mode for f in counts.faults if f.side == side}, key=COLUMNS.index):
            mine = [f for f in counts.faults if (f.side, f.mode) == (side, mode)]
            reported = [r for r in judged if r.mode == mode and r.side in (side, Side.SENSOR_OR_ACTUATOR)]
            out.append(
                {
                    "side": side,
                    "mode": mode,
                    **recall_of(mine),
                    "epsilon_mae": mean([f.epsilon_error for f in mine if f.outcome == "right"]),
                    "time": rows.get(mode),
                    **event_figures(mine, reported, counts.healthy_s),
                }
            )
    return out


def _by_epsilon(counts: Counts, judged: Sequence[ReportOutcome]) -> list[BandFigures]:
    """By true ε: its faults beside all fault-free time; reports by their ε̂, which is 1 for stuck and silent ones."""

    def band(r: ReportOutcome) -> int | None:
        epsilon = 1.0 if r.mode in TOTAL else r.epsilon
        return None if epsilon is None else band_of(epsilon, EPSILON_BANDS)

    faults = _split(counts.faults, lambda f: band_of(f.epsilon, EPSILON_BANDS), EPSILON_BANDS)
    reports = _split(judged, band, EPSILON_BANDS)
    out: list[BandFigures] = []
    for k, (((low, high), mine), (_, said)) in enumerate(zip(faults, reports, strict=True)):
        seconds = {side: counts.parts["epsilon"][side][k].copy() for side in SIDES}
        for side in SIDES:
            seconds[side][0] = counts.seconds[side][0]
        out.append({"low": low, "high": high, **recall_of(mine), **_all_figures(mine, said, seconds, counts.healthy_s)})
    return out


def _by_speed(counts: Counts, judged: Sequence[ReportOutcome]) -> list[BandFigures]:
    """By commanded speed; faults and reports by their mean. Empty where no result held it."""
    if not any(counts.parts["speed"][side].any() for side in SIDES):
        return []

    def band(x: FaultOutcome | ReportOutcome) -> int | None:
        return None if x.speed is None else band_of(x.speed, SPEED_BANDS)

    out: list[BandFigures] = []
    pairs = zip(_split(counts.faults, band, SPEED_BANDS), _split(judged, band, SPEED_BANDS), strict=True)
    for k, (((low, high), mine), (_, said)) in enumerate(pairs):
        seconds = {side: counts.parts["speed"][side][k] for side in SIDES}
        healthy_s = float(counts.healthy_parts["speed"][k])
        out.append(
            {
                "low": low,
                "high": None if high == inf else high,
                **recall_of(mine),
                **_all_figures(mine, said, seconds, healthy_s),
            }
        )
    return out


def _by_contact(counts: Counts, judged: Sequence[ReportOutcome]) -> list[ContactFigures]:
    """By what the tyre and a fault of the sensor let through; faults and reports by what held most of their driving.

    ``masked`` shows what was said of actuators that could not be judged; it is part of no other figure.
    """

    def contact(x: FaultOutcome | ReportOutcome) -> str:
        return "masked" if x.outcome == "masked" else "slip" if x.slip_share > 0.5 else "free"

    out: list[ContactFigures] = []
    for k, name in enumerate(CONTACT):
        mine, said = [f for f in counts.faults if contact(f) == name], [r for r in judged if contact(r) == name]
        seconds = {side: counts.parts["contact"][side][k] for side in SIDES}
        healthy_s = float(counts.healthy_parts["contact"][k])
        out.append({"contact": name, **recall_of(mine), **_all_figures(mine, said, seconds, healthy_s)})
    return out
