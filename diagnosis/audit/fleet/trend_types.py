"""Trends in `fleet.json`, as types; see `diagnosis.audit.fleet.fleet_types`."""

from __future__ import annotations

from typing import Literal, NotRequired, TypedDict

from diagnosis.audit.fleet.fault_types import BoundsRow
from diagnosis.audit.trends.kinds import ChangeKind, Direction, ForecastState

#: What trends are drawn over: hours of driving in the audited missions, or days.
Axis = Literal["hours", "days"]


class ChangePointRow(TypedDict):
    """Where the line of a trend begins anew: first point of the new stretch, kind, and step of the level."""

    index: int
    kind: ChangeKind
    size: float


class LineRow(TypedDict):
    """Line of a trend's last stretch: level at ``now``, slope per unit of the axis; see `diagnosis.audit.trends.line`."""

    level: BoundsRow
    slope: BoundsRow
    tau: float
    centre: float
    dof: int


class ForecastRow(TypedDict):
    """When a trend reaches its limit, from now on in units of the axis; see `diagnosis.audit.trends.trend.Forecast`."""

    state: ForecastState
    soonest: float | None
    likely: float | None
    latest: float | None
    horizon: float
    words: str


class TrendRow(TypedDict):
    """Course of ε̂ of one component and side of a machine.

    Attributes
    ----------
    machine : int
        Place of the machine.
    component, kind, side : str
        The part.
    limit : float
        Limit of ε.
    now : float
        End of the axis.
    points : list[tuple[int, float, float, float, float]]
        Place of the mission, place on the axis, ε̂, low, high.
    outliers : list[int]
        Points that are left out of the line.
    changes : list[ChangePointRow]
        Steps and bends.
    first : int
        First point of the last stretch.
    direction : str
        Where the last stretch goes.
    approaching : bool
        Whether it rises for certain and likely reaches the limit within as long as the stretch has lasted.
    halving : bool
        Whether it grows so fast that half may be lost before two more missions are over, and the part was not repaired since.
    line : LineRow or None
        Line of the last stretch.
    forecast : ForecastRow
        When the limit is reached.
    """

    machine: int
    component: str
    kind: str
    side: str
    limit: float
    now: float
    points: list[tuple[int, float, float, float, float]]
    outliers: list[int]
    changes: list[ChangePointRow]
    first: int
    direction: Direction
    approaching: bool
    halving: NotRequired[bool]  # documents of older versions have none
    line: LineRow | None
    forecast: ForecastRow
