"""Whether a model that found a fault took in a second measurement, as that of the steering does."""

from __future__ import annotations

from collections.abc import Container

from diagnosis.results.document import IntervalRow
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import Side

JOINT = "position of its joint"  # evidence by it, in a name
_LEAVES = {Side.SENSOR: ("phi", "phi_true"), Side.ACTUATOR: ("u", "u_applied")}


def second_of(fault: IntervalRow, logged: Container[str]) -> Side | None:
    """The side of a steering fault that is measured twice, where its model weighed both measurements; else None.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    logged : Container[str]
        Names of the signals in the log.
    """
    side = Side(fault["side"])
    if fault["kind"] != Kind.STEER or fault["tier"] not in (Tier.MODEL, Tier.SIGNAL) or side not in _LEAVES:
        return None
    return side if all(f"steer.{fault['component']}.{leaf}" in logged for leaf in _LEAVES[side]) else None


def by_position(fault: IntervalRow) -> bool:
    """Whether what a fault was decided by includes the position of its own joint: its sentences name that signal."""
    name = f"{fault['kind']}.{fault['component']}.v_position"
    return fault["tier"] == Tier.RESPONSE and any(name in text for text in fault["evidence"])
