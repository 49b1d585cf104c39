"""Rows of `report.json` on how well the loop held its speeds, beside the paper's table."""

from __future__ import annotations

from typing import TypedDict


class MeanRow(TypedDict):
    """Mean of the whole mission and of driving."""

    mission: float | None
    driving: float | None


class LoopRow(TypedDict):
    """Tracking error |e| [m/s] and control effort |u_a| [fraction of full opening]."""

    tracking_error: MeanRow
    control_effort: MeanRow


class PaperRow(TypedDict):
    """One line of the paper's table of controllers."""

    controller: str
    tracking_error: float
    control_effort: float
    parameters: int


class MetricsRow(TypedDict):
    """Figures of the control loop beside the paper's."""

    wheels: dict[str, LoopRow]
    average: LoopRow
    paper: list[PaperRow]
