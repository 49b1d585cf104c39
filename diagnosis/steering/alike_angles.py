"""Angles of two axles that are off their second measurements by the same share at the same time: how the machine measures, and no fault of one.

Linkages between a cylinder and its wheel turn one angle into another that is no constant share of it; on both axles alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.results.assessment import Finding
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.side_findings import SideFindings
from replay.faults import Side

_LEAST_RAD, _FEW = 0.06, 10  # a share is known of so large an angle, and so many readings
_LEAST, _LIKEWISE = 0.04, 0.6  # share by which an angle is off, and of that, the other axle's
_LEFT = 0.5  # of what it is off, root mean square: more of it is no share


def not_scaled_together(
    found: Mapping[str, Mapping[Side, SideFindings]], axles: Sequence[AxleInputs], length: int, clear_at: float
) -> dict[str, dict[Side, SideFindings]]:
    """Findings by axle and side without what a sensor is off by a share that another axle's is off by, too; they are left unexplained.

    Parameters
    ----------
    found : Mapping[str, Mapping[Side, SideFindings]]
        Of axles whose angles are measured twice, and of others, which stay.
    axles : Sequence[AxleInputs]
        Channels of all axles.
    length : int
        Samples per block.
    clear_at : float
        The loss that counts [1]: a larger one stays.
    """
    twice = {a.name: a for a in axles if a.angle_redundant and a.name in found}
    out = {name: dict(sides) for name, sides in found.items()}
    for name, own in twice.items():
        sensor = found[name][Side.SENSOR]
        others = [a for other, a in twice.items() if other != name]
        alike = [f for f in sensor.findings if not f.mode.total and _alike(f, own, others, clear_at)]
        out[name][Side.SENSOR] = sensor.left_open(alike, length)
    return out


def _alike(f: Finding, own: AxleInputs, others: Sequence[AxleInputs], clear_at: float) -> bool:
    share = _share(f, own)
    if share is None or not _LEAST <= abs(share) < clear_at:
        return False
    beside = [_share(f, other) for other in others]
    return any(x is not None and x * np.sign(share) >= _LIKEWISE * abs(share) for x in beside)


def _share(f: Finding, axle: AxleInputs) -> float | None:
    """By which share an angle is off its second measurement meanwhile [1]; None where it is off by no share."""
    y, x = (axle.values(leaf)[f.start : f.stop] for leaf in ("phi", "phi_true"))
    use = np.isfinite(y) & np.isfinite(x) & (np.abs(np.nan_to_num(x)) > _LEAST_RAD)
    if np.count_nonzero(use) < _FEW:
        return None
    y, x = y[use], x[use]
    gain = float((y * x).sum() / (x * x).sum())
    off, left = (float(np.sqrt(np.mean((y - g * x) ** 2))) for g in (1.0, gain))
    return gain - 1.0 if left <= _LEFT * off else None
