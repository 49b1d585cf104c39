"""Noise and rounding step of every measured channel, over all missions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.channels.noise import rounding_step, white_noise
from diagnosis.fitting.robust import Estimate
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

_LEAST_SAMPLES = 200
_MEASURED = ("v", "v_true", "phi", "phi_true", "yaw_rate")


@dataclass(frozen=True)
class NoiseFit:
    """Noise of one channel.

    Attributes
    ----------
    std, lsb : Estimate
        Standard deviation of its white part, and its rounding step (0: none) [SI].
    missions : int
        Missions that they come from.
    """

    std: Estimate
    lsb: Estimate
    missions: int


def fit_noise(timelines: Sequence[Timeline], machine: Machine) -> dict[str, NoiseFit]:
    """Noise of every measured channel of the machine; commands have none.

    Parameters
    ----------
    timelines : Sequence[Timeline]
        Aligned missions.
    machine : Machine
        Its channels.
    """
    out = {}
    for name in machine.canonical_signals():
        if name.startswith("cmd.") or name.rpartition(".")[2] not in _MEASURED:
            continue
        stds, steps = [], []
        for t in timelines:
            x = t.get(name)
            if x is None:
                continue
            fresh = x[t.fresh[name]]
            if np.count_nonzero(np.isfinite(fresh)) < _LEAST_SAMPLES:
                continue
            stds.append(white_noise(fresh, t.periods_ns[name] * 1e-9))
            steps.append(rounding_step(fresh))
        if stds:
            out[name] = NoiseFit(_over(stds, "it never changes"), _over(steps, ""), len(stds))
    return out


def _over(values: list[float], why: str) -> Estimate:
    """Median over missions, with its spread."""
    known = np.array([v for v in values if np.isfinite(v)])
    if not known.size:
        return Estimate(float("nan"), float("nan"), why)
    spread = float(np.std(known, ddof=1)) if known.size > 1 else float("nan")
    return Estimate(float(np.median(known)), spread)
