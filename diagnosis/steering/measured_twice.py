"""Findings on a steering axle, measured twice: pieces of one cause; and on its valve: one that may be off instead of dead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.relation import Relation, relation_of
from diagnosis.estimation.by_itself import told_by_itself
from diagnosis.estimation.one_cause import with_one_cause
from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, is_about
from diagnosis.results.sizes import amount
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.late_valves import as_late
from diagnosis.steering.openings import latest, off_command, opens_as_told
from diagnosis.steering.redundancy import MOST_APART, most_lag
from diagnosis.steering.side_findings import SideFindings, span_of
from replay.arrays.quantiles import median_of, quantile_of
from replay.faults import FaultMode, Side, State
from replay.machine.quantities import OPENING

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

# lower quarter of what is off, which a fault that grows before it is found leaves alone, and standard deviations per that
_LOWER, _NORMAL = 0.25, 3.138
#: Probability that a valve does not answer a command which stays, or answers less: 10 of 13 and 93 of 96 were right on simulated machines, where
#: few have a constant offset instead.
_AT_REST, _LESS_AT_REST = 0.6, 0.85
#: The same of a valve that does not answer for a moment: four of four such were no fault of it, on a machine of another user, while another part failed.
_BRIEFLY_S, _BRIEFLY_AT_REST = 1.5, 0.45
_STEADY, _HARDLY = 0.25, 0.05  # of its mean, and of full opening, by which such a command varies
# of a valve that moves as it is told: correlation of opening and command, and the least standard deviation of both that is a motion
_FOLLOWS, _MOTION, _FEW = 0.9, 0.01, 12
_EDGE = 0.15  # of a finding
_ENDS_S, _UNMOVED = 0.15, 0.2  # of a finding, in which a valve comes to rest; of how its command moves meanwhile
_LOSES, _IT_IS = 0.1, 0.85  # of its gain, from which it is a loss; probability of what a measured opening shows
_AS_TOLD = 0.15  # of its command: no further off it, a valve opens as it is told; warm coils give up to 0.16 less
_BRIEF_S = 3.0  # in which a position may be off its command by less than a loss
_SHIFTED = 0.5  # of the loss, from which a zero is no matter of how it changes
_SHOWN = "The measured opening moves with its command: {gain:.2f} of it, {zero:+.1f}{{percent}} off."
_STANDS = "The measured opening stays at {place:+.1f}{{percent}}."
_IN_MIDDLE, _BESIDE = (
    0.02,
    0.04,
)  # of full opening: as far off its zero a valve without signal rests, and further off a stuck one
_MEANWHILE = "Meanwhile {second}, a second measurement of the angle, moved over {other}, and {name} over {own}."
_CONSTANT = (
    "Its command stayed where it was but for the beginning: a {valve} that is off by a constant would look the same."
)


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
    if side is Side.SENSOR:
        return _of_sensor(found, inputs, min_sat) if found.findings and inputs.angle_redundant else found
    if inputs.valve_redundant:
        return _of_valve(found, inputs, min_sat)
    return found._replace(findings=_or_all_off(found.findings, inputs.command, inputs.timeline.dt))


def _of_sensor(found: SideFindings, inputs: AxleInputs, min_sat: float) -> SideFindings:
    y, x, use = _pair(inputs, "phi", "phi_true")
    measured = _measured(found, (y, x, use), inputs, ("phi", "phi_true"), "rad", min_sat)
    return found._replace(findings=tuple(_beside_the_second(f, measured) for f in _explained(found, measured)))


def _of_valve(found: SideFindings, inputs: AxleInputs, min_sat: float) -> SideFindings:
    y, command, use = _pair(inputs, "u_applied", "u")
    sound = _sound(found, use)
    relation = _relation(y, command, sound if sound.any() else use, inputs.timeline.dt)
    measured = _measured(found, (y, command, use), inputs, ("u_applied", "u"), OPENING, min_sat)
    x = relation.expected(command, inputs.timeline.dt)  # what it is late by is no fault
    use = use & np.isfinite(x)
    measured = replace(measured, x=x, use=use)
    told = partial(_not_as_told, pair=(y, command), use=use, relation=relation, inputs=inputs, min_sat=min_sat)
    found = told(found)
    off = told(SideFindings(tuple(off_command(found.findings, measured)), ())).findings
    pieces = tuple(sorted([*found.findings, *off], key=lambda f: f.start))
    found = _as_it_opens(found._replace(findings=pieces), (y, x, use), inputs, min_sat)
    open_: list[Finding] = []
    stands: list[Finding] = []
    for f in as_late(_explained(found, measured), y, command, use, inputs.timeline.dt):
        stays = f.mode.total and _stands_while_told(f, y, command, use, inputs.timeline.dt)
        (stands if stays else open_).append(f)
    found = found._replace(findings=_or_all_off(open_, command, inputs.timeline.dt, losses=True))
    told_of = sorted([*found.findings, *stands], key=lambda f: f.start)
    return found._replace(findings=tuple(f for f in told_of if not _hardly_off(f, measured)))


def _hardly_off(f: Finding, measured: Measured) -> bool:
    """Whether a position is off in no row of the table for so short, and by so small a share of its command, that supply and warm coils do the same."""
    use = measured.use[f.start : f.stop]
    y, x = (z[f.start : f.stop][use] for z in (measured.y, measured.x))
    if f.mode is not FaultMode.OUTSIDE_TABLE or (f.stop - f.start) * measured.dt >= _BRIEF_S or not use.any():
        return False
    return bool(np.sum((y - x) ** 2) < _LOSES**2 * np.sum(x**2))


def _explained(found: SideFindings, measured: Measured) -> list[Finding]:
    return [part for f in with_one_cause(found.findings, measured) for part in told_by_itself(f, measured)]


def _pair(inputs: AxleInputs, leaf: str, beside: str) -> tuple[Array, Array, Flags]:
    """A channel and its reference, and where both are new; of shape (n,)."""
    y, x = inputs.values(leaf), inputs.values(beside)
    return y, x, inputs.timeline.fresh[inputs.channel(leaf)] & np.isfinite(y) & np.isfinite(x)


def _sound(found: SideFindings, use: Flags) -> Flags:
    """Steps of `use`, shape (n,), without a finding."""
    sound = use.copy()
    for f in found.findings:
        sound[f.start : f.stop] = False
    return sound


def _measured(
    found: SideFindings,
    pair: tuple[Array, Array, Flags],
    inputs: AxleInputs,
    leaves: tuple[str, str],
    unit: str,
    min_sat: float,
) -> Measured:
    y, x, use = pair
    sound = _sound(found, use)
    usual = float(quantile_of(np.abs(y - x)[sound], _LOWER)) if sound.any() else 0.0
    names = (inputs.channel(leaves[0]), inputs.channel(leaves[1]))
    noise = min(_NORMAL * usual, MOST_APART)
    return Measured(y, x, use, inputs.timeline.dt, names, unit, noise, min_sat, _LOSES)


def _beside_the_second(finding: Finding, measured: Measured) -> Finding:
    """A sensor that stands still or is silent, with what the second one shows meanwhile."""
    part = slice(finding.start, finding.stop)
    y, x = (z[part][measured.use[part]] for z in (measured.y, measured.x))
    if not finding.mode.total or x.size < _FEW:
        return finding
    own, other = (amount(float(np.ptp(z)), "rad", 2) for z in (y, x))
    text = _MEANWHILE.format(second=measured.names[1], other=other, name=measured.names[0], own=own)
    return replace(finding, evidence=(*finding.evidence, text))


def _relation(y: Array, x: Array, use: Flags, dt: float) -> Relation:
    """How a valve's opening follows its command, with its lag and play; all of shape (n,)."""
    span = float(np.max(np.abs(x[use]), initial=0.0))
    return relation_of(y, x, use, Relation(), dt, (0, most_lag(dt)), span)._replace(gain=1.0)


