"""L4 and L8 written into recorded signals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.pipeline import diagnose_signals
from replay.control.loop import replay_loop
from replay.errors import ConfigError
from replay.faults import FaultMode, FaultSpec, Side
from replay.injection.inject import InjectionOptions, inject_signals
from replay.injection.mission import draw_faults, inject_mission
from replay.log.source_options import SignalSource
from replay.machine.config import Machine, Noise, Plant, WheelPlant, haulotte
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import align

SENSOR, ACTUATOR = Side.SENSOR, Side.ACTUATOR
STUCK, NO_SIGNAL, INEFFICIENT, NOISY = FaultMode.STUCK, FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT, FaultMode.NOISY
LSB = 0.002
RATE = 100
STAMPS = 1_700_000_000_000_000_000 + np.arange(60 * RATE, dtype=np.int64) * (1_000_000_000 // RATE)
T = np.arange(STAMPS.size) / RATE
SPEED = 0.25 + 0.05 * np.sin(2 * np.pi * T / 7)


def signal(name: str, values: NDArray[np.float64]) -> Signal:
    return Signal(name, STAMPS, np.asarray(values, np.float64), SignalSource(column=name), "drive.csv", False)


def recorded(*, spool: bool = True) -> Signals:
    """60 s of driving at 100 Hz: commanded speed, measured speed with noise on a grid of 2 mm/s, valves."""
    rng = np.random.default_rng(5)
    items = {"cmd.v": signal("cmd.v", SPEED)}
    for wheel in haulotte().wheels:
        noisy = SPEED + 0.004 * rng.standard_normal(T.size)
        items[f"wheel.{wheel}.v_ref"] = signal(f"wheel.{wheel}.v_ref", SPEED)
        items[f"wheel.{wheel}.v"] = signal(f"wheel.{wheel}.v", np.round(noisy / LSB) * LSB)
        items[f"wheel.{wheel}.u"] = signal(f"wheel.{wheel}.u", SPEED / 2.4)
        if spool:
            position = SPEED / 2.4 + 0.003 * rng.standard_normal(T.size)
            items[f"wheel.{wheel}.u_applied"] = signal(f"wheel.{wheel}.u_applied", position)
    return Signals(items, {})


def within(fault: FaultSpec) -> NDArray[np.bool_]:
    return (fault.start_s - 1e-9 <= T) & (fault.stop_s - 1e-9 > T)


def values_of(fault: FaultSpec, name: str, options: InjectionOptions | None = None) -> NDArray[np.float64]:
    return inject_signals(recorded(), [fault], haulotte(), 1, options)[0].items[name].values


def test_a_stuck_sensor_holds_its_last_value_without_noise() -> None:
    fault = FaultSpec("FR", SENSOR, STUCK, 20.0, 30.0, sat=float("nan"))
    clean = recorded()
    faulty, truth = inject_signals(clean, [fault], haulotte())
    before, after = clean.items["wheel.FR.v"].values, faulty.items["wheel.FR.v"].values
    last = before[20 * RATE - 1]
    assert np.ptp(after[within(fault)]) == 0.0
    assert after[20 * RATE] == pytest.approx(last)
    assert np.array_equal(after[~within(fault)], before[~within(fault)])
    assert truth[0].sat_mean == pytest.approx(last)
    assert (truth[0].component, truth[0].kind, truth[0].epsilon) == ("FR", "wheel", 1.0)


def test_an_inefficient_sensor_scales_and_keeps_to_the_channels_grid() -> None:
    fault = FaultSpec("RL", SENSOR, INEFFICIENT, 20.0, 30.0, 0.4)
    before = recorded().items["wheel.RL.v"].values[within(fault)]
    after = values_of(fault, "wheel.RL.v")[within(fault)]
    assert np.max(np.abs(after - 0.6 * before)) <= LSB / 2 + 1e-9
    assert np.allclose(after / LSB, np.round(after / LSB), atol=1e-6)


def test_the_grid_may_be_given() -> None:
    machine = replace(haulotte(), noise={"wheel.RL.v": Noise(lsb=0.05)})
    fault = FaultSpec("RL", SENSOR, INEFFICIENT, 20.0, 30.0, 0.4)
    after = inject_signals(recorded(), [fault], machine)[0].items["wheel.RL.v"].values[within(fault)]
    assert len(np.unique(np.round(after, 6))) <= 4


def test_epsilon_grows_over_a_ramp() -> None:
    fault = FaultSpec("RL", SENSOR, INEFFICIENT, 20.0, 40.0, 0.5, ramp_s=10.0)
    faulty, truth = inject_signals(recorded(), [fault], haulotte())
    ratio = faulty.items["wheel.RL.v"].values / recorded().items["wheel.RL.v"].values
    for second, left in ((20.0, 1.0), (22.5, 0.875), (25.0, 0.75), (30.0, 0.5), (39.0, 0.5)):
        assert ratio[round(second * RATE)] == pytest.approx(left, abs=0.02)
    assert truth[0].ramp_s == 10.0


@pytest.mark.parametrize("tau", [0.0, 0.2])
def test_a_noisy_sensor_has_the_asked_mean_spread_and_correlation(tau: float) -> None:
    fault = FaultSpec("FL", SENSOR, NOISY, 5.0, 55.0, 0.5, 0.1, 0.12, tau)
    before = recorded().items["wheel.FL.v"].values[within(fault)]
    sat = (values_of(fault, "wheel.FL.v")[within(fault)] - 0.5 * before) / 0.5
    assert sat.mean() == pytest.approx(0.1, abs=0.03)
    assert sat.std() == pytest.approx(0.12, rel=0.15)
    one_step = np.corrcoef(sat[1:], sat[:-1])[0, 1]
    assert one_step == pytest.approx(np.exp(-0.01 / tau) if tau else 0.0, abs=0.06)


def test_what_a_silent_sensor_logs() -> None:
    fault = FaultSpec("RR", SENSOR, NO_SIGNAL, 20.0, 30.0)
    assert np.all(values_of(fault, "wheel.RR.v")[within(fault)] == 0.0)
    nan = values_of(fault, "wheel.RR.v", InjectionOptions(silent="nan"))
    assert np.array_equal(np.isnan(nan), within(fault))
    dropped = inject_signals(recorded(), [fault], haulotte(), 1, InjectionOptions(silent="drop"))[0]
    assert np.array_equal(dropped.items["wheel.RR.v"].stamps, STAMPS[~within(fault)])


def test_a_valves_fault_changes_its_position_whose_sensor_keeps_its_noise() -> None:
    fault = FaultSpec("FR", ACTUATOR, STUCK, 20.0, 40.0, sat=0.05)
    faulty, truth = inject_signals(recorded(), [fault], haulotte())
    position = faulty.items["wheel.FR.u_applied"].values[within(fault)]
    assert position.mean() == pytest.approx(0.05, abs=0.001)
    assert position.std() == pytest.approx(0.003, rel=0.3)
    assert np.array_equal(faulty.items["wheel.FR.v"].values, recorded().items["wheel.FR.v"].values)
    assert truth[0].sat_mean == 0.05


def machine_with_plant(dead: float = 0.0) -> Machine:
    return replace(haulotte(), plant=Plant(wheels={"FR": WheelPlant(K=2.0, tau=0.5, dead=dead)}))


def test_the_speed_answers_a_valves_fault_by_the_wheel_model() -> None:
    fault = FaultSpec("FR", ACTUATOR, NO_SIGNAL, 20.0, 40.0)
    clean = recorded(spool=False)
    clean = replace(clean, items={**clean.items, "wheel.FR.u": signal("wheel.FR.u", np.full(T.size, 0.1))})
    faulty, _ = inject_signals(clean, [fault], machine_with_plant(), 1, InjectionOptions(plant=True))
    change = faulty.items["wheel.FR.v"].values - clean.items["wheel.FR.v"].values
    assert np.all(change[: 20 * RATE] == 0.0)
    assert change[round(20.5 * RATE)] == pytest.approx(-0.2 * (1 - np.exp(-1)), abs=2 * LSB)
    assert change[40 * RATE - 1] == pytest.approx(-0.2, abs=LSB)
    assert change[round(40.5 * RATE)] == pytest.approx(-0.2 * np.exp(-1), abs=2 * LSB)


def test_an_opening_within_the_dead_zone_changes_nothing() -> None:
    fault = FaultSpec("FR", ACTUATOR, NO_SIGNAL, 20.0, 40.0)
    clean = recorded(spool=False)
    faulty, _ = inject_signals(clean, [fault], machine_with_plant(dead=0.9), 1, InjectionOptions(plant=True))
    assert np.array_equal(faulty.items["wheel.FR.v"].values, clean.items["wheel.FR.v"].values)


def test_the_original_is_gone_unless_it_is_kept_as_a_second_sensor() -> None:
    fault = FaultSpec("FR", SENSOR, STUCK, 20.0, 30.0, sat=0.1)
    assert "wheel.FR.v_true" not in inject_signals(recorded(), [fault], haulotte())[0].items
    options = InjectionOptions(keep_true=True, second_speed_std=0.01)
    faulty, _ = inject_signals(recorded(), [fault], haulotte(), 1, options)
    for wheel in haulotte().wheels:
        second = faulty.items[f"wheel.{wheel}.v_true"].values - recorded().items[f"wheel.{wheel}.v"].values
        assert second.std() == pytest.approx(0.01, rel=0.1)


def test_the_same_seed_gives_the_same_signals_and_leaves_the_recording_alone() -> None:
    clean, untouched = recorded(), recorded()
    fault = FaultSpec("FL", SENSOR, NOISY, 5.0, 55.0, 0.5, 0.1, 0.12, 0.1)
    results = [inject_signals(clean, [fault], haulotte(), seed)[0].items["wheel.FL.v"].values for seed in (1, 1, 2)]
    assert np.array_equal(results[0], results[1])
    assert not np.array_equal(results[0], results[2])
    for name, item in untouched.items.items():
        assert np.array_equal(clean.items[name].values, item.values)


FR_STUCK = FaultSpec("FR", SENSOR, STUCK, 20.0, 30.0, sat=0.1)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (replace(FR_STUCK, component="XX"), "no such part; expected one of FR, FL, RR, RL, front, rear"),
        (replace(FR_STUCK, component="front"), "steer.front.phi is not in the log"),
        (replace(FR_STUCK, side=ACTUATOR), "the valve's position wheel.FR.u_applied is not logged.* with --plant"),
        (replace(FR_STUCK, start_s=61.0, stop_s=70.0), "starts at 61 s, the log lasts 59.990 s"),
        (replace(FR_STUCK, stop_s=10.0), "is not an interval"),
        (replace(FR_STUCK, epsilon=1.5), "epsilon = 1.5"),
        (replace(FR_STUCK, ramp_s=11.0), "ramp_s = 11"),
        (replace(FR_STUCK, mode=FaultMode.OUTSIDE_TABLE), "must be a row of the tables"),
        (replace(FR_STUCK, side=Side.SENSOR_OR_ACTUATOR), "side must be sensor or actuator"),
    ],
)
def test_what_cannot_be_injected_is_refused(fault: FaultSpec, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        inject_signals(recorded(spool=False), [fault], haulotte())


def test_overlapping_faults_and_unknown_wheel_models_are_refused() -> None:
    with pytest.raises(ConfigError, match="two sensor faults of FR overlap at 25 s"):
        inject_signals(recorded(), [FR_STUCK, replace(FR_STUCK, start_s=25.0, stop_s=40.0)], haulotte())
    with pytest.raises(ConfigError, match=r"--plant needs K and tau of wheel FR.*plant"):
        inject_signals(recorded(), [replace(FR_STUCK, side=ACTUATOR)], haulotte(), 1, InjectionOptions(plant=True))
    with pytest.raises(ConfigError, match="no wheel signal with at least two samples"):
        inject_signals(Signals({}, {}), [FR_STUCK], haulotte())


def test_stuck_at_zero_is_told() -> None:
    faulty, _ = inject_signals(recorded(), [replace(FR_STUCK, sat=0.001)], haulotte())
    assert "counts as no signal" in faulty.notes[-1]


def test_the_truth_of_a_mission() -> None:
    faulty, truth = inject_mission(recorded(), [FR_STUCK], haulotte())
    assert (truth.open_loop, truth.rate_hz, truth.duration_s, truth.start_ns) == (True, 100.0, 60.0, STAMPS[0])
    assert [(s.component, s.start_s, s.stop_s) for s in truth.masked] == [("FR", 20.0, 30.0)]
    assert [(s.component, s.start_s, s.stop_s) for s in truth.driving] == [(w, 0.0, 60.0) for w in haulotte().wheels]
    with pytest.raises(ConfigError, match="already injected"):
        inject_mission(faulty, [FR_STUCK], haulotte())


def test_faults_are_drawn_by_the_rows_and_in_the_machines_range() -> None:
    clean = recorded()
    faults = draw_faults(clean, haulotte(), 8, 3, epsilon=0.3)
    assert faults == draw_faults(clean, haulotte(), 8, 3, epsilon=0.3)
    assert {(f.side, f.mode) for f in faults} == {
        (s, m) for s in (SENSOR, ACTUATOR) for m in (STUCK, NO_SIGNAL, INEFFICIENT, NOISY)
    }
    assert {f.epsilon for f in faults if f.mode in (INEFFICIENT, NOISY)} == {0.3}
    fast = replace(haulotte(), max_speed=3.6)
    quick = {n: replace(s, values=10 * s.values) for n, s in clean.items.items() if not n.endswith("u_applied")}
    drawn = draw_faults(Signals(quick, {}), fast, 4, 3)
    assert {f.side for f in drawn} == {SENSOR}
    assert max(f.sat_std for f in drawn) > 0.5
    with pytest.raises(ConfigError, match="ask for fewer"):
        draw_faults(clean, haulotte(), 200, 3)


def test_nothing_is_said_about_the_controller_of_an_injected_recording() -> None:
    faulty, _ = inject_signals(recorded(), [FR_STUCK], haulotte())
    clean_loop, loop = (replay_loop(align(s), haulotte()) for s in (recorded(), faulty))
    assert clean_loop.fits
    assert loop.fits == ()
    assert np.isnan(loop.u_difference).all()
    assert np.isnan(loop.psi_implied).all()
    report = diagnose_signals(faulty, haulotte()).report
    assert report["log"]["open_loop"] is True
    assert report["verdict"]["caveats"][-1].startswith("Faults were injected into this recording")
    assert report["metrics"]["average"]["tracking_error"]["mission"] is None
    assert "Injected faults" in [row["check"] for row in report["quality"]]
    assert diagnose_signals(recorded(), haulotte()).report["log"]["open_loop"] is False
