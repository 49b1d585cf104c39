"""Noise that all wheels share is no wheel's fault: a speed loop that hunts, or a pump that surges, swings every wheel.

A noisy sensor or valve deviates by itself: what its wheel does beside its model is not what the others do beside theirs. Of a
shared cause, the others' deviations explain most of a wheel's own, and theirs are as large.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.wheels.blocks import per_sample
from diagnosis.wheels.findings import WheelFindings, WheelPath

Array = NDArray[np.float64]

_MEAN_S = 0.1
_EXPLAINED, _AS_LARGE = 0.7, 2.0  # least share of a deviation's power; most times the others' amplitude
_OTHERS, _PLACES = 2, 12  # fewer wheels, or means, tell nothing


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
            f"Between {first:.1f} and {last:.1f} s the {{wheels}} swing about their expected speeds together: the speed loop hunts, or "
            "the pump surges. No {wheel} is blamed for it. Lower the gains of the speed loop, or inspect the pump, and record again."
        )


def without_shared(paths: Mapping[int, WheelPath], found: Mapping[int, WheelFindings]) -> Swings:
    """Take out the noisy findings that the other wheels' deviations explain; their time stays open, and unexplained.

    Parameters
    ----------
    paths, found : Mapping[int, WheelPath], Mapping[int, WheelFindings]
        Wheels and what was found, by wheel.
    """
    noisy = {i: [f for f in w.findings if f.mode.varying] for i, w in found.items()}
    if len(paths) <= _OTHERS or not any(noisy.values()):
        return Swings(dict(found), ())
    width = max(1, round(_MEAN_S / next(iter(paths.values())).dt))
    apart = {i: _means(p, width) for i, p in paths.items()}
    out, spans = {}, []
    for i, wheel in found.items():
        others = np.stack([a for j, a in apart.items() if j != i], axis=1)
        shared = [f for f in noisy[i] if _shared(f, apart[i], others, width)]
        for f in shared:
            spans.append((f.start * paths[i].dt, f.stop * paths[i].dt))
            for flags in (*wheel.opened.values(), *wheel.unexplained.values()):
                flags[f.start : f.stop] = True
        out[i] = replace(wheel, findings=[f for f in wheel.findings if not any(f is s for s in shared)])
    return Swings(out, tuple(sorted(spans)))


def _means(path: WheelPath, width: int) -> Array:
    """Deviation of a wheel's speed from what is expected, mean of `width` samples each; NaN where one is unknown."""
    apart: Array = path.y - np.asarray(per_sample(path.expected, path.width, path.y.size), dtype=np.float64)
    n = apart.size // width * width
    return np.asarray(apart[:n].reshape(-1, width).mean(axis=1))


def _shared(f: Finding, own: Array, others: Array, width: int) -> bool:
    """Whether the others' deviations explain a wheel's own in a finding, and are as large."""
    part = slice(f.start // width, f.stop // width)
    y, x = own[part], others[part]
    known = np.isfinite(y) & np.isfinite(x).all(axis=1)
    y, x = y[known], x[known]
    if y.size < max(_PLACES, 4 * x.shape[1]):
        return False
    y, x = y - y.mean(), x - x.mean(axis=0)
    power = float(y @ y)
    if power == 0.0 or float(np.std(y)) > _AS_LARGE * float(np.median(np.std(x, axis=0))):
        return False
    left = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    free = (y.size - 1) / (y.size - 1 - x.shape[1])
    return bool(float(left @ left) * free <= (1.0 - _EXPLAINED) * power)