def _not_as_told(
    found: SideFindings,
    pair: tuple[Array, Array],
    use: Flags,
    relation: Relation,
    inputs: AxleInputs,
    min_sat: float,
) -> SideFindings:
    """A valve's findings without what its measured opening denies; `pair` of opening and command, and `use`, of shape (n,)."""
    kept, open_, dt = [], list(found.unexplained), inputs.timeline.dt
    reach = latest(relation.delay * dt + relation.lag, dt)
    for f in found.findings:
        part = slice(max(0, f.start - reach), f.stop)
        y, x = (z[part] for z in pair)
        own = use[part] & (np.arange(part.start, part.stop) >= f.start)
        if not f.mode.total and opens_as_told(y, x, own, reach, loss=_LOSES, least=min_sat):
            open_.append(_blocks_of(f, inputs))
        else:
            kept.append(f)
    return SideFindings(tuple(kept), tuple(open_))


def _blocks_of(finding: Finding, inputs: AxleInputs) -> tuple[int, int]:
    length = 1 if inputs.blocks is None else inputs.blocks.length
    return span_of(finding, length)


def _as_it_opens(
    found: SideFindings, pairs: tuple[Array, Array, Flags], inputs: AxleInputs, min_sat: float
) -> SideFindings:
    """A valve's findings, none of them stuck or dead while its measured opening moves with the command: `pairs` of both, shape (n,), and where."""
    kept, open_ = [], list(found.unexplained)
    for f in found.findings:
        edge = round(_EDGE * (f.stop - f.start))  # a valve that begins to stick has moved until then
        inner = slice(f.start + edge, f.stop - edge)
        y, x = (z[inner][pairs[2][inner]] for z in pairs[:2])
        if f.mode.total and x.size >= _FEW and _rms(y - x) < max(min_sat, _AS_TOLD * _rms(x)):
            open_.append(_blocks_of(f, inputs))  # it stands where it is told to
            continue
        moves = f.mode.total and x.size >= _FEW and min(np.std(x), np.std(y)) >= _MOTION
        if not moves or float(np.corrcoef(x, y)[0, 1]) < _FOLLOWS:
            still = f.mode.total and x.size >= _FEW and float(np.std(y)) < _MOTION
            kept.append(_by_its_place(f, y) if still else f)
            continue
        gain = float(np.cov(x, y)[0, 1] / np.var(x, ddof=1))
        zero = float(np.mean(y) - gain * np.mean(x))
        lost = 1.0 - gain
        if abs(lost) < _LOSES and abs(zero) < min_sat:
            open_.append(_blocks_of(f, inputs))
            continue
        shifted = abs(zero) >= max(min_sat, _SHIFTED * lost * float(np.sqrt(np.mean(x**2))))
        mode = FaultMode.INEFFICIENT if lost >= _LOSES and not shifted else FaultMode.OUTSIDE_TABLE
        kept.append(
            replace(
                f,
                mode=mode,
                probability=_IT_IS,
                hypotheses=(
                    Hypothesis(Side.ACTUATOR.value, mode.value, _IT_IS),
                    Hypothesis("none", State.HEALTHY.value, 1.0 - _IT_IS),
                ),
                epsilon=Epsilon(lost, lost - _LOSES, min(1.0, lost + _LOSES)) if abs(lost) >= _LOSES else None,
                sat=None,
                evidence=(
                    _SHOWN.format(gain=gain, zero=100.0 * zero),
                    *(e for e in f.evidence if not is_about(e, About.TIMES)),
                ),
            )
        )
    return SideFindings(tuple(kept), tuple(open_))


