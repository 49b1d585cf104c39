"""What several speed sensors of a machine do at once while the speed changes is how they measure, and no fault of one of them.

A sensor that times the edges of a pole wheel comes late, later the slower the wheel is, and learns of a reversal some edges after it:
another one of the machine is off by as much in the same moment. A loss or an offset is off at steady speed as well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import shifted
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.low_speed import evened_off, in_lasting, left_open
from diagnosis.results.assessment import CODE, Assessment, Finding
from replay.arrays.numeric import without_nan
from replay.arrays.quantiles import quantile_of
from replay.arrays.sliding import largest_within
from replay.faults import State

Array = NDArray[np.float64]

_SENSORS = 3  # fewer show nothing
_AROUND_S, _ALIKE = 0.3, 1.8  # how much sooner or later; times, by which one may be off more than another
_STEADY_S, _STEADY, _TOP = 0.25, 0.04, 0.98  # to either side; of the speed that is reached, by this quantile
_SLOW = 0.2  # of it
_ALONE = 0.25  # of a deviation's power, at moments that no other sensor shares: more is the sensor's own
_KEPT = 0.5  # of the deviation, that a fault shows at steady speed as well
_LEAST = 0.15  # of a finding at steady speed, to tell
_HARDLY = 0.08  # of the speed: as little off is no loss that counts


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
    top = max(float(quantile_of(np.abs(without_nan(one.samples.x)), _TOP)) for one in found.values())
    steady = {w: _steady(one, top) for w, one in found.items()}
    own, lasting = {}, {}
    for w, one in found.items():
        findings = assessments[w].findings if w in assessments else ()
        fast = np.abs(without_nan(one.samples.x)) > _SLOW * top
        alone = [f for f in findings if _by_itself(f, off[w], steady[w], fast)]
        own[w] = in_lasting(alone, off[w].size, one.pair.dt)
        lasting[w] = in_lasting(findings, off[w].size, one.pair.dt) & ~own[w]
    habit = {w: np.where(own[w], 0.0, x) for w, x in off.items()}
    out = {}
    for w, a in assessments.items():
        others = {name: x for name, x in habit.items() if name != w}
        shared = [f for f in a.findings if _shared(f, off[w], _beside(f, others, lasting), steady[w], found[w].pair.dt)]
        out[w] = _healthy_at_speed(left_open(a, shared), shared, steady[w] & _as_it_should(off[w], found[w]))
    return out


def _as_it_should(off: Array, one: IdentifiedPair) -> NDArray[np.bool_]:
    """Samples that are off by less than a healthy sensor may be at steady speed, shape (n,)."""
    return np.asarray(off < _HARDLY * np.abs(without_nan(one.samples.x)))


def _healthy_at_speed(a: Assessment, shared: Sequence[Finding], steady: NDArray[np.bool_]) -> Assessment:
    """An assessment that calls a sensor healthy in what such findings leave open, where it reads as it should at steady speed."""
    if not shared:
        return a
    states = a.states.copy()
    for f in shared:
        inside = states[f.start : f.stop]
        inside[(inside == CODE[State.NOT_ASSESSED]) & steady[f.start : f.stop]] = CODE[State.HEALTHY]
    return replace(a, states=states)


def _by_itself(finding: Finding, off: Array, steady: NDArray[np.bool_], fast: NDArray[np.bool_]) -> bool:
    """Whether a finding is a fault whatever the speed does: nothing is left of the signal at speed, or it is as far off where that is steady.

    At low speed alone, all sensors of a machine may read nothing.
    """
    part = slice(finding.start, finding.stop)
    if finding.mode.total and float(np.mean(fast[part])) >= _LEAST:
        return True
    return float(np.mean(steady[part])) >= _LEAST and not _unsteady(off[part], steady[part])


def _unsteady(off: Array, steady: NDArray[np.bool_]) -> bool:
    """Whether a deviation is hardly one of steady speed."""
    return float(np.mean(off[steady] ** 2)) < _KEPT**2 * float(np.mean(off**2))


def _beside(finding: Finding, off: Mapping[str, Array], lasting: Mapping[str, NDArray[np.bool_]]) -> list[Array]:
    """Deviations of other sensors beside a finding; a lasting one of one of them alone is no habit."""
    part = slice(finding.start, finding.stop)
    faulty = [name for name in off if lasting[name][part].any()]
    return [np.where(lasting[name], 0.0, x) if faulty == [name] else x for name, x in off.items()]


def _steady(one: IdentifiedPair, top: float) -> NDArray[np.bool_]:
    """Samples of a speed that is neither low nor changes."""
    x = without_nan(one.samples.x)
    reach = max(1, round(_STEADY_S / one.pair.dt))
    change = np.abs(without_nan(shifted(x, reach) - shifted(x, -reach)))
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
    return _unsteady(own[part], calm)


def _alike(own: Array, other: Array, before: int, around: int) -> bool:
    """Whether another sensor, which begins `before` earlier, is off by as much within `around` steps of nearly all of a deviation."""
    beside = largest_within(other, around, around)[before : before + own.size]
    alone = own[: beside.size] > _ALIKE * beside
    return float(np.sum(own[: beside.size][alone] ** 2)) < _ALONE * float(np.sum(own**2))
