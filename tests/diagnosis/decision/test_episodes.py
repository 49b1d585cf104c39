"""Pieces of one fault are one fault; faults with healthy time between them are not."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from diagnosis.decision.episodes import with_episodes
from diagnosis.decision.intervals import intervals_of
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, Sentence
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from tests.diagnosis.decision.findings import MACHINE, STEP, N, assessed, finding

DT = 0.001


def parts(*findings: Finding, between: State = State.NOT_ASSESSED) -> dict[tuple[str, str], Assessment]:
    states = np.full(N, CODE[State.HEALTHY])
    for a, b in pairwise(findings):
        states[a.stop : b.start] = CODE[between]
    for f in findings:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    side = Assessment(states=states, findings=findings, tier=Tier.MODEL)
    both = findings[0].side is Side.SENSOR_OR_ACTUATOR
    sides = ("sensor", "actuator") if both else (findings[0].side.value,)
    return {("FR", s): side for s in sides}


def joined(*findings: Finding, between: State = State.NOT_ASSESSED) -> tuple[Finding, ...]:
    found = with_episodes(parts(*findings, between=between), DT)
    assert len({a.findings for a in found.values()}) == 1
    return next(iter(found.values())).findings


def loss(start: int, stop: int, epsilon: float = 0.25, side: Side = Side.ACTUATOR) -> Finding:
    return finding(side, FaultMode.INEFFICIENT, start, stop, epsilon=epsilon)


@pytest.mark.parametrize("side", list(Side))
def test_pieces_of_one_loss_are_one_fault(side: Side) -> None:
    (one,) = joined(*(loss(a, a + 500, side=side) for a in (1000, 3000, 6000)))
    assert (one.start, one.stop) == (1000, 6500)
    assert one.epsilon is not None
    assert one.epsilon.value == pytest.approx(0.25)
    assert "3 stretches (1.0–1.5 s, 3.0–3.5 s, 6.0–6.5 s); between them nothing healthy was seen" in one.course[-1]


def test_the_onset_is_told_before_what_comes_later() -> None:
    (one,) = joined(*(loss(a, a + 500) for a in (1000, 3000)))
    told = replace(one, evidence=(*one.evidence, "Onset"))
    (fault,) = intervals_of({("FR", "actuator"): assessed(told)}, MACHINE, HYDRAULIC, 0, STEP)
    assert [e[:5] for e in fault.evidence] == ["what ", "Onset", "It sh"]


def test_healthy_time_between_makes_two_faults() -> None:
    assert len(joined(loss(1000, 1500), loss(3000, 3500), between=State.HEALTHY)) == 2


def test_a_drive_of_which_nothing_healthy_is_said_joins_no_dropouts() -> None:
    out = (Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL)
    found = parts(finding(*out, 1000, 1500), finding(*out, 3000, 3500), between=State.HEALTHY)
    drive = found["FR", "actuator"]
    unknown = np.where(drive.states == CODE[State.HEALTHY], CODE[State.NOT_ASSESSED], drive.states)
    found["FR", "actuator"] = replace(drive, states=unknown)
    spans = [(f.start, f.stop) for f in with_episodes(found, DT)["FR", "sensor"].findings]
    assert spans == [(1000, 1500), (3000, 3500)]


def test_losses_of_another_size_are_another_fault() -> None:
    assert len(joined(loss(1000, 1500, 0.2), loss(3000, 3500, 0.6))) == 2


def test_a_loss_that_grows_is_one_fault_with_its_course() -> None:
    (one,) = joined(loss(1000, 1500, 0.1), loss(1500, 4500, 0.4))
    assert (one.start, one.stop) == (1000, 4500)
    assert one.epsilon is not None
    assert 0.3 < one.epsilon.value <= 0.4
    assert "2 stretches (1.0–1.5 s: 10 % lost, 1.5–4.5 s: 40 % lost)" in one.course[-1]


def test_other_rows_are_other_faults() -> None:
    stuck = finding(Side.ACTUATOR, FaultMode.STUCK, 3000, 3500)
    assert len(joined(loss(1000, 1500), stuck, loss(6000, 6500))) == 3


def test_a_single_fault_stays_as_it_is() -> None:
    one = loss(1000, 1500)
    assert joined(one)[0] is one


def test_a_sentence_gives_the_probability_of_the_whole() -> None:
    said = Sentence(About.CASES, "on simulated machines with such signals it was this in ", "38", " of 100 cases.")
    (one,) = joined(replace(loss(1000, 1500), probability=0.89, evidence=(said, "Next best: 7 of 100.")))
    assert one.evidence == (said.replace("38", "89"), "Next best: 7 of 100.")


def unclear(start: int, stop: int, **shares: float) -> Finding:
    """A finding of which no row has the majority."""
    hypotheses = tuple(Hypothesis("actuator", mode, p) for mode, p in shares.items())
    first = max(hypotheses, key=lambda h: h.p)
    found = finding(Side.ACTUATOR, FaultMode(first.mode), start, stop, p=first.p)
    return replace(found, hypotheses=hypotheses)


def test_a_piece_of_unclear_kind_belongs_to_the_fault_that_it_touches() -> None:
    stuck = finding(Side.ACTUATOR, FaultMode.STUCK, 1000, 5000)
    (one,) = joined(stuck, unclear(5000, 6000, inefficient=0.4, stuck=0.3, noisy=0.3))
    assert (one.start, one.stop, one.mode) == (1000, 6000, FaultMode.STUCK)
    assert one.hypotheses == stuck.hypotheses
    assert one.course[-1].startswith("From 5.00 to 6.00 s its kind is unclear")


def test_it_goes_to_the_fault_that_it_more_probably_is_of() -> None:
    stuck, noisy = (
        finding(Side.ACTUATOR, m, a, a + 3000) for m, a in ((FaultMode.STUCK, 1000), (FaultMode.NOISY, 5000))
    )
    found = joined(stuck, unclear(4000, 5000, inefficient=0.4, stuck=0.2, noisy=0.4), noisy)
    assert [(f.mode, f.start, f.stop) for f in found] == [
        (FaultMode.STUCK, 1000, 4000),
        (FaultMode.NOISY, 4000, 8000),
    ]


@pytest.mark.parametrize(
    "piece",
    [
        unclear(5000, 6000, inefficient=0.4, noisy=0.4, no_signal=0.2),  # never stuck
        unclear(5300, 6000, inefficient=0.4, stuck=0.3, noisy=0.3),  # apart
        unclear(5000, 9500, inefficient=0.4, stuck=0.3, noisy=0.3),  # longer
    ],
)
def test_other_pieces_of_unclear_kind_stay_faults(piece: Finding) -> None:
    assert len(joined(finding(Side.ACTUATOR, FaultMode.STUCK, 1000, 5000), piece, between=State.HEALTHY)) == 2


def test_a_piece_that_may_be_dead_is_not_hidden_in_a_loss() -> None:
    piece = unclear(5000, 6000, stuck=0.45, no_signal=0.3, inefficient=0.25)
    assert len(joined(loss(1000, 5000), piece)) == 2


@pytest.mark.parametrize(("expected", "faults"), [(0.05, 1), (0.2, 2)])
def test_healthy_time_in_which_a_loss_would_not_show_ends_none(expected: float, faults: int) -> None:
    """A quarter of little is less than the threshold: that a valve was called healthy at rest says nothing of it."""
    pieces = (loss(1000, 1500), loss(2100, 2600))
    ((part, one),) = parts(*pieces, between=State.HEALTHY).items()
    columns = {"expected": np.full(N, expected, np.float32), "threshold": np.full(N, 0.03, np.float32)}
    found = with_episodes({part: replace(one, columns=columns)}, DT)
    assert len(found[part].findings) == faults


def late(start: int, stop: int, ms: int = 300) -> Finding:
    text = Sentence(About.LATE, "It comes ", f"{ms}", " ms after another: a delay.")
    return replace(finding(Side.SENSOR, FaultMode.OUTSIDE_TABLE, start, stop), epsilon=None, evidence=(text,))


@pytest.mark.parametrize(("second", "steady", "count"), [(300, True, 1), (300, False, 2), (120, True, 2)])
def test_a_delay_that_shows_at_every_change_is_one_fault(second: int, count: int, *, steady: bool) -> None:
    """While its reference stays, a channel that is late looks healthy; where it changes, it would not."""
    found = parts(late(1000, 1500), late(6000, 6500, second), between=State.HEALTHY)
    t = np.arange(N) / 1000.0
    expected = np.full(N, 0.3) if steady else 0.3 + 0.2 * np.sin(4.0 * t)
    columns = {"expected": expected.astype(np.float32), "threshold": np.full(N, 0.01, np.float32)}
    found = {part: replace(a, columns=columns) for part, a in found.items()}
    told = with_episodes(found, DT)["FR", "sensor"].findings
    assert len(told) == count
    if count == 1:
        assert "between them hardly anything changed" in told[0].course[-1]


def test_the_most_that_a_growing_loss_has_been_is_within_its_bounds() -> None:
    first, last = (
        replace(loss(a, a + n), epsilon=Epsilon(value, low, high))
        for a, n, value, low, high in ((1000, 2500, 0.28, 0.1, 0.45), (3600, 1300, 0.47, 0.3, 0.64))
    )
    (one,) = joined(first, last)
    assert one.epsilon is not None
    assert one.epsilon.value < 0.47
    assert one.epsilon.high == 0.64


def measured(gain: float) -> dict[tuple[str, str], Assessment]:
    """Two pieces of a loss of .4 with what is called healthy between them, in which the part gives `gain` of what is expected."""
    found = parts(loss(1000, 3000, 0.4), loss(4000, 6000, 0.4), between=State.HEALTHY)
    x = 0.3 * np.sin(0.01 * np.arange(N))
    y = 0.6 * x
    y[3000:4000] = gain * x[3000:4000]
    columns = {"expected": x, "residual": y - x, "threshold": np.full(N, 0.01)}
    return {part: replace(a, columns=columns) for part, a in found.items()}


@pytest.mark.parametrize(("gain", "faults"), [(0.65, 1), (0.97, 2)])
def test_what_fits_the_loss_between_its_pieces_is_not_healthy(gain: float, faults: int) -> None:
    """One constant loss was told as two, with the widest bounds of either, for nine tenths of a second that were called healthy."""
    out = with_episodes(measured(gain), DT)["FR", "actuator"]
    assert len(out.findings) == faults
    assert set(out.states[3000:4000]) == {CODE[State.INEFFICIENT if faults == 1 else State.HEALTHY]}
    assert set(out.states[:1000]) == {CODE[State.HEALTHY]}


def test_nothing_stays_called_healthy_between_the_pieces_of_one_fault() -> None:
    """Where the loss would hardly show, it is not known whether the part was healthy: the timeline said so beside *nothing healthy was seen*."""
    found = parts(loss(1000, 3000, 0.4), loss(3200, 6000, 0.4), between=State.HEALTHY)
    out = with_episodes(found, DT)["FR", "actuator"]
    assert len(out.findings) == 1
    assert set(out.states[3000:3200]) == {CODE[State.NOT_ASSESSED]}
    assert out.reasons[State.NOT_ASSESSED] == "a fault before and after it would hardly show"
    (one,) = out.findings
    assert "what looks healthy between them is too brief, or would show too little of it" in one.course[-1]
