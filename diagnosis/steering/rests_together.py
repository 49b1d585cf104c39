"""Angles that repeat one value while those of another axle do, too, and nobody asks either to turn: how they read at rest, and no dead sensor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.steering.dead_readings import LEAST_ASKED_S
from diagnosis.steering.excitation import asked
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.path import AxleFilter
from diagnosis.steering.side_findings import SideFindings, span_of
from replay.faults import Side

_FEW, _MOSTLY = 5, 0.8  # readings; of them, that are one value


def not_resting_together(
    found: Mapping[str, Mapping[Side, SideFindings]], axles: Sequence[AxleInputs], filters: Mapping[str, AxleFilter]
) -> dict[str, dict[Side, SideFindings]]:
    """Findings by axle and side without dead sensors that only repeat what another axle's repeats as well; they are left unexplained.

    Parameters
    ----------
    found : Mapping[str, Mapping[Side, SideFindings]]
        Of all axles.
    axles : Sequence[AxleInputs]
        Their channels.
    filters : Mapping[str, AxleFilter]
        Their filters, which tell when a motion is asked for.
    """
    out = {name: dict(sides) for name, sides in found.items()}
    by_name = {a.name: a for a in axles}
    for name, sides in found.items():
        sensor, length = sides[Side.SENSOR], filters[name].blocks.length
        others = [by_name[other] for other in by_name if other != name]
        resting = [
            f for f in sensor.findings if _rests(f, filters[name], length) and any(_repeats(f, o) for o in others)
        ]
        out[name][Side.SENSOR] = sensor.left_open(resting, length)
    return out


def _rests(f: Finding, axle: AxleFilter, length: int) -> bool:
    """Whether nothing asks an axle to turn while its sensor is called dead."""
    return f.mode.total and asked(axle, *span_of(f, length))[2] < LEAST_ASKED_S


def _repeats(f: Finding, other: AxleInputs) -> bool:
    """Whether another axle's new readings are nearly all one value meanwhile."""
    part = slice(f.start, f.stop)
    known: NDArray[np.float64] = other.angle[part][other.fresh[part]]
    known = known[np.isfinite(known)]
    if known.size < _FEW:
        return False
    return int(np.unique(known, return_counts=True)[1].max()) >= _MOSTLY * known.size
