"""Losses of a wheel's speed that its speed per opening does not show: a model's error, and no fault.

Whatever a sensor loses of a speed is lost of the speed per opening, however the speed loop answers. Where a wheel gives as much
per opening as the other wheels do at the same time, and as it usually does, nothing is lost.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.clearing.backwards import Part, without_findings
from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.openings import openings_tell
from diagnosis.clearing.responses import responses_of
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

_LEAST_LOSS = 0.15  # a smaller one is within what loads do
_SHOWN = 0.3  # of a loss [ln]: less of it is none
_INSIDE = 0.5  # of a window that lies in the fault, or of the fault in a window


def without_contradicted(assessments: Mapping[Part, Assessment], cells: Cells) -> dict[Part, Assessment]:
    """Assessments of which no model states a loss of a speed that the wheel's speed per opening does not show.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    cells : Cells
        The mission.
    """
    dt, wheels = cells.timeline.dt, cells.machine.wheels
    claims = {part: found for part, a in assessments.items() if part[0] in wheels and (found := _claims(a))}
    if not claims:
        return dict(assessments)
    opening = cells.wheels("u_applied")
    used = np.where(np.isfinite(opening), opening, cells.wheels("u"))
    responses = responses_of(cells, cells.wheels("v"), used, cells.reference, over_time=False)
    if not openings_tell(cells, responses):
        return dict(assessments)
    below = np.fmin(responses.windows, responses.beside)
    out = dict(assessments)
    for part, found in claims.items():
        column = below[:, wheels.index(part[0])]
        out[part] = without_findings(assessments[part], [f for f in found if _denied(f, column, cells)], dt)
    return out


def _claims(a: Assessment) -> list[Finding]:
    """Losses of a sensor, or of either side, that a model states."""
    return [
        f
        for f in a.findings
        if f.tier is Tier.MODEL and f.mode is FaultMode.INEFFICIENT and f.side is not Side.ACTUATOR
    ]


def _denied(finding: Finding, below: Array, cells: Cells) -> bool:
    """Whether hardly anything of a loss shows in the windows that lie in it. `below` of shape (windows,) [ln]."""
    if finding.epsilon is None or finding.epsilon.value < _LEAST_LOSS:
        return False
    dt, frame = cells.timeline.dt, cells.frame
    start, stop = finding.start * dt, finding.stop * dt
    first, last = frame.starts * cells.dt, (frame.starts + frame.length) * cells.dt
    common = np.minimum(last, stop) - np.maximum(first, start)
    inside = (common >= _INSIDE * np.minimum(frame.length * cells.dt, stop - start)) & np.isfinite(below)
    lost = np.log1p(-min(finding.epsilon.value, 0.99))
    return bool(inside.any() and np.median(below[inside]) > _SHOWN * lost)
