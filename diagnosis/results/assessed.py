"""How long a part must be judged before it counts as judged, for verdict, caveats, comparison and pages alike."""

from __future__ import annotations

from collections.abc import Iterable

#: Share of its driving for which a part must be judged.
LEAST_SHARE = 0.8
#: Begin the reasons why what was judged is not the whole mission: a part of the log alone, and a part of the machine without data
#: for some time. Other reasons are of parts that were not judged at all.
CUT, AT_TIMES = "only ", "for "


def needed_s(driving_s: float, min_assessed: float) -> float:
    """Driving [s] in which a part must be decided: `min_assessed` seconds and four fifths of what it drove."""
    return max(min_assessed, LEAST_SHARE * driving_s)


def is_judged(decided_s: float, driving_s: float, min_assessed: float) -> bool:
    """Whether a part was judged: decided for as long as it must be. Both times of its driving [s]."""
    return decided_s >= needed_s(driving_s, min_assessed)


def is_limited(scope: Iterable[str], component: str) -> bool:
    """Whether a component that was judged was so for a part of the mission alone, by the reasons why the whole one was not judged."""
    own = f" the {component.removesuffix('_steer')} "
    return any(text.startswith(CUT) or (text.startswith(AT_TIMES) and own in text) for text in scope)
