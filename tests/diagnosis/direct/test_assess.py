"""A channel beside its second measurement: every row of both tables, and what is no fault."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from diagnosis.channels.sample_status import PAIR, SILENT, SKIP, sample_status
from diagnosis.direct.assess import assess_pair
from diagnosis.direct.inputs import Pair
from diagnosis.direct.stated_row import as_sure, of_a_constant, stated_row
from diagnosis.estimation.fault_models import HEALTHY, INEFFICIENT, NO_SIGNAL, NOISY, STUCK
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.fault_rows import ROWS
from diagnosis.results.result import Epsilon
from replay.faults import FaultMode, Side, State, fault_affected
from replay.machine.config import Limits, Noise

DT, N = 0.001, 12_000
START, STOP = 6850, 9900  # where the drive is fast, so that a fault shows at once
EDGE = 50  # samples at both ends in which a shift by the delay may leave nothing to compare
LIMITS = Limits()
Array = np.ndarray
Numbers = np.random.Generator


def drive(n: int = N, dt: float = DT) -> Array:
    """A speed (or an opening) that never rests, in both directions."""
    t = np.arange(n) * dt
    return 0.2 * np.sin(2 * np.pi * t / 6.0 + 0.4) + 0.06 * np.sin(2 * np.pi * t / 1.3)


def rounded(x: Array, lsb: float) -> Array:
    return np.round(x / lsb) * lsb


def pair(side: Side, y: Array, x: Array, dt: float = DT, **changed: Any) -> Pair:
    sensor = side is Side.SENSOR
    fields: dict[str, Any] = {
        "fresh": np.isfinite(y),
        "alive": np.ones(y.size, dtype=np.bool_),
        "quiet": np.zeros(y.size, dtype=np.bool_),
        "dt": dt,
        "unit": "m/s" if sensor else "of full opening",
        "span": 0.8 if sensor else 1.0,
        "y_name": "wheel.FR.v" if sensor else "wheel.FR.u_applied",
        "x_name": "wheel.FR.v_true" if sensor else "wheel.FR.u",
        "known_noise": Noise(),
    }
    return Pair(side=side, y=y, x=x, **(fields | changed))


def measured(true: Array, side: Side, rng: Numbers, faulty: Array | None = None) -> tuple[Array, Array]:
    """What is logged: y = Q[faulty(true + n)] and the reference; noise before the fault, the quantiser after it."""
    if side is Side.SENSOR:
        reference = rounded(true + 0.002 * rng.normal(size=true.size), 0.001)
        return rounded(true + 0.004 * rng.normal(size=true.size) if faulty is None else faulty, 0.0015), reference
    late = np.r_[[true[0]] * 2, (true if faulty is None else faulty)[:-2]]  # a spool sensor, two samples late
    return rounded(late + 0.003 * rng.normal(size=true.size), 2 / 4096), true


def judged(side: Side, fault: Callable[[Array, Numbers], Array], seed: int) -> Assessment:
    """Assess a channel that is faulty from `START` to `STOP`."""
    rng = np.random.default_rng(seed)
    true = drive()
    clean = true + (0.004 * rng.normal(size=N) if side is Side.SENSOR else 0.0)
    faulty = clean.copy()
    faulty[START:STOP] = fault(clean, rng)[START:STOP]
    y, x = measured(true, side, rng, faulty)
    return assess_pair(pair(side, y, x), LIMITS)


def single(assessment: Assessment) -> Finding:
    assert len(assessment.findings) == 1, [(f.mode, f.start, f.stop) for f in assessment.findings]
    return assessment.findings[0]


def l4(epsilon: float, mean: float, std: float = 0.0) -> Callable[[Array, Numbers], Array]:
    return lambda a, r: fault_affected(a, np.full(a.size, epsilon), mean + std * r.normal(size=a.size))


SIDES = pytest.mark.parametrize("side", [Side.SENSOR, Side.ACTUATOR])


@SIDES
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    ("mode", "epsilon", "mean", "std"),
    [
        (FaultMode.STUCK, 1.0, 0.31, 0.0),
        (FaultMode.NO_SIGNAL, 1.0, 0.0, 0.0),
        (FaultMode.INEFFICIENT, 0.45, 0.0, 0.0),
        (FaultMode.INEFFICIENT, 0.2, 0.0, 0.0),
        (FaultMode.NOISY, 0.4, 0.08, 0.15),
        (FaultMode.NOISY, 0.5, 0.0, 0.3),
        (FaultMode.NOISY, 0.3, 0.5, 0.0),
    ],
    ids=["stuck", "no signal", "ε 0.45", "ε 0.2", "noise and bias", "noise without mean", "bias and loss"],
)
def test_every_row_of_the_tables(
    side: Side, mode: FaultMode, epsilon: float, mean: float, std: float, seed: int
) -> None:
    assessment = judged(side, l4(epsilon, mean, std), seed)
    found = single(assessment)
    assert (found.side, found.mode, found.tier) == (side, mode, "direct")
    assert found.probability > 0.95
    late = 2 * (side is Side.ACTUATOR)  # of the spool sensor
    sharp = 8 if mode is FaultMode.INEFFICIENT else 5 if std else 2
    assert START - sharp <= found.start <= START + sharp + late
    assert STOP - sharp <= found.stop <= STOP + sharp + late
    assert found.detected is not None
    assert max(found.start, START - 1) <= found.detected <= START + 40  # a small loss needs that many samples to show
    assert found.epsilon is not None
    assert found.epsilon.value == pytest.approx(epsilon, abs=0.01 if std == 0 else 0.06)
    assert found.epsilon.low - 0.01 <= epsilon <= found.epsilon.high + 0.01
    if mode is not FaultMode.INEFFICIENT:
        assert found.sat is not None
        assert found.sat.mean == pytest.approx(mean, abs=0.005 if std == 0 else 0.03)
        assert found.sat.rms == pytest.approx(np.hypot(mean, std), abs=0.005 if std == 0 else 0.05)
    state = assessment.states
    assert (state[found.start : found.stop] == CODE[State(mode.value)]).all()
    others = np.r_[EDGE : found.start, found.stop : N - EDGE]
    assert (state[others] == CODE[State.HEALTHY]).all()
    assert found.hypotheses[0].mode == mode.value
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)


def test_a_clearly_more_probable_row_is_stated_unless_the_rows_are_alike() -> None:
    def row(path: int, best: int, *, zero: bool = False, still: bool = False) -> int:
        p = np.full(5, 0.04)
        p[best] = 0.84
        return stated_row(path, p, zero=zero, still=still)

    assert row(STUCK, NOISY) == row(STUCK, NOISY, zero=True, still=True) == NOISY
    assert row(STUCK, HEALTHY) == STUCK
    assert row(NO_SIGNAL, STUCK) == STUCK
    assert row(NO_SIGNAL, STUCK, zero=True) == NO_SIGNAL
    assert row(STUCK, INEFFICIENT, zero=True) == STUCK
    assert row(INEFFICIENT, NO_SIGNAL, zero=True) == NO_SIGNAL
    assert row(STUCK, INEFFICIENT, still=True) == STUCK
    assert row(INEFFICIENT, STUCK, still=True) == INEFFICIENT
    near = np.array([0.0, 0.3, 0.0, 0.2, 0.5])
    assert stated_row(STUCK, near, zero=False, still=False) == STUCK


def test_no_row_is_more_probable_than_the_one_that_is_stated() -> None:
    p = np.zeros(5)
    p[[NOISY, STUCK, INEFFICIENT, HEALTHY]] = 0.45, 0.48, 0.04, 0.03
    got = as_sure(p, NOISY, Side.ACTUATOR)
    assert got[[NOISY, STUCK]].tolist() == pytest.approx([0.465, 0.465])
    assert (got[INEFFICIENT], got[HEALTHY]) == (0.04, 0.03)


def test_a_constant_that_is_shared_is_called_by_no_less_than_its_likeliest_row() -> None:
    p = np.zeros(5)
    p[[STUCK, INEFFICIENT, NOISY, NO_SIGNAL, HEALTHY]] = 0.45, 0.05, 0.38, 0.1, 0.02
    got = of_a_constant(p)
    assert got[STUCK] == got[INEFFICIENT] == got[NOISY] == pytest.approx(0.88 / 3)
    assert (got[NO_SIGNAL], got[HEALTHY], got.sum()) == (0.1, 0.02, pytest.approx(1.0))
    p[[STUCK, NOISY]] = 0.8, 0.03
    assert of_a_constant(p)[[STUCK, INEFFICIENT, NOISY]].tolist() == pytest.approx([0.425, 0.425, 0.03])


def test_epsilon_is_a_share_unless_outside_the_table() -> None:
    wide = Epsilon(0.28, -0.11, 1.02)
    fault = Finding(0, 1, Side.SENSOR, FaultMode.NOISY, 1.0, (), wide, None, (), "direct")
    assert fault.epsilon == Epsilon(0.28, 0.0, 1.0)
    assert replace(fault, epsilon=wide, mode=FaultMode.OUTSIDE_TABLE).epsilon == wide


@SIDES
def test_a_bias_alone_is_told_as_an_offset(side: Side) -> None:
    found = single(judged(side, lambda a, _: a + 0.08, 3))
    assert found.mode is FaultMode.OUTSIDE_TABLE  # δ = 1, δ̄ ≠ 0 has no row of its own
    assert any("an offset" in line for line in found.evidence)


@SIDES
@pytest.mark.parametrize("gain", [1.4, -0.6])
def test_gain_outside_zero_to_one_is_outside_the_table(side: Side, gain: float) -> None:
    assessment = judged(side, lambda a, _: gain * a, 4)
    found = max(assessment.findings, key=lambda f: f.stop - f.start)
    assert found.stop - found.start > 0.9 * (STOP - START)
    assert all(f.start >= START - 10 and f.stop <= STOP + 20 for f in assessment.findings)
    assert found.mode is FaultMode.OUTSIDE_TABLE
    assert found.epsilon is not None
    assert 1 - found.epsilon.value == pytest.approx(gain, abs=0.01)
    assert any("outside 0…1" in line for line in found.evidence)
    assert (assessment.states == CODE[State.OUTSIDE_TABLE]).sum() == found.stop - found.start


@SIDES
def test_loss_below_the_limit_is_no_finding(side: Side) -> None:
    assessment = judged(side, l4(0.06, 0.0), 5)
    assert assessment.findings == ()
    assert any("below the limits" in note for note in assessment.notes)


@pytest.mark.parametrize("seed", [0, 4, 5])
def test_a_valve_within_its_play_of_a_resting_command_is_not_stuck(seed: int) -> None:
    """A finely resolved position lies 0.3 % of opening off what the mission's play makes of the command."""
    rng = np.random.default_rng(seed)
    t = np.arange(N) * 0.01
    x = rng.uniform(0.3, 0.9) * np.sin(2 * np.pi * t / 9) + 0.1 * np.sin(2 * np.pi * t / 2.3)
    x[8000:9500] = 1.0
    y, at = np.zeros(N), 0.0
    for i, command in enumerate(x):
        y[i] = at = float(np.clip(at, command - 0.004, command + 0.004))
    y[8000:9500] = 1.0  # its end stop
    y = rounded(y + 1e-4 * rng.normal(size=N), 1e-4)
    assert not assess_pair(pair(Side.ACTUATOR, y, rounded(x, 1e-4), 0.01), LIMITS).findings


