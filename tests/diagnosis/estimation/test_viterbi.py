"""When a fault could have been raised without knowing what follows."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.channels.sample_status import PAIR
from diagnosis.estimation import fault_models
from diagnosis.estimation.fault_models import HEALTHY, NO_SIGNAL, NOISY, ROW_OF_MODEL, STUCK, ModeModel
from diagnosis.estimation.filter_kernel import segment_evidence
from diagnosis.estimation.row_probability import row_probabilities
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.viterbi import ModePath, most_probable
from diagnosis.results.fault_rows import codes_of
from replay.faults import Side

Array = np.ndarray


def causal(healthy: str) -> ModePath:
    """A path whose causal reading is healthy (h) or faulty (f) sample by sample."""
    filtered = np.zeros((len(healthy), 5), dtype=np.float32)
    filtered[:, HEALTHY] = [0.9 if c == "h" else 0.2 for c in healthy]
    filtered[:, NOISY] = 1.0 - filtered[:, HEALTHY]
    nothing = np.zeros(len(healthy), dtype=np.uint8)
    return ModePath(nothing, nothing.astype(np.bool_), filtered)


@pytest.mark.parametrize(
    ("healthy", "start", "stop", "slack", "expected"),
    [
        ("hhhhffffffffhhhh", 4, 12, 0, 4),
        ("hhhhhhffffffhhhh", 4, 12, 0, 6),  # two samples of evidence were needed
        ("hhhhfhhfffffhhhh", 4, 12, 1, 7),  # a blip that is withdrawn is no detection
        ("hhhhfhffffffhhhh", 4, 12, 2, 4),  # unless it is withdrawn for less than the slack
        ("hhhhffffhhhhhfff", 4, 16, 1, 4),  # one that lasts is, whatever follows
        ("hhhhhhhhhhffhhhh", 4, 12, 0, 10),  # raised just before the end
        ("hhhfffffffffhhhh", 4, 12, 2, 4),  # raised a sample before the start found looking back
        ("ffffffffffffhhhh", 4, 12, 2, 4),  # raised long before
        ("hhhhhhhhffffhhhh", 4, 13, 2, 8),  # the end found looking back is a sample late
        ("hhhhhhhhhhffhhhh", 4, 13, 0, None),  # without slack that decision neither lasts nor reaches the end
        ("hhhhhhhhhhhhhhhh", 4, 12, 2, None),
    ],
)
def test_first_rise_of_the_causal_decision_that_lasts(
    healthy: str, start: int, stop: int, slack: int, expected: int | None
) -> None:
    assert causal(healthy).crossing(start, stop, slack, hold=4) == expected


def test_nothing_later_is_used() -> None:
    """What follows a sample changes the path found looking back, never the causal decision before it."""
    n = 400
    model = ModeModel(noise=0.004, constant_noise=0.0005, tolerance=0.005, span=0.8, switch_cost=13.0, dt=0.001)
    x = 0.2 + 0.1 * np.sin(np.arange(n) / 40)
    y = x + 0.004 * np.random.default_rng(1).normal(size=n)
    y[200:] = 0.0
    samples = Samples.even(y, x, np.full(n, PAIR, dtype=np.int8), np.zeros(n, dtype=np.bool_))
    whole = most_probable(samples, model)
    cut = most_probable(samples.part(0, 210), model)
    np.testing.assert_array_equal(whole.filtered[:210], cut.filtered)
    assert (whole.row[200:] == NO_SIGNAL).all()
    raised = whole.crossing(200, n, 3, 100)
    assert raised is not None
    assert 200 <= raised <= 201


def test_rows_that_the_side_lacks_are_never_entered(monkeypatch: pytest.MonkeyPatch) -> None:
    n = 400
    rng = np.random.default_rng(2)
    x = 0.2 + 0.1 * np.sin(np.arange(n) / 40)
    y = x + 0.004 * rng.normal(size=n)
    y[150:] = 0.6 * x[150:] + 0.1 * rng.normal(size=n - 150)
    samples = Samples.even(y, x, np.full(n, PAIR, dtype=np.int8), np.zeros(n, dtype=np.bool_))
    model = ModeModel(
        noise=0.004, constant_noise=0.0005, tolerance=0.005, span=0.8, switch_cost=13.0, dt=0.001, side=Side.ACTUATOR
    )
    assert (most_probable(samples, model).row[200:] == NOISY).all()
    table = [row for row in codes_of(Side.ACTUATOR) if row != NOISY]
    monkeypatch.setattr(fault_models, "codes_of", lambda side: table)
    assert NOISY not in most_probable(samples, model).row
    evidence = segment_evidence(samples, model)
    assert evidence[NOISY] == -np.inf
    assert np.isfinite(evidence[table]).all()
    assert row_probabilities(evidence, Side.ACTUATOR)[NOISY] == 0.0


def valve(jitter: float) -> ModeModel:
    """A valve with a noise of half a percent of full opening, recorded at 50 Hz."""
    return ModeModel(0.005, 0.005, 0.005, span=1.0, switch_cost=11.0, dt=0.02, side=Side.ACTUATOR, jitter=jitter)


def stands(command: Array, seed: int) -> Array:
    """Readings of a valve that stands at 0.05 of full opening."""
    return 0.05 + 0.005 * np.random.default_rng(seed).normal(size=command.size)


def stuck_share(y: Array, command: Array, jitter: float) -> float:
    """Share of the samples in which the path calls the valve stuck."""
    whole = Samples.even(y, command, np.full(y.size, PAIR, np.int8), np.zeros(y.size, np.bool_))
    return float(np.mean(ROW_OF_MODEL[most_probable(whole, valve(jitter)).model] == STUCK))


def test_a_valve_that_does_not_join_in_its_commands_jitter_is_not_stuck() -> None:
    """Beside a steady command a healthy valve stands too; a command that moves shows which of both it is."""
    command = 0.05 + 0.004 * np.random.default_rng(5).normal(size=1500)
    y = stands(command, 6)
    assert stuck_share(y, command, jitter=0.0) > 0.9
    assert stuck_share(y, command, jitter=0.015) == 0.0
    moved = command + np.where(np.arange(1500) < 750, 0.0, 0.03 * np.sin(np.arange(1500) / 50))
    assert stuck_share(y, moved, jitter=0.015) > 0.45


def test_a_stuck_valve_stays_stuck_while_its_command_passes_by() -> None:
    command = 0.05 + 0.3 * np.sin(np.arange(3000) / 100)
    command[1000:1250] = 0.05  # steady at the very value, for five seconds
    assert stuck_share(stands(command, 7), command, jitter=0.015) > 0.97
