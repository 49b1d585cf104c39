"""Steering angles beside their second measurements, where a gyro says which of both the machine turns by: two that agree name the third."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.untold_faults import fault_of_angle
from diagnosis.clearing.yaw import turn_by
from diagnosis.results.assessment import Finding
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Kind
from replay.faults import FaultMode, Side, State

_TURNS, _LEAST_S = 0.06, 6.0  # tangent of the ends' difference by which a machine turns, and for how long
_AGREES, _NEARER = 0.15, 0.4  # ln, of turns: tyres give way by as much; of what the first angles are off
_LEFT = 0.3  # of what an angle is off: what a share of it may leave
_STEERED = 0.05  # rad
_SECOND = (
    "The gyro (imu.yaw_rate) has the machine turn as {second} says ({by_second:.2f} × its turn) and not as {first} ({by_first:.2f} ×): two witnesses "
    "against one."
)
_SHARE = "{first} reads {share:.2f} × what {second} reads."


def scaled_angles(checks: Sequence[Checked], cells: Cells) -> dict[str, Finding]:
    """Faults of steering sensors that are off their second measurements by what counts, by axle, where a gyro turns as the second ones say.

    Parameters
    ----------
    checks : Sequence[Checked]
        Of the mission.
    cells : Cells
        The mission.
    """
    off = [
        c
        for c in checks
        if c.kind is Kind.STEER and (c.check, c.side) == (Check.SECOND_MEASUREMENT, Side.SENSOR) and not c.passed
    ]
    told = [c for c in off if c.worst is not None]
    by = turned_by(cells) if told else None
    if by is None:
        return {}
    out = {}
    for check in told:
        fault = fault_of_angle(check, cells)
        names = {leaf: f"steer.{check.component}.{leaf}" for leaf in ("phi", "phi_true")}
        text = _SECOND.format(second=names["phi_true"], first=names["phi"], by_second=by[1], by_first=by[0])
        share = _share_of(cells, check.component, fault)
        evidence = (*fault.evidence, text) if share is None else (*_as_share(share, names), text)
        out[check.component] = replace(_scaled(fault, share), evidence=evidence)
    return out


def turned_by(cells: Cells) -> tuple[float, float] | None:
    """What the gyro's turn is of that by all first angles, and of that by all second ones [1]; None where it does not say that the second ones are right."""
    if not any(np.isfinite(cells.means(f"steer.{axle}.phi_true")).any() for axle in cells.machine.axles):
        return None
    first, second = (turn_by(cells, leaf) for leaf in ("phi", "phi_true"))
    if first is None or second is None:
        return None
    one, other = (_factor(*pair, cells.dt) for pair in (first, second))
    if one is None or other is None or abs(np.log(other)) > min(_AGREES, _NEARER * abs(np.log(one))):
        return None
    return one, other


def _factor(turned: Array, by: Array, dt: float) -> float | None:
    """Measured turn by that of angles, both of shape (cells,): the share that fits best; None where the machine hardly turns, or the other way."""
    use: NDArray[np.bool_] = np.isfinite(turned) & np.isfinite(by) & (np.abs(np.nan_to_num(by)) > _TURNS)
    if np.count_nonzero(use) * dt < _LEAST_S:
        return None
    share = float(np.median(turned[use] / by[use]))
    return share if share > 0.0 else None


def _share_of(cells: Cells, axle: str, fault: Finding) -> float | None:
    """What an angle reads of its second measurement in the time of a fault [1]; None where it is off by no share."""
    j = cells.machine.axles.index(axle)
    part = slice(fault.start // cells.width, -(-fault.stop // cells.width))
    y, x = (cells.axles(leaf)[part, j] for leaf in ("phi", "phi_true"))
    use = np.isfinite(y) & np.isfinite(x) & (np.abs(np.nan_to_num(x)) > _STEERED)
    if not use.any():
        return None
    y, x = y[use], x[use]
    share = float(x @ y / (x @ x))
    left, apart = (float(np.sqrt(np.mean(z**2))) for z in (y - share * x, y - x))
    return share if share > 0.0 and left < _LEFT * apart else None


def _as_share(share: float, names: dict[str, str]) -> tuple[str, ...]:
    return (_SHARE.format(first=names["phi"], second=names["phi_true"], share=share),)


def _scaled(fault: Finding, share: float | None) -> Finding:
    """The fault as a loss, where a share below one is what the angle reads."""
    if share is None or share >= 1.0:
        size = None if share is None else Epsilon(1.0 - share, 1.0 - share, 1.0 - share)
        return replace(fault, epsilon=size)
    p = sum(h.p for h in fault.hypotheses if h.mode != State.HEALTHY.value)
    mode = FaultMode.INEFFICIENT
    rows = (Hypothesis(Side.SENSOR.value, mode.value, p), Hypothesis("none", State.HEALTHY.value, 1.0 - p))
    return replace(
        fault, mode=mode, probability=p, hypotheses=rows, epsilon=Epsilon(1.0 - share, 1.0 - share, 1.0 - share)
    )