@SIDES
@pytest.mark.parametrize("seed", range(6))
def test_healthy_channel_has_no_finding(side: Side, seed: int) -> None:
    y, x = measured(drive(), side, np.random.default_rng(seed))
    assessment = assess_pair(pair(side, y, x), LIMITS)
    assert assessment.findings == ()
    assert (assessment.states[EDGE:-EDGE] == CODE[State.HEALTHY]).all()
    assert assessment.tier == "direct"


@pytest.mark.parametrize("seed", range(3))
def test_slow_log_with_a_small_delay_has_no_finding(seed: int) -> None:
    n, dt = 3000, 0.02  # 50 Hz, y 2 ms late
    rng = np.random.default_rng(seed)
    t = np.arange(n) * dt
    fine = drive(n * 20)
    late = np.interp(t - 0.002, np.arange(n * 20) * DT, fine)
    y = rounded(late + 0.004 * rng.normal(size=n), 0.0015)
    assessment = assess_pair(pair(Side.SENSOR, y, drive(n, dt), dt), LIMITS)
    assert assessment.findings == ()


@SIDES
def test_fault_in_a_slow_log(side: Side) -> None:
    n, dt = 1500, 0.02
    x = drive(n, dt)
    y = x + 0.004 * np.random.default_rng(1).normal(size=n)
    y[600:1000] *= 0.5
    found = single(assess_pair(pair(side, y, x, dt), LIMITS))
    assert found.mode is FaultMode.INEFFICIENT
    assert (abs(found.start - 600), abs(found.stop - 1000)) <= (2, 2)
    assert found.epsilon is not None
    assert found.epsilon.value == pytest.approx(0.5, abs=0.01)


