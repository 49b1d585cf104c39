"""Evidence for pictures: envelopes of long missions, with every sample of some steps set aside while it is there.

Of a mission of hours a result holds the smallest and largest value of every few steps (`replay.arrays.envelope`), and beside them
every step around onset and end of faults, bounded in number.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Closeups
from replay.arrays.envelope import bucket_of, shown

Steps = NDArray[np.int64]

_AROUND_S, _WHOLE_S, _MARGIN_S = 2.0, 10.0, 0.2
_MISSION_STEPS, _COMPONENT_STEPS = 1 << 18, 1 << 17


def steps_around(spans: Iterable[tuple[int, int]], size: int, dt: float, most: int = _MISSION_STEPS) -> Steps:
    """Steps around onset and end of faults; with what is left of `most`, short faults as a whole.

    Parameters
    ----------
    spans : Iterable[tuple[int, int]]
        First step of each fault and the step behind its last; those wanted most first.
    size : int
        Steps of the mission.
    dt : float
        Step [s].
    most : int
        Steps at most.

    Returns
    -------
    NDArray[np.int64], shape (m,)
        Increasing.
    """
    around, margin = round(_AROUND_S / dt), round(_MARGIN_S / dt)
    faults = list(spans)
    edges = [[(at - around, at + around) for at in fault] for fault in faults]
    whole = []
    for start, stop in faults:
        reach = max(around, (stop - start) // 2 + margin)
        whole += [[(start - reach, stop + reach)]] if (stop - start) * dt <= _WHOLE_S else []
    parts: list[Steps] = []
    left = most
    for fault in (*edges, *whole):
        found = [np.arange(max(a, 0), min(b, size)) for a, b in fault]
        left -= sum(len(f) for f in found)
        if left < 0:
            break
        parts += found
    return np.unique(np.concatenate(parts)) if parts else np.empty(0, np.int64)


def steps_of(findings: Sequence[Finding], size: int, dt: float) -> Steps:
    """Steps that one component's evidence keeps: none where the mission is short enough to keep all.

    Shape (k,).

    Parameters
    ----------
    findings : Sequence[Finding]
        Faults of the component.
    size : int
        Steps of the mission.
    dt : float
        Step [s].
    """
    if bucket_of(size) == 1:
        return np.empty(0, np.int64)
    order = sorted(findings, key=lambda f: (not f.mode.total, f.start - f.stop, f.start))
    return steps_around([(f.start, f.stop) for f in order], size, dt, _COMPONENT_STEPS)


@dataclass(frozen=True)
class Pictured:
    """Evidence columns for pictures, and every sample of them at some steps."""

    step: Steps
    columns: dict[str, NDArray[np.floating]] = field(default_factory=dict)
    samples: dict[str, NDArray[np.float32]] = field(default_factory=dict)

    @classmethod
    def of(cls, step: Steps, series: Iterable[tuple[str, NDArray[np.floating]]]) -> Pictured:
        """Reduce columns of n steps one after another; `series` may make each when it is asked for.

        Columns of shape (n,).
        """
        out = cls(step)
        for leaf, values in series:
            out.columns[leaf] = shown(values)
            if step.size:
                out.samples[leaf] = values[step].astype(np.float32)
        return out

    def __or__(self, other: Pictured) -> Pictured:
        return Pictured(self.step, self.columns | other.columns, self.samples | other.samples)

    @property
    def closeups(self) -> Closeups | None:
        """The samples at the steps; None where nothing is kept."""
        return Closeups(self.step, self.samples) if self.step.size else None
