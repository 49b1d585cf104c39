"""A long reason as its first point and the others, which the page folds away."""

from __future__ import annotations

import re

_LONG = 260  # characters that are read at a glance
_FIRST = 2  # points that stand before the others
# Between points, not within brackets.
_BETWEEN = re.compile(r"; (?![^()]*\))")


def in_points(reason: str) -> tuple[str, list[str]]:
    """What stands at once of a reason, and its other points; all of it at once where it is short."""
    points = _BETWEEN.split(reason)
    if len(reason) <= _LONG or len(points) <= _FIRST:
        return reason, []
    return "; ".join(points[:_FIRST]), [f"{x[:1].upper()}{x[1:]}" for x in points[_FIRST:]]
