"""Noise that all wheels share is no wheel's fault: a speed loop that hunts, or a pump that surges, swings every wheel.

A noisy sensor or valve deviates by itself, by several times what the other wheels, which it may shake, deviate by. Of a shared
cause most wheels deviate alike, or some begin and end together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.wheels.blocks import per_sample
from diagnosis.wheels.findings import WheelFindings, WheelPath
from diagnosis.wheels.own_swings import is_opened

Array = NDArray[np.float64]

_MEAN_S = 0.1
_AS_LARGE = 2.0  # most times the others' amplitude
_TOGETHER, _ALIKE = 0.7, 1.5  # share of two findings' time that is common to both; times in amplitude
_COHERENT, _APART = 0.4, 5  # correlation of one cause; means by which one wheel may follow another
_OTHERS, _PLACES = 2, 6  # fewer wheels, or means, tell nothing


@dataclass(frozen=True)
class Swings:
    """Findings without those of a shared cause, and when that was.

    Attributes
    ----------
    found : dict[int, WheelFindings]
        By wheel.
    spans : tuple[tuple[float, float], ...]
        Begin and end of what was taken out [s], by time.
    """

    found: dict[int, WheelFindings]
    spans: tuple[tuple[float, float], ...]

    @property
    def sentence(self) -> str:
        """What swung, and when; empty where nothing did."""
        if not self.spans:
            return ""
        first, last = self.spans[0][0], max(stop for _, stop in self.spans)
        return (
            f"Between {first:.1f} and {last:.1f} s several {{wheels}} swing about their expected speeds together, as where the speed loop "
            "hunts or the supply surges; no {wheel} is blamed for it."
        )


def without_shared(paths: Mapping[int, WheelPath], found: Mapping[int, WheelFindings]) -> Swings:
    """Take out the noisy findings that other wheels share; their time stays open, and unexplained.

    Parameters
    ----------
    paths, found : Mapping[int, WheelPath], Mapping[int, WheelFindings]
        Wheels and what was found, by wheel.
    """
    noisy = {i: [f for f in w.findings if f.mode.varying or is_opened(f)] for i, w in found.items()}
    if len(paths) <= _OTHERS or not any(noisy.values()):
        return Swings(dict(found), ())
    width = max(1, round(_MEAN_S / next(iter(paths.values())).dt))
    apart = {i: _means(p, width) for i, p in paths.items()}
    shared: dict[int, list[Finding]] = {}
    for i in found:
        for f in noisy[i]:
            # What a wheel with another fault deviates by says nothing of the machine.
            others = {
                j: a
                for j, a in apart.items()
                if j != i and not (_other_fault(found[j], f) or _noise_of_its_own(f, noisy[j], apart[i], a, width))
            }
            if len(others) >= _OTHERS and _shared(f, apart[i], others, noisy, width):
                shared.setdefault(i, []).append(f)
    level = max((_size(f, apart[i], width) for i, fs in shared.items() for f in fs), default=0.0)
    out, spans = {}, []
    for i, wheel in found.items():
        # What swings no further than the machine does elsewhere in the mission is no proof of a fault either.
        taken = [f for f in noisy[i] if any(f is s for s in shared.get(i, [])) or _size(f, apart[i], width) <= level]
        for f in taken:
            spans.append((f.start * paths[i].dt, f.stop * paths[i].dt))
            for flags in (*wheel.opened.values(), *wheel.unexplained.values()):
                flags[f.start : f.stop] = True
        out[i] = replace(wheel, findings=[f for f in wheel.findings if not any(f is s for s in taken)])
    return Swings(out, tuple(sorted(spans)))


def _other_fault(wheel: WheelFindings, f: Finding) -> bool:
    """Whether a wheel has a fault of another row at the time of a finding."""
    return any(not (g.mode.varying or is_opened(g)) and g.start < f.stop and f.start < g.stop for g in wheel.findings)


def _noise_of_its_own(f: Finding, noisy: Sequence[Finding], own: Array, other: Array, width: int) -> bool:
    """Whether another wheel has such a finding at another time, into this one's, and moves apart from it: two faults, no swing of both."""
    if is_opened(f) or not any(f.start < g.stop and g.start < f.stop and not is_opened(g) for g in noisy):
        return False
    if any(_common(f, g) >= _TOGETHER for g in noisy):
        return False
    part = slice(f.start // width, f.stop // width)
    return _coherence(own[part], other[part]) < _COHERENT


def _coherence(own: Array, other: Array) -> float:
    """Largest correlation of what two deviations change by from mean to mean, the one sooner or later by up to `_APART` of them [1]."""
    both = np.nan_to_num(np.diff(np.stack([own, other])))
    a, b = both - both.mean(axis=1, keepdims=True)
    power = float(np.sqrt((a @ a) * (b @ b)))
    if a.size <= 2 * _APART or power == 0.0:
        return 1.0
    shifts = np.correlate(a, b, "full")[a.size - 1 - _APART : a.size + _APART]
    return float(np.abs(shifts).max()) / power


def _size(f: Finding, own: Array, width: int) -> float:
    """Standard deviation of a wheel's deviation in a finding; infinite where it is unknown."""
    part = own[f.start // width : f.stop // width]
    return float(np.nanstd(part)) if np.isfinite(part).any() else np.inf


def _means(path: WheelPath, width: int) -> Array:
    """Deviation of a wheel's speed from what is expected, mean of `width` samples each; NaN where one is unknown."""
    apart: Array = path.y - np.asarray(per_sample(path.expected, path.width, path.y.size), dtype=np.float64)
    n = apart.size // width * width
    return np.asarray(apart[:n].reshape(-1, width).mean(axis=1))


def _shared(
    f: Finding, own: Array, others: Mapping[int, Array], noisy: Mapping[int, Sequence[Finding]], width: int
) -> bool:
    """Whether most other wheels deviate as much as one does in a finding, or one does that has such a finding at the same time."""
    part = slice(f.start // width, f.stop // width)
    size = {j: _amplitude(own[part], a[part]) for j, a in others.items()}
    if any(np.isnan(s).any() for s in size.values()):
        return False
    mine, theirs = (np.array([s[k] for s in size.values()]) for k in (0, 1))
    if float(np.median(mine - _AS_LARGE * theirs)) <= 0.0:
        return True
    alike = [j for j, (a, b) in size.items() if max(a, b) <= _ALIKE * min(a, b)]
    return any(g.side is f.side and _common(f, g) >= _TOGETHER for j in alike for g in noisy[j])


def _amplitude(own: Array, other: Array) -> tuple[float, float]:
    """Standard deviations of two deviations where both are known; NaN where that is too short."""
    known = np.isfinite(own) & np.isfinite(other)
    if np.count_nonzero(known) < _PLACES:
        return float("nan"), float("nan")
    return float(np.std(own[known])), float(np.std(other[known]))


def _common(f: Finding, g: Finding) -> float:
    """Share of the time of two findings that is common to both."""
    return max(0, min(f.stop, g.stop) - max(f.start, g.start)) / (max(f.stop, g.stop) - min(f.start, g.start))
