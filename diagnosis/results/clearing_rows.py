"""Rows of `report.json` on what stands behind an all-clear: its checks, and what the mission would have shown."""

from __future__ import annotations

from typing import TypedDict

from diagnosis.results.document_numbers import Seconds


class ClearingRow(TypedDict):
    """One check behind an all-clear: a fault of the size `LimitsRow.clear_at` would have been beyond the limit for three seconds.

    `worst` and `limit` are shares [1], s for delays, rad for angles, and natural logarithms of a ratio for what is compared per opening
    (response, excess, rate); `worst` is null where the mission does not show it; `start_s` and `stop_s` are null where it holds for the whole mission.
    `shows` is the smallest loss that the mission would have shown with 95 %, for three seconds, or lasting where the check is of
    the whole mission. `text` says why the part is not cleared, and is empty where it is.
    """

    component: str
    side: str
    check: str
    asked: str
    worst: float | None
    limit: float
    start_s: Seconds | None
    stop_s: Seconds | None
    shows: float | None
    passed: bool
    text: str


class DetectabilityRow(TypedDict):
    """How large a fault of one side of a part must be to be found in this mission.

    `deviation` is a row of the fault tables, or excess, offset, delay. A fault of `for_s` seconds, null for the whole mission,
    begins anywhere while the part is driven: `size` is the smallest that is found at 95 % of `places`, null where none is. `unit`
    is ``1`` for shares, m/s, rad or s, and empty where there is no size. `share` is the share of the places at which a loss or
    excess of `LimitsRow.clear_at`, a signal that is lost, or one that stays at its last value is found. `told` is the side it is
    ascribed to.
    """

    component: str
    side: str
    deviation: str
    for_s: float | None
    size: float | None
    unit: str
    share: float | None
    places: int
    told: str


class DetectabilityTrace(TypedDict):
    """The smallest loss of ten seconds that is found, by when it begins; null where none is."""

    component: str
    side: str
    start_s: list[float]
    loss: list[float | None]


class DetectabilityTable(TypedDict):
    """What a mission would have shown."""

    rows: list[DetectabilityRow]
    traces: list[DetectabilityTrace]
