"""From the spells of a wheel to its two sides: states over time, findings, and what is said of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.by_channel import broken_off, lost_of, once_a_turn, spikes_of
from diagnosis.response.findings import finding_of
from diagnosis.response.inputs import cell_of
from diagnosis.response.machine import Judged
from diagnosis.response.models import HEALTHY, LEAST_P, NOISY, OTHER, SILENT
from diagnosis.response.shaking import shaken
from diagnosis.response.spells import Spell
from diagnosis.response.stays import stays_though_told
from diagnosis.response.wheel import Wheel
from diagnosis.results.assessment import CODE, Assessment, Finding, Lack, Reason
from diagnosis.results.evidence_columns import Pictured, steps_of
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_S = 1.0
_STANDS_P = (
    0.7  # that an only drive, or its sensor, is at fault rather than the machine stopped, or its commands ignored
)
_PAUSES_P, _BACK_S = 0.5, 1.0  # the same where it goes on again by itself, and for how long it then moves
_ROLLS_P = 0.92  # that a wheel without a drive which reads nothing is read wrong, rather than held by a brake
_DOUBT_S = 0.5  # around a spell that is judged no fault
_AT_ONCE_S = 5e-3
_HIDDEN = "a controller that holds the speed hides a weak drive, and the effort of a healthy one is not known"
_ROLLS = Reason(
    "its effort is nothing from end to end while others pull: no {valve} is seen there, or it is dead", Lack.DRIVE
)
_ALONE = "a controller that holds the speed hides a weak drive; name its current, duty or torque as its command (`wheel.{name}.u`) to have it judged"
_UNANSWERED = Reason(
    "how it answers its command does not show in this log, which is too short, or has too few changes of the command, so that only a speed that is "
    "frozen, wild or noisy shows",
    Lack.ANSWER,
)
_UNSEEN = "without its command or another {wheel} of its side only a speed that is frozen, wild or noisy shows"


def sides_of(
    one: Judged,
    spells: Sequence[Spell],
    known: tuple[Sequence[Finding], Sequence[Finding]],
    machine: tuple[Flags, Flags],
    limits: Limits,
    dt: float,
) -> tuple[Assessment, Assessment]:
    """Sensor and drive of a wheel.

    Flags by steps of shape (n,), by blocks of shape (blocks,).

    Parameters
    ----------
    one : Judged
        The wheel.
    spells : Sequence[Spell]
        Its faults along the most probable states.
    known : tuple[Sequence[Finding], Sequence[Finding]]
        What is known to be its drive's, and times in which its speed comes late.
    machine : tuple[Flags, Flags]
        Where the machine as a whole stands, by steps, and where all wheels are held back together, by blocks.
    limits : Limits
        ``driving_speed``.
    dt : float
        Step [s].
    """
    (drives, late), (idle, together) = known, machine
    wheel, blocks, size = one.wheel, one.wheel.blocks, one.data.y.size
    width = -(-size // blocks.start.size) if blocks.start.size < 2 else int(blocks.start[1])
    findings, doubtful = spikes_of(wheel, one.data.y, limits.driving_speed, one.others), one.posterior[:, HEALTHY] < 0.5
    doubtful = doubtful & ~((one.posterior.argmax(axis=1) == OTHER) & (one.speed is None) & one.calm)
    if one.speed is None:
        doubtful &= ~(together & (one.posterior.argmax(axis=1) != SILENT))
    for f in drives:
        doubtful[f.start // width : -(-f.stop // width)] = False
    for spell in spells:
        if not spell.own and _met(spell, drives, width):
            continue
        if not spell.own and _met(spell, late, width) and spell.unspecific:
            continue  # what is late is less, or more, whenever the speed changes
        long = (spell.stop - spell.start) * width * dt >= _LEAST_S
        found = finding_of(spell, *_shown_by(one, spell)) if long and spell.p >= LEAST_P else None
        if found is not None:
            alone = by_itself(found, back=_goes_on(one, found, limits, dt)) if one.alone else found
            findings.append(alone if one.alone else _undriven(found) if one.rolls else shaken(found, one))
        elif one.posterior[spell.start : spell.stop].argmax(axis=1).min() > NOISY and _entered_calmly(
            one, spell, width, dt
        ):
            doubtful[spell.start : spell.stop] = False  # what came slowly is slip or load, no sensor's fault
    if not one.response.answered and one.speed is None:
        findings.extend(broken_off(wheel, one.others, limits.driving_speed))
    if not one.response.answered:
        told = stays_though_told(one, limits.driving_speed)
        findings.extend(f for f in told if not any(f.start < g.stop and g.start < f.stop for g in (*findings, *drives)))
    there = np.isfinite(one.data.y)
    driving = np.repeat(one.driving, width)[:size]
    findings = without_doubles([*findings, *late, *lost_of(wheel, one.data.lost, driving)])
    sensor = np.where(driving, CODE[State.HEALTHY], CODE[State.NOT_EXCITED]).astype(np.int8)
    unseen = not one.response.answered and one.speed is None
    sensor[np.repeat(doubtful | (one.driving & unseen), width)[:size]] = CODE[State.NOT_ASSESSED]
    if one.speed is None:  # nothing says what it should read
        sensor[driving & _uncommanded(one, cell_of(dt), size)] = CODE[State.NOT_ASSESSED]
    drive = np.where(driving, CODE[State.NOT_ASSESSED], CODE[State.NOT_EXCITED]).astype(np.int8)
    for states in (sensor, drive):
        states[idle] = CODE[State.NOT_ASSESSED]
        states[~there] = CODE[State.NO_DATA]
    drives = [*drives, *(f for f in findings if f.side is Side.ACTUATOR)]
    findings = [f for f in findings if f.side is not Side.ACTUATOR]
    for f in drives:
        drive[f.start : f.stop] = CODE[State(f.mode.value)]
    both = [f for f in findings if len(f.side.sides) > 1]
    for f in findings:
        sensor[f.start : f.stop] = CODE[State(f.mode.value)]
        drive[f.start : f.stop] = CODE[State(f.mode.value) if f in both else State.MASKED]
    return _assessment(one, sensor, tuple(findings), limits, dt), _drive(one, drive, (*drives, *both))


def _uncommanded(one: Judged, cell: int, size: int) -> Flags:
    """Steps at which no command is known, shape (size,): a robot may go on with the last one, or stop."""
    return np.repeat(~np.isfinite(one.data.commands).all(axis=1), cell)[:size]


def _goes_on(one: Judged, found: Finding, limits: Limits, dt: float) -> bool:
    """Whether a drive that stood moves again after it."""
    after = np.abs(np.nan_to_num(one.data.y[found.stop :])) > limits.driving_speed
    return found.mode is FaultMode.NO_SIGNAL and bool(np.count_nonzero(after) * dt >= _BACK_S)


def by_itself(found: Finding, *, back: bool = False) -> Finding:
    """A finding on the only drive, less sure where its command alone contradicts it: a machine may be stopped, or driven otherwise.

    `back`: it stood and moves again, as after an emergency stop, and as a drive that fails seldom does.
    """
    if found.side is not Side.SENSOR_OR_ACTUATOR:
        return found
    first = found.hypotheses[0]
    p = (_PAUSES_P if back else _STANDS_P) * found.probability
    rest = Hypothesis("none", State.HEALTHY.value, 1.0 - p)
    text = "With a single drive, an emergency stop, a machine that is disabled, or commands that are ignored look the same."
    return replace(found, probability=p, hypotheses=(replace(first, p=p), rest), evidence=(*found.evidence, text))


def _undriven(found: Finding) -> Finding:
    """A finding on a wheel of which no drive is seen: its sensor, unless the wheel itself is held."""
    if found.side is not Side.SENSOR_OR_ACTUATOR:
        return found
    p = _ROLLS_P * found.probability
    rest = Hypothesis(Side.ACTUATOR.value, FaultMode.STUCK.value, 1.0 - p)
    text = "The effort of this {wheel} is nothing from end to end, so that it only rolls: a brake or a bearing that holds it looks the same."
    hypotheses = (Hypothesis(Side.SENSOR.value, found.mode.value, p), rest)
    return replace(found, side=Side.SENSOR, probability=p, hypotheses=hypotheses, evidence=(*found.evidence, text))


def _met(spell: Spell, findings: Sequence[Finding], width: int) -> bool:
    """Whether any finding is at the time of a spell."""
    return any(f.start < spell.stop * width and spell.start * width < f.stop for f in findings)


def _shown_by(one: Judged, spell: Spell) -> tuple[Wheel, Array | None]:
    """The wheel and its speed by the channels that contradict it in a spell: its own position first."""
    if one.joint is None or not spell.own:
        return one.wheel, one.speed
    view = one.joint.view
    return one.wheel._replace(compared=view.compared, own=False), view.speed


def without_doubles(findings: Sequence[Finding]) -> list[Finding]:
    """In order of time; of two that say the same of the same time, as spikes and noise do, the longer one."""
    kept: list[Finding] = []
    for f in sorted(findings, key=lambda f: f.start - f.stop):
        if not any(f.mode is k.mode and f.start < k.stop and k.start < f.stop for k in kept):
            kept.append(f)
    return sorted(kept, key=lambda f: f.start)


def _entered_calmly(one: Judged, spell: Spell, width: int, dt: float) -> bool:
    """Whether a spell began and ended in calm moments, in which a jump would have been seen."""
    reach = max(1, round(_DOUBT_S / (width * dt)))
    ends = (spell.start, spell.stop - 1)
    return all(bool(one.calm[max(0, k - reach) : k + reach + 1].all()) for k in ends)


def _assessment(
    one: Judged, states: NDArray[np.int8], findings: tuple[Finding, ...], limits: Limits, dt: float
) -> Assessment:
    y, size, cell = one.data.y, one.data.y.size, cell_of(dt)
    expected = np.repeat(one.response.expected, cell)[:size]
    width = np.repeat(3.0 * one.response.noise + 0.5 * (one.response.high - one.response.low), cell)[:size]
    series = (("residual", y - expected), ("expected", expected), ("threshold", width))
    pictured = Pictured.of(steps_of(findings, size, dt), series)
    r = one.response
    unseen = not r.answered and one.speed is None
    late = "at once" if r.delay < _AT_ONCE_S else f"after {plain(r.delay, 2)} s"
    note = (
        f"{one.data.name} has no command{'' if not np.isfinite(one.data.commands).any() else ' that it was found to answer'}"
        if not r.answered
        else (
            f"{one.data.name} answers its command {late} with a lag of {plain(r.lag, 2)} s, up to {plain(r.limit)} {{speed_unit}} and "
            f"{plain(r.rate, 2)} m/s²; usual misfit {plain(float(np.median(r.noise)), 2)} {{speed_unit}}"
        )
    )
    note += f"; compared with {one.wheel.compared}." if one.wheel.compared else "."
    wild = int(one.wheel.samples.wild.sum())
    turns = once_a_turn(one.wheel.samples, one.data.y, one.wheel.dt)
    why = ": one a turn, as where the angle that they come from starts anew" if turns else ""
    notes = (note, *((f"{wild} wild readings of {one.data.name} were set aside{why}.",) if wild else ()))
    reasons = {
        State.NOT_ASSESSED: _UNSEEN
        if unseen
        else "the speed is neither what its command nor what other channels make likely, and no known fault explains it",
        State.NOT_EXCITED: _at_rest(one),
        State.NO_DATA: "no samples",
    }
    made = Assessment(states, reasons, findings, pictured.columns, Tier.RESPONSE, notes, closeups=pictured.closeups)
    asked = unseen and bool(np.isfinite(one.data.commands).all(axis=1).any())
    return made.reasoned(State.NOT_ASSESSED, _UNANSWERED) if asked else made


def _at_rest(one: Judged) -> str:
    """Why nothing shows where a wheel stands still."""
    return (
        "nothing is commanded"
        if np.isfinite(one.data.commands).any()
        else "the wheel stands still, and no command is recorded"
    )


def _drive(one: Judged, states: NDArray[np.int8], findings: tuple[Finding, ...]) -> Assessment:
    hidden = _ALONE.replace("{name}", one.data.name.split(".")[1]) if one.alone else _HIDDEN
    reasons = {
        State.NOT_EXCITED: _at_rest(one),
        State.NO_DATA: "no samples",
        State.MASKED: "its {wheel.sensor} is faulty",
    }
    why = _ROLLS if one.rolls else Reason(hidden)
    return Assessment(states, reasons, findings, {}, Tier.RESPONSE).reasoned(State.NOT_ASSESSED, why)
