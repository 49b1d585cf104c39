"""Findings on a steering axle, measured twice: pieces of one cause; and on its valve: one that may be off instead of dead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.one_cause import with_one_cause
from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.steering.findings import SideFindings
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.redundancy import MOST_APART
from replay.faults import FaultMode, Side
from replay.machine.quantities import OPENING

Array = NDArray[np.float64]

# lower quarter of what is off, which a fault that grows before it is found leaves alone, and standard deviations per that
_LOWER, _NORMAL = 0.25, 3.138
_AT_REST = 0.5  # probability that a valve does not answer a command which stays
_STEADY, _HARDLY = 0.25, 0.05  # of its mean, and of full opening, by which such a command varies
_CONSTANT = "The command hardly moved meanwhile: a {valve} that is off by a constant would look the same."


def of_one_cause(side: Side, found: SideFindings, inputs: AxleInputs, min_sat: float) -> SideFindings:
    """Findings of a side that is measured twice, those that one cause explains joined.

    Parameters
    ----------
    side : Side
        Sensor or valve.
    found : SideFindings
        Of that side.
    inputs : AxleInputs
        The axle's channels.
    min_sat : float
        Smallest offset that counts [rad or fraction].
    """
    sensor = side is Side.SENSOR
    if not found.findings or not (inputs.angle_redundant if sensor else inputs.valve_redundant):
        return found if sensor else found._replace(findings=_or_all_off(found.findings, inputs.command))
    leaves = ("phi", "phi_true") if sensor else ("u_applied", "u")
    y, x = (inputs.values(leaf) for leaf in leaves)
    use = inputs.timeline.fresh[inputs.channel(leaves[0])] & np.isfinite(y) & np.isfinite(x)
    sound = use.copy()
    for f in found.findings:
        sound[f.start : f.stop] = False
    usual = float(np.quantile(np.abs(y - x)[sound], _LOWER)) if sound.any() else 0.0
    names = (inputs.channel(leaves[0]), inputs.channel(leaves[1]))
    unit = "rad" if sensor else OPENING
    noise = min(_NORMAL * usual, MOST_APART)
    measured = Measured(y, x, use, inputs.timeline.dt, names, unit, noise, min_sat)
    joined = with_one_cause(found.findings, measured)
    return found._replace(findings=tuple(joined) if sensor else _or_all_off(joined, x))


def _or_all_off(findings: Sequence[Finding], command: Array) -> tuple[Finding, ...]:
    """A valve's findings, those beside a command [fraction], shape (n,), that stays where it is as `_or_off` has them."""
    return tuple(_or_off(f) if f.mode.total and _rests(command[f.start : f.stop]) else f for f in findings)


def _or_off(finding: Finding) -> Finding:
    """A valve that does not answer a command which stays where it is; it may be off by a constant as well."""
    share = _AT_REST / max(finding.probability, _AT_REST)
    named = [replace(h, p=h.p * share) for h in finding.hypotheses]
    off = Hypothesis(Side.ACTUATOR.value, FaultMode.OUTSIDE_TABLE.value, 1.0 - sum(h.p for h in named))
    hypotheses = tuple(sorted([*named, off], key=lambda h: -h.p))
    return replace(finding, probability=_AT_REST, hypotheses=hypotheses, evidence=(*finding.evidence, _CONSTANT))


def _rests(command: Array) -> bool:
    """Whether a command stays where it is but for the beginning: the loop then rests behind a valve that is off by as much."""
    known = command[np.isfinite(command)]
    known = known[known.size // 4 :]
    return bool(known.size and np.std(known) < max(_STEADY * abs(float(np.mean(known))), _HARDLY))