def test_two_faults_of_different_rows() -> None:
    rng = np.random.default_rng(6)
    clean = drive() + 0.004 * rng.normal(size=N)
    faulty = clean.copy()
    faulty[2000:3500] = 0.0
    faulty[7000:9000] *= 0.6
    y, x = measured(drive(), Side.SENSOR, rng, faulty)
    first, second = assess_pair(pair(Side.SENSOR, y, x), LIMITS).findings
    assert (first.mode, second.mode) == (FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT)
    assert abs(first.stop - 3500) <= 2
    assert abs(second.start - 7000) <= 2


def test_fault_over_the_whole_mission() -> None:
    rng = np.random.default_rng(7)
    y, x = measured(drive(), Side.SENSOR, rng, np.full(N, 0.21))
    found = single(assess_pair(pair(Side.SENSOR, y, x), LIMITS))
    assert (found.mode, found.start, found.stop) == (FaultMode.STUCK, 0, N)


def silent(start: int, stop: int) -> tuple[Array, Array]:
    y, x = measured(drive(), Side.SENSOR, np.random.default_rng(8))
    y[start:stop] = np.nan
    return y, x


def test_channel_silent_while_its_siblings_live_is_no_signal() -> None:
    y, x = silent(4000, 6000)
    assessment = assess_pair(pair(Side.SENSOR, y, x), LIMITS)
    found = single(assessment)
    assert (found.mode, found.start, found.stop) == (FaultMode.NO_SIGNAL, 4000, 6000)
    assert "delivered nothing for {2.000 s} while other channels" in found.evidence[0]
    assert not np.isnan(found.probability)


