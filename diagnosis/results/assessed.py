"""How long a part must be judged before it counts as assessed, for verdict, caveats and comparison alike."""

from __future__ import annotations

_LEAST_SHARE = 0.8  # of its driving


def needed_s(driving_s: float, min_assessed: float) -> float:
    """Driving [s] in which a part must be decided: `min_assessed` seconds and four fifths of what it drove."""
    return max(min_assessed, _LEAST_SHARE * driving_s)
