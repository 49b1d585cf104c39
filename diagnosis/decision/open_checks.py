"""Checks of the all-clear that are open, in their order and in a few words."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.results.clearing import Check, Checked

_STANDS_OUT = 3.0  # times the limit of a check: nobody should have to look for that among what is open
_BESIDE_OTHERS = (
    Check.RESPONSE,
    Check.LASTING_RESPONSE,
    Check.CHANGE,
    Check.EXCESS,
    Check.LASTING_EXCESS,
    Check.SAME_SIDE,
    Check.OPENING_OFFSET,
    Check.EFFORT,
)


def furthest_first(checks: Sequence[Checked]) -> list[Checked]:
    """Checks that deviate, the furthest beyond its limit first, then those that the mission does not show."""
    return sorted(checks, key=lambda c: -1.0 if c.worst is None else c.worst / c.limit, reverse=True)


def open_words(checks: Sequence[Checked]) -> str:
    """Why checks clear nothing, by the one that is furthest beyond its limit; the list below the verdict has the others."""
    return furthest_first(checks)[0].text + ("; other checks of the all-clear are open, too" if several(checks) else "")


def several(checks: Sequence[Checked]) -> bool:
    """Whether more than one thing deviates."""
    return len({(c.component, c.check) for c in checks}) > 1


def stands_out(checks: Sequence[Checked]) -> str:
    """What deviates from the other parts by several times what stands against an all-clear, the furthest, to follow a clause; else empty."""
    far = [c for c in checks if c.check in _BESIDE_OTHERS and c.worst is not None and c.worst >= _STANDS_OUT * c.limit]
    return f", and {furthest_first(far)[0].text}" if far else ""