def test_whole_source_silent_is_no_data() -> None:
    y, x = silent(4000, 6000)
    alive = np.ones(N, dtype=np.bool_)
    alive[4000:6000] = False
    assessment = assess_pair(pair(Side.SENSOR, y, x, alive=alive), LIMITS)
    assert assessment.findings == ()
    assert_array_equal(np.flatnonzero(assessment.states == CODE[State.NO_DATA]), np.arange(4000, 6000))
    assert assessment.reasons[State.NO_DATA]


def test_nothing_recorded_at_all_is_no_data() -> None:
    nothing = np.full(N, np.nan)
    assessment = assess_pair(pair(Side.SENSOR, nothing, drive(), alive=np.zeros(N, dtype=np.bool_)), LIMITS)
    assert assessment.findings == ()
    assert (assessment.states == CODE[State.NO_DATA]).all()


def test_standing_still_is_not_excited() -> None:
    rng = np.random.default_rng(9)
    true = np.where(np.arange(N) < 6000, drive(), 0.0)
    y, x = measured(true, Side.SENSOR, rng)
    assessment = assess_pair(pair(Side.SENSOR, y, x, quiet=np.arange(N) >= 6000), LIMITS)
    assert assessment.findings == ()
    assert (assessment.states[EDGE:6000] == CODE[State.HEALTHY]).all()
    assert (assessment.states[6000:-EDGE] == CODE[State.NOT_EXCITED]).all()
    assert assessment.reasons[State.NOT_EXCITED]


