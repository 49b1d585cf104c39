"""Words of trends in documents: kinds of change, directions, and states of a forecast."""

from __future__ import annotations

from typing import Literal

#: How a stretch of a series differs from the one before: its level fell or rose, or the slope alone changed.
ChangeKind = Literal["drop", "rise", "bend"]
#: Where the line of the last stretch goes, by the 95 % interval of its slope.
Direction = Literal["rising", "falling", "steady", "not_known"]
#: When a trend reaches its limit: within an interval, already, not within the horizon, or not known.
ForecastState = Literal["crossing", "above", "not_within", "not_known"]
