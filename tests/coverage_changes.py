"""How long one part was judged in two missions, as a comparison has it."""

from __future__ import annotations

from typing import Any


def judged_side(**changes: Any) -> dict[str, Any]:
    """One side that was judged long enough and is cleared, but for `changes`."""
    side = {"tier": "model", "driving_s": 44.5, "decided_s": 44.5, "judged_s": 44.5}
    return side | {"assessed": True, "shown": True, "long_enough": True} | changes


def changed_coverage(newer: dict[str, Any]) -> dict[str, Any]:
    """A sensor that was judged and cleared in the older mission, and is no more in the newer one."""
    row = {"component": "RL", "kind": "wheel", "side": "sensor", "older": judged_side(), "change": "lost"}
    return row | {"newer": newer}