def test_silent_zero_at_standstill_is_no_fault_and_a_stuck_value_is() -> None:
    still = np.ones(N, dtype=np.bool_)
    zero = assess_pair(pair(Side.SENSOR, np.zeros(N), np.zeros(N), quiet=still), LIMITS)
    assert zero.findings == ()
    assert (zero.states == CODE[State.NOT_EXCITED]).all()
    stuck = single(assess_pair(pair(Side.SENSOR, np.full(N, 0.2), np.zeros(N), quiet=still), LIMITS))
    assert stuck.mode is FaultMode.STUCK


def test_evidence_columns() -> None:
    assessment = judged(Side.SENSOR, l4(0.45, 0.0), 1)
    columns = assessment.columns
    assert {c: x.shape for c, x in columns.items()} == dict.fromkeys(columns, (N,))
    assert {"residual", "threshold", "expected"} <= set(columns)
    total = sum(columns[f"p_{row}"] for row in ROWS)
    assert np.allclose(total, 1.0)
    assert np.median(columns["p_inefficient"][START + 100 : STOP]) > 0.99
    inside, outside = columns["residual"][START:STOP], columns["residual"][:START]
    assert (np.abs(outside) > columns["threshold"][:START]).mean() < 0.01
    assert (np.abs(inside) > columns["threshold"][START:STOP]).mean() > 0.5


def test_every_sample_has_a_status() -> None:
    y, x = drive(2000), drive(2000)
    fresh = np.ones(2000, dtype=np.bool_)
    alive = np.ones(2000, dtype=np.bool_)
    y[500:600], alive[550:600] = np.nan, False
    x[700:710] = np.nan
    fresh[800:810] = False
    status = sample_status(y, x, fresh & np.isfinite(y), alive, DT)
    assert_array_equal(np.flatnonzero(status == SILENT), np.arange(500, 550))
    assert_array_equal(np.flatnonzero(status == SKIP), np.r_[550:600, 700:710, 800:810])
    assert (status == PAIR).sum() == 2000 - 120


