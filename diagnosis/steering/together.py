"""Axles that deviate at the same time: what their models miss of the machine, and no fault of each.

Two valves, or two sensors, that begin and cease to fail in the same second have one cause: a motion, a supply, a clock. That both
lose their signal may be; that both stick, lose or shake likewise is left open where nothing is measured twice.
"""

from __future__ import annotations

from collections.abc import Mapping

from diagnosis.results.assessment import Finding
from diagnosis.steering.findings import SideFindings
from replay.faults import FaultMode, Side

_ENDS_S = 1.5  # within which both begin, or cease
_COMMON = 0.7  # of the time of the longer one


def not_together(
    found: Mapping[str, Mapping[Side, SideFindings]], length: int, dt: float
) -> dict[str, dict[Side, SideFindings]]:
    """Findings by axle and side without those that another axle shares; they are left unexplained.

    Parameters
    ----------
    found : Mapping[str, Mapping[Side, SideFindings]]
        Of all axles whose quantities are measured once.
    length : int
        Samples per block.
    dt : float
        Sample [s].
    """
    out: dict[str, dict[Side, SideFindings]] = {}
    for axle, sides in found.items():
        out[axle] = {}
        for side, one in sides.items():
            others = [f for name, of in found.items() if name != axle for f in of[side].findings]
            shared = [f for f in one.findings if any(_together(f, g, dt) for g in others)]
            kept = tuple(f for f in one.findings if f not in shared)
            spans = [(f.start // length, -(-f.stop // length)) for f in shared]
            out[axle][side] = SideFindings(kept, (*one.unexplained, *spans))
    return out


def _together(a: Finding, b: Finding, dt: float) -> bool:
    """Whether two findings of two axles are one of the machine."""
    if a.mode is not b.mode or a.mode is FaultMode.NO_SIGNAL:
        return False
    common = min(a.stop, b.stop) - max(a.start, b.start)
    ends = sorted((abs(a.start - b.start) * dt, abs(a.stop - b.stop) * dt))
    return ends[1] <= _ENDS_S or (ends[0] <= _ENDS_S and common >= _COMMON * max(a.stop - a.start, b.stop - b.start))
