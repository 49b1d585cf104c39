"""Severity and advice by Assumptions 1 and 2."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from diagnosis.decision.caveats import doubts_of
from diagnosis.decision.intervals import intervals_of
from diagnosis.decision.severity import AGAIN, advised, halved_words, severity_of, unbounded_words
from diagnosis.decision.wording import actions_of
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import Epsilon, FaultInterval, Hypothesis
from diagnosis.results.vocabulary import Severity, Verdict
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.decision.findings import LIMITS, MACHINE, STEP, assessed, finding

TOTAL = pytest.mark.parametrize("mode", [FaultMode.STUCK, FaultMode.NO_SIGNAL])


@TOTAL
def test_assumption_1_brief_sensor_fault_is_tolerable(mode: FaultMode) -> None:
    severity, advice = severity_of(finding(Side.SENSOR, mode), 1.0, LIMITS, HYDRAULIC)
    assert severity == "low"
    assert "Tolerable" in advice
    assert "Assumption 1" in advice


@TOTAL
def test_assumption_1_persistent_sensor_fault_means_stop(mode: FaultMode) -> None:
    severity, advice = severity_of(finding(Side.SENSOR, mode), 1.001, LIMITS, HYDRAULIC)
    assert severity == "high"
    assert "Stop and repair" in advice
    assert severity_of(finding(Side.SENSOR, mode), 1.5, Limits(brief=2.0), HYDRAULIC)[0] == "low"


@TOTAL
@pytest.mark.parametrize("seconds", [0.05, 100.0])
def test_assumption_2_actuator_fault_means_stop_at_once(mode: FaultMode, seconds: float) -> None:
    severity, advice = severity_of(finding(Side.ACTUATOR, mode), seconds, LIMITS, HYDRAULIC)
    assert severity == "high"
    assert "Stop at once" in advice
    assert "Assumption 2" in advice


@TOTAL
def test_drive_that_may_be_either_is_treated_as_the_actuator(mode: FaultMode) -> None:
    assert severity_of(finding(Side.SENSOR_OR_ACTUATOR, mode), 0.5, LIMITS, HYDRAULIC)[0] == "high"


@pytest.mark.parametrize("side", list(Side))
@pytest.mark.parametrize("mode", [FaultMode.INEFFICIENT, FaultMode.NOISY])
def test_other_rows_are_watched(side: Side, mode: FaultMode) -> None:
    marked, advice = severity_of(finding(side, mode, epsilon=0.4), 60.0, LIMITS, HYDRAULIC)
    slight, _ = severity_of(finding(side, mode, epsilon=0.15), 60.0, LIMITS, HYDRAULIC)
    assert (marked, slight) == ("medium", "low")
    assert "no reason to stop" in advice


@pytest.mark.parametrize(
    ("side", "mode", "words"),
    [
        (Side.SENSOR, FaultMode.INEFFICIENT, "It may have lost up to 61 %: "),
        (Side.SENSOR, FaultMode.NOISY, "It may give more noise than signal: "),
        (Side.ACTUATOR, FaultMode.NOISY, "It may follow noise more than its command: "),
    ],
)
def test_a_part_that_may_have_lost_half_is_checked_before_the_machine_goes_out(
    side: Side, mode: FaultMode, words: str
) -> None:
    severity, advice = severity_of(finding(side, mode, epsilon=0.6), 60.0, LIMITS, HYDRAULIC)
    assert severity == "medium"
    assert advice == f"{words}check it before the machine goes out again."
    severity, advice = severity_of(finding(side, mode, epsilon=0.6, p=0.8), 60.0, LIMITS, HYDRAULIC)
    assert severity == "low"
    assert advice.endswith("check it before the machine goes out again.")


def test_gain_outside_the_table_is_checked() -> None:
    severity, advice = severity_of(finding(Side.SENSOR, FaultMode.OUTSIDE_TABLE, epsilon=-0.4), 60.0, LIMITS, HYDRAULIC)
    assert severity == "medium"
    assert "scaling" in advice


@pytest.mark.parametrize("side", list(Side))
@pytest.mark.parametrize("mode", list(FaultMode))
def test_improbable_faults_are_no_ground_to_act(side: Side, mode: FaultMode) -> None:
    assert severity_of(finding(side, mode, p=0.59), 60.0, LIMITS, HYDRAULIC)[0] == "info"


@pytest.mark.parametrize("side", list(Side))
@pytest.mark.parametrize("mode", list(FaultMode))
def test_probable_faults_are_worth_a_check(side: Side, mode: FaultMode) -> None:
    dead_valve = side is not Side.SENSOR and mode in (FaultMode.STUCK, FaultMode.NO_SIGNAL)
    part = finding(side, mode, p=0.89, epsilon=1.0 if mode.total else 0.5)
    assert severity_of(part, 60.0, LIMITS, HYDRAULIC)[0] == ("medium" if dead_valve else "low")


def test_what_is_more_probably_alive_does_not_stop_the_machine() -> None:
    found = finding(Side.ACTUATOR, FaultMode.STUCK, p=0.3)
    found = replace(found, hypotheses=(Hypothesis("actuator", "stuck", 0.3), Hypothesis("actuator", "noisy", 0.69)))
    assert severity_of(found, 8.0, LIMITS, HYDRAULIC)[0] == "medium"


def split(*parts: tuple[str, str, float]) -> tuple[Hypothesis, ...]:
    return tuple(Hypothesis(*part) for part in parts)


@TOTAL
def test_a_part_that_may_be_the_other_one_does_not_stop_the_machine(mode: FaultMode) -> None:
    found = replace(
        finding(Side.ACTUATOR, mode, p=0.5),
        hypotheses=split(("actuator", mode.value, 0.5), ("sensor", "stuck", 0.48), ("none", "healthy", 0.02)),
    )
    severity, advice = severity_of(found, 8.0, LIMITS, HYDRAULIC)
    assert severity == "medium"
    assert "which part is not certain" in advice


def test_odds_of_three_to_one_for_a_dead_part_stop_the_machine() -> None:
    for p, expected in ((0.7, "medium"), (0.8, "high")):
        rest = ("actuator", "noisy", 0.98 - p)
        found = replace(
            finding(Side.ACTUATOR, FaultMode.STUCK, p=p),
            hypotheses=split(("actuator", "stuck", p), rest, ("none", "healthy", 0.02)),
        )
        assert severity_of(found, 8.0, LIMITS, HYDRAULIC)[0] == expected


def test_stuck_or_silent_is_one_dead_part() -> None:
    found = replace(
        finding(Side.SENSOR, FaultMode.STUCK, p=0.5),
        hypotheses=split(("sensor", "stuck", 0.5), ("sensor", "no_signal", 0.48), ("none", "healthy", 0.02)),
    )
    assert severity_of(found, 8.0, LIMITS, HYDRAULIC)[0] == "high"


def test_the_risk_decides_and_not_the_most_probable_row() -> None:
    rows = (("actuator", "inefficient", 0.49), ("actuator", "stuck", 0.44), ("none", "healthy", 0.07))
    likely = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, epsilon=0.97)
    likely = replace(likely, hypotheses=tuple(Hypothesis(*row) for row in rows))
    assert severity_of(likely, 10.0, LIMITS, HYDRAULIC)[0] is Severity.HIGH
    half = replace(likely, epsilon=Epsilon(0.5, 0.4, 0.6))
    assert severity_of(half, 10.0, LIMITS, HYDRAULIC)[0] is Severity.MEDIUM


@pytest.mark.parametrize(
    ("mode", "stuck", "words"),
    [
        (FaultMode.INEFFICIENT, 0.44, "It may be stuck or without signal"),
        (FaultMode.NOISY, 0.48, "It may be stuck or without signal"),
        (FaultMode.STUCK, 0.6, "Probably stuck or without signal"),
        (FaultMode.NOISY, 0.1, "This alone is no reason to stop"),
    ],
)
def test_a_valve_that_may_be_stuck_is_never_said_to_be_no_reason_to_stop(
    mode: FaultMode, stuck: float, words: str
) -> None:
    other = FaultMode.INEFFICIENT if mode is FaultMode.STUCK else mode
    rows = (("actuator", other.value, 0.97 - stuck), ("actuator", "stuck", stuck), ("none", "healthy", 0.03))
    found = replace(finding(Side.ACTUATOR, mode, epsilon=0.4), hypotheses=tuple(Hypothesis(*row) for row in rows))
    severity, advice = severity_of(found, 10.0, LIMITS, HYDRAULIC)
    assert severity is Severity.MEDIUM
    assert advice.startswith(words)


@pytest.mark.parametrize(("p", "seconds", "expected"), [(0.93, 0.4, "info"), (0.995, 0.4, "low"), (0.93, 4.0, "low")])
def test_brief_noise_that_is_not_certain_is_a_remark(p: float, seconds: float, expected: str) -> None:
    noise = finding(Side.SENSOR, FaultMode.NOISY, p=p, epsilon=0.2)
    assert severity_of(noise, seconds, LIMITS, HYDRAULIC)[0] == expected


@pytest.mark.parametrize(("seconds", "expected"), [(0.15, "low"), (5.0, "medium")])
def test_a_brief_sensor_fault_of_unclear_kind_waits_for_the_next_service(seconds: float, expected: str) -> None:
    rows = tuple(Hypothesis("sensor", mode, 0.48) for mode in ("stuck", "inefficient"))
    stuck = replace(finding(Side.SENSOR, FaultMode.STUCK, p=0.48), hypotheses=rows, epsilon=Epsilon(1.0, 0.01, 1.0))
    assert severity_of(stuck, seconds, LIMITS, HYDRAULIC)[0] == expected


@pytest.mark.parametrize(("seconds", "expected"), [(0.14, "info"), (0.15, "medium")])
def test_a_moment_of_a_kind_that_is_not_clear_is_a_remark(seconds: float, expected: str) -> None:
    """A valve that is stuck for a moment, surely, still stops the machine."""
    rows = tuple(Hypothesis("actuator", mode, 0.48) for mode in (FaultMode.STUCK.value, FaultMode.OUTSIDE_TABLE.value))
    unclear = replace(finding(Side.ACTUATOR, FaultMode.OUTSIDE_TABLE, epsilon=-0.5), probability=0.48, hypotheses=rows)
    assert severity_of(unclear, seconds, LIMITS, HYDRAULIC)[0] == expected
    assert severity_of(finding(Side.ACTUATOR, FaultMode.STUCK), seconds, LIMITS, HYDRAULIC)[0] == "high"


@pytest.mark.parametrize(("times", "length", "often"), [(6, 600, True), (4, 900, False), (6, 100, False)])
def test_a_sensor_that_is_dead_briefly_again_and_again_is_looked_at_before_the_machine_goes_out(
    times: int, length: int, *, often: bool
) -> None:
    """Each is tolerable; with 74 drop-outs, 8 s in all, a machine might go out."""
    dead = [finding(Side.SENSOR, FaultMode.NO_SIGNAL, 1000 * k, 1000 * k + length) for k in range(1, times + 1)]
    faults = intervals_of({("FR", "sensor"): assessed(*dead)}, MACHINE, HYDRAULIC, 0, STEP)
    assert {f.severity for f in faults} == {Severity.LOW}
    doubts = [doubt for _, doubt in doubts_of(faults, HYDRAULIC)]
    assert doubts == (["the FR speed sensor gave nothing usable 6 times, 3.6 s in all"] if often else [])
    told = advised(faults, Verdict.WATCH, cleared=not often)
    assert all((f.advice == AGAIN) is often for f in told)


@pytest.mark.parametrize(
    ("status", "cleared", "told"),
    [
        (Verdict.WATCH, True, "at the next service"),
        (Verdict.WATCH, False, "before the machine goes out again"),
        (Verdict.STOP, False, "with the repair"),
    ],
)
def test_what_is_probable_waits_for_a_service_only_where_the_machine_is_cleared(
    status: Verdict, cleared: bool, told: str
) -> None:
    stuck = {("FR", "sensor"): assessed(finding(Side.SENSOR, FaultMode.STUCK, p=0.7))}
    faults = advised(intervals_of(stuck, MACHINE, HYDRAULIC, 0, STEP), status, cleared=cleared)
    assert [f.severity for f in faults] == [Severity.LOW]
    assert told in faults[0].advice
    (action,) = actions_of(faults, HYDRAULIC)
    assert action["text"].startswith("Check at the next service") == (told == "at the next service")


def test_an_action_waits_for_no_service_where_the_advice_does_not() -> None:
    rows = split(("sensor", "stuck", 0.5), ("sensor", "noisy", 0.49))
    either = replace(finding(Side.SENSOR, FaultMode.STUCK, p=0.5), hypotheses=rows)
    (fault,) = intervals_of({("FR", "sensor"): assessed(either)}, MACHINE, HYDRAULIC, 0, STEP)
    assert fault.advice.endswith("check it before the next mission.")
    (action,) = actions_of((fault,), HYDRAULIC)
    assert action["text"].startswith("Before the machine goes out, check the FR speed sensor")


@pytest.mark.parametrize(
    ("mode", "size", "severity", "p", "told"),
    [
        (FaultMode.OUTSIDE_TABLE, None, Severity.MEDIUM, 0.95, True),
        (FaultMode.OUTSIDE_TABLE, None, Severity.LOW, 0.85, True),
        (FaultMode.OUTSIDE_TABLE, None, Severity.LOW, 0.6, False),
        (FaultMode.OUTSIDE_TABLE, Epsilon(-0.3, -0.4, -0.2), Severity.MEDIUM, 0.95, False),
        (FaultMode.INEFFICIENT, None, Severity.MEDIUM, 0.95, False),
    ],
)
def test_what_no_row_bounds_is_not_cleared(
    mode: FaultMode, size: Epsilon | None, severity: Severity, p: float, *, told: bool
) -> None:
    fault = cast(FaultInterval, SimpleNamespace(mode=mode, epsilon=size, severity=severity, probability=p))
    assert bool(unbounded_words(fault)) is told


@pytest.mark.parametrize(
    ("side", "size", "words"),
    [
        (Side.SENSOR, Epsilon(-1.4, -1.5, -1.2), "reads at least 2.2 times what it should"),
        (Side.ACTUATOR, Epsilon(-1.4, -1.5, -1.0), "gives at least 2 times what it should"),
        (Side.SENSOR, Epsilon(-1.4, -1.9, -0.9), ""),
    ],
)
def test_what_gives_twice_as_much_is_no_fault_to_drive_on_with(side: Side, size: Epsilon, words: str) -> None:
    assert halved_words(side, FaultMode.OUTSIDE_TABLE, size) == words