def _rms(z: Array) -> float:
    return float(np.sqrt(np.mean(z**2)))


def _by_its_place(finding: Finding, opening: Array) -> Finding:
    """A valve that stands still, by where it does: about its middle it has no signal, elsewhere it is stuck. `opening` of shape (n,) [fraction]."""
    middle = float(median_of(opening))
    mode = (
        FaultMode.NO_SIGNAL if abs(middle) < _IN_MIDDLE else FaultMode.STUCK if abs(middle) > _BESIDE else finding.mode
    )
    if mode is finding.mode:
        return finding
    other = {finding.mode.value: mode.value, mode.value: finding.mode.value}
    named = tuple(
        replace(h, mode=other.get(h.mode, h.mode)) if h.side == finding.side else h for h in finding.hypotheses
    )
    evidence = (_STANDS.format(place=100.0 * middle), *(e for e in finding.evidence if not is_about(e, About.TIMES)))
    return replace(finding, mode=mode, hypotheses=named, evidence=evidence)


def _or_all_off(findings: Sequence[Finding], command: Array, dt: float, *, losses: bool = False) -> tuple[Finding, ...]:
    """A valve's findings, those beside a command [fraction], shape (n,), that stays where it is as `_or_off` has them; `losses`: also of gain.

    `dt` is a step [s].
    """

    def constant(f: Finding) -> bool:
        return (f.mode.total or (losses and f.mode is FaultMode.INEFFICIENT)) and _rests(command[f.start : f.stop])

    return tuple(_or_off(f, (f.stop - f.start) * dt) if constant(f) else f for f in findings)


def _or_off(finding: Finding, seconds: float) -> Finding:
    """A valve that does not answer a command which stays where it is; it may be off by a constant as well."""
    most = _AT_REST if seconds > _BRIEFLY_S else _BRIEFLY_AT_REST
    most = _LESS_AT_REST if finding.mode is FaultMode.INEFFICIENT else most
    finding = replace(finding, evidence=(*finding.evidence, _CONSTANT))
    if finding.probability <= most:  # as little as that already
        return finding
    named = [replace(h, p=h.p * most / finding.probability) for h in finding.hypotheses]
    off = Hypothesis(Side.ACTUATOR.value, FaultMode.OUTSIDE_TABLE.value, 1.0 - sum(h.p for h in named))
    return replace(finding, probability=most, hypotheses=tuple(sorted([*named, off], key=lambda h: -h.p)))


def _stands_while_told(finding: Finding, opening: Array, command: Array, use: Flags, dt: float) -> bool:
    """Whether a measured opening stands while its command moves, if only at the beginning: one that is off by a constant would move with it.

    Arrays of shape (n,).
    """
    edge = round(_ENDS_S / dt)
    part = slice(finding.start + edge, max(finding.start + edge, finding.stop - edge))
    y, x = (z[part][use[part]] for z in (opening, command))
    return bool(x.size >= _FEW and np.std(x) >= _HARDLY and np.std(y) < _UNMOVED * np.std(x))


def _rests(command: Array) -> bool:
    """Whether a command stays where it is but for the beginning: the loop then rests behind a valve that is off by as much."""
    known = command[np.isfinite(command)]
    known = known[known.size // 4 :]
    return bool(known.size and np.std(known) < max(_STEADY * abs(float(np.mean(known))), _HARDLY))