def test_late_start_and_early_stop_of_a_channel_are_no_silence() -> None:
    y, x = drive(2000), drive(2000)
    y[:40], y[-30:] = np.nan, np.nan
    status = sample_status(y, x, np.isfinite(y), np.ones(2000, dtype=np.bool_), DT)
    assert (status == SILENT).sum() == 0


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("level", [0.31, 0.0], ids=["stuck", "silent"])
def test_spell_of_20_ms_is_found(level: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    clean = drive() + 0.004 * rng.normal(size=N)
    clean[START : START + 20] = level
    y, x = measured(drive(), Side.SENSOR, rng, clean)
    found = single(assess_pair(pair(Side.SENSOR, y, x), LIMITS))
    assert found.mode is (FaultMode.STUCK if level else FaultMode.NO_SIGNAL)
    assert abs(found.start - START) <= 1
    assert abs(found.stop - START - 20) <= 1


@pytest.mark.parametrize(("samples", "low", "high"), [(200, 0.5, 0.6), (2500, 0.9, 1.0)])
def test_a_valve_that_stands_for_a_moment_is_less_surely_at_fault(samples: int, low: float, high: float) -> None:
    opening = drive()
    opening[START : START + samples] = 0.0
    y, x = measured(drive(), Side.ACTUATOR, np.random.default_rng(1), opening)
    found = single(assess_pair(pair(Side.ACTUATOR, y, x), LIMITS))
    assert found.mode is FaultMode.NO_SIGNAL
    assert low < found.probability < high


@pytest.mark.parametrize("seed", [1, 2])
def test_fault_that_grows_is_one_fault(seed: int) -> None:
    rng = np.random.default_rng(seed)
    clean = drive() + 0.004 * rng.normal(size=N)
    share = np.clip((np.arange(N) - 3000) / 1500, 0, 1) * 0.6
    faulty = np.where(np.arange(N) < 9000, (1 - share) * clean, clean)
    y, x = measured(drive(), Side.SENSOR, rng, faulty)
    found = single(assess_pair(pair(Side.SENSOR, y, x), LIMITS))
    assert found.mode is FaultMode.INEFFICIENT
    assert 3000 <= found.start <= 4000
    assert abs(found.stop - 9000) <= 3
    assert found.epsilon is not None
    assert found.epsilon.value == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize(("level", "mode"), [(0.015, FaultMode.STUCK), (0.001, FaultMode.NO_SIGNAL)])
def test_a_value_beyond_the_zero_of_a_sensor_is_one_that_it_is_stuck_at(level: float, mode: FaultMode) -> None:
    """However fast the machine is, so that the smallest saturation term that counts is larger."""
    assessment = judged(Side.SENSOR, l4(1.0, level), 1)
    assert single(assessment).mode is mode


def test_silent_channel_is_one_fault_through_a_standstill() -> None:
    rng = np.random.default_rng(2)
    rest = (np.arange(N) > 5000) & (np.arange(N) < 7000)
    true = np.where(rest, 0.0, drive())
    y, x = measured(true, Side.SENSOR, rng)
    y[3000:9500] = 0.0
    found = single(assess_pair(pair(Side.SENSOR, y, x, quiet=rest), LIMITS))
    assert found.mode is FaultMode.NO_SIGNAL
    assert (abs(found.start - 3000), abs(found.stop - 9500)) <= (3, 3)


def test_causal_probability_of_a_fault() -> None:
    probability = judged(Side.SENSOR, l4(0.45, 0.0), 1).columns["probability"]
    assert probability.shape == (N,)
    assert np.median(probability[: START - 10]) < 0.01
    assert np.median(probability[START + 50 : STOP]) > 0.99


def test_a_loss_beside_a_resting_command_is_what_it_is_where_the_command_moves() -> None:
    """A valve does not stick at just the share of its command that it lost before."""
    rng = np.random.default_rng(9)
    x = drive()
    x[9000:] = x[9000]
    y = x + 0.002 * rng.normal(size=N)
    y[4000:] = 0.5 * x[4000:] + 0.002 * rng.normal(size=N - 4000)
    found = assess_pair(pair(Side.ACTUATOR, y, x), LIMITS).findings
    assert {f.mode for f in found} == {FaultMode.INEFFICIENT}
    assert all(f.probability > 0.9 for f in found)
    assert all(f.epsilon is not None and abs(f.epsilon.value - 0.5) < 0.05 for f in found)


def test_a_gain_within_the_limits_is_not_joined_to_a_loss_that_follows_it() -> None:
    rng = np.random.default_rng(10)
    true = drive()
    y = 1.01 * true + 0.001 * rng.normal(size=N)
    y[7000:] = 0.5 * true[7000:] + 0.001 * rng.normal(size=N - 7000)
    y[7000:7030] += 0.1 * rng.normal(size=30)
    found = single(assess_pair(pair(Side.SENSOR, y, true + 0.001 * rng.normal(size=N)), LIMITS))
    assert found.mode is FaultMode.INEFFICIENT
    assert abs(found.start - 7000) < 100


def test_a_sensor_at_the_end_of_its_range_is_hardly_stuck() -> None:
    """It stays at its largest reading wherever its reference is beyond that, and shows everything below."""
    rng = np.random.default_rng(8)
    y, x = measured(drive(), Side.SENSOR, rng)
    clipped = assess_pair(pair(Side.SENSOR, np.clip(y, -0.18, 0.18), x), LIMITS).findings
    assert clipped
    assert {f.mode for f in clipped} == {FaultMode.OUTSIDE_TABLE}
    stuck = judged(Side.SENSOR, lambda true, _: np.full(N, true[START]), 3).findings
    assert [f.mode for f in stuck] == [FaultMode.STUCK]


def test_a_sensor_that_is_stuck_all_the_time_is_at_no_end_of_its_range() -> None:
    """Driven one way, its reference is beyond its only reading nearly always."""
    _, x = measured(0.3 + drive(), Side.SENSOR, np.random.default_rng(8))
    found = assess_pair(pair(Side.SENSOR, np.full(N, 0.1), np.maximum(x, 0.02)), LIMITS).findings
    assert found
    assert {f.mode for f in found} == {FaultMode.STUCK}
