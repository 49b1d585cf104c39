"""What several speed sensors of a machine do at once while the speed changes is how they measure, and no fault of one of them.

A sensor that times the edges of a pole wheel comes late, later the slower the wheel is, and learns of a reversal some edges after it:
another one of the machine is off by as much in the same moment. A loss or an offset is off at steady speed as well.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import shifted
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.low_speed import evened_off, in_lasting, left_open
from diagnosis.results.assessment import Assessment, Finding
from replay.arrays.sliding import largest_within

Array = NDArray[np.float64]

_SENSORS = 3  # fewer show nothing
_AROUND_S, _ALIKE = 0.3, 1.8  # how much sooner or later; times, by which one may be off more than another
_STEADY_S, _STEADY, _TOP = 0.25, 0.04, 0.98  # to either side; of the speed that is reached, by this quantile
_SLOW = 0.2  # of it
_ALONE = 0.25  # of a deviation's power, at moments that no other sensor shares: more is the sensor's own
_KEPT = 0.5  # of the deviation, that a fault shows at steady speed as well
_LEAST = 0.15  # of a finding at steady speed, to tell


def without_shared_moments(
    found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment]
) -> dict[str, Assessment]:
    """Assessments of speed sensors without findings that another one shares at the same moment of changing or low speed.

    Parameters
    ----------
    found : Mapping[str, IdentifiedPair]
        Sensors beside their references, by wheel.
    assessments : Mapping[str, Assessment]
        What was found of them.
    """
    if len(found) < _SENSORS or not any(a.findings for a in assessments.values()):
        return dict(assessments)
    off = {w: evened_off(one) for w, one in found.items()}
    top = max(float(np.quantile(np.abs(np.nan_to_num(one.samples.x)), _TOP)) for one in found.values())
    faulty = {w: in_lasting(a.findings, off[w].size, found[w].pair.dt) for w, a in assessments.items()}
    out = {}
    for w, a in assessments.items():
        steady, others = _steady(found[w], top), [name for name in found if name != w]
        shared = [
            f
            for f in a.findings
            if _shared(f, off[w], _beside(f, {x: off[x] for x in others}, faulty), steady, found[w].pair.dt)
        ]
        out[w] = left_open(a, shared)
    return out


def _beside(finding: Finding, off: Mapping[str, Array], faulty: Mapping[str, NDArray[np.bool_]]) -> list[Array]:
    """Deviations of other sensors beside a finding; a lasting fault of one of them alone is no habit."""
    part = slice(finding.start, finding.stop)
    lasting = [name for name in off if name in faulty and faulty[name][part].any()]
    return [np.where(faulty[name], 0.0, x) if lasting == [name] else x for name, x in off.items()]


def _steady(one: IdentifiedPair, top: float) -> NDArray[np.bool_]:
    """Samples of a speed that is neither low nor changes."""
    x = np.nan_to_num(one.samples.x)
    reach = max(1, round(_STEADY_S / one.pair.dt))
    change = np.abs(np.nan_to_num(shifted(x, reach) - shifted(x, -reach)))
    return np.asarray((change < _STEADY * top) & (np.abs(x) > _SLOW * top))


def _shared(finding: Finding, own: Array, others: list[Array], steady: NDArray[np.bool_], dt: float) -> bool:
    """Whether another sensor is off by about as much at its moments, and the deviation is none of steady speed."""
    part = slice(finding.start, finding.stop)
    around = round(_AROUND_S / dt)
    near = slice(max(0, finding.start - around), finding.stop + around)
    if not any(_alike(own[part], x[near], finding.start - near.start, around) for x in others):
        return False
    calm = steady[part]
    if float(np.mean(calm)) < _LEAST:
        return True
    return float(np.mean(own[part][calm] ** 2)) < _KEPT**2 * float(np.mean(own[part] ** 2))


def _alike(own: Array, other: Array, before: int, around: int) -> bool:
    """Whether another sensor, which begins `before` earlier, is off by as much within `around` steps of nearly all of a deviation."""
    beside = largest_within(other, around, around)[before : before + own.size]
    alone = own[: beside.size] > _ALIKE * beside
    return float(np.sum(own[: beside.size][alone] ** 2)) < _ALONE * float(np.sum(own**2))
