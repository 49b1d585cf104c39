from __future__ import annotations

import numpy as np

from diagnosis.results.stated_sizes import known_modes, known_probability, mode_columns, size_columns
from replay.machine.quantities import OPENING
from tests import report_samples as samples

T = np.arange(1000) / 10.0
FR = frozenset({("FR", "sensor")})


def columns_of(*faults: object, states: object = ()) -> dict[str, list[float]]:
    report = samples.report_with() | {"intervals": list(faults), "states": list(states)}
    found = size_columns(report, T, 0.1, FR)  # type: ignore[arg-type]
    return {name.removeprefix("evidence.FR.sensor."): x.tolist() for name, x in found.items()}


def state(name: str, start: float, stop: float) -> dict[str, object]:
    return {"component": "FR", "side": "sensor", "state": name, "start_s": start, "stop_s": stop, "reason": ""}


def test_a_fault_shows_its_size_and_bounds_over_its_whole_length_and_nowhere_else() -> None:
    size = {"value": 0.4, "low": 0.3, "high": 0.5}
    found = columns_of(samples.fault(mode="inefficient", start_s=20.0, stop_s=30.0, epsilon=size))
    for leaf, value in (("epsilon", 0.4), ("epsilon_low", 0.3), ("epsilon_high", 0.5)):
        column = np.array(found[leaf])
        np.testing.assert_allclose(column[200:300], value)
        assert np.isnan(column[:200]).all()
        assert np.isnan(column[300:]).all()


def test_health_is_no_loss_and_what_was_not_decided_is_unknown() -> None:
    states = [state("healthy", 0.0, 10.0), state("not_excited", 10.0, 20.0), state("healthy", 20.0, 100.0)]
    found = np.array(columns_of(samples.fault(start_s=30.0, stop_s=40.0, epsilon=None), states=states)["epsilon"])
    np.testing.assert_array_equal(found[:100], 0.0)
    assert np.isnan(found[100:200]).all()
    np.testing.assert_array_equal(found[200:300], 0.0)
    assert np.isnan(found[300:400]).all()
    assert "epsilon_low" not in columns_of(states=states)


def test_of_two_faults_at_once_the_more_probable_one_is_shown() -> None:
    small, large = ({"value": v, "low": v, "high": v} for v in (0.2, 0.8))
    faults = [
        samples.fault(start_s=10.0, stop_s=20.0, epsilon=e, probability=p) for e, p in ((large, 0.9), (small, 0.6))
    ]
    np.testing.assert_allclose(columns_of(*faults)["epsilon"][100:200], 0.8)


def test_a_saturation_term_of_the_other_side_is_not_shown() -> None:
    term = {"mean": 0.5, "rms": 0.5, "low": 0.4, "high": 0.6, "unit": OPENING}
    either = samples.fault(side="sensor_or_actuator", start_s=10.0, stop_s=20.0, sat=term)
    assert "sat" not in columns_of(either)
    np.testing.assert_allclose(columns_of({**either, "sat": {**term, "unit": "m/s"}})["sat"][100:200], 0.5)


def test_no_probability_is_shown_of_what_was_not_decided() -> None:
    states = [state("healthy", 0.0, 10.0), state("not_excited", 10.0, 50.0), state("masked", 50.0, 100.0)]
    report = samples.report_with() | {"intervals": [samples.fault(start_s=40.0, stop_s=60.0)], "states": states}
    name = "evidence.FR.sensor.probability"
    shown = known_probability(report, T, 0.1, {name: np.full(1000, 0.9, np.float32), "other": T})  # type: ignore[arg-type]
    assert list(shown) == [name]
    assert shown[name].dtype == np.float32
    assert np.isfinite(shown[name]).nonzero()[0].tolist() == [*range(100), *range(400, 600)]


def test_between_the_stretches_of_one_fault_no_probability_is_shown() -> None:
    fault = samples.fault(mode="stuck", start_s=20.0, stop_s=50.0)
    states = [state("stuck", 20.0, 30.0), state("not_assessed", 30.0, 45.0), state("stuck", 45.0, 50.0)]
    report = samples.report_with() | {"intervals": [fault], "states": states}
    name = "evidence.FR.sensor.probability"
    seen = np.where((T < 30.0) | (T >= 45.0), 0.8, 0.1).astype(np.float32)
    shown = known_probability(report, T, 0.1, {name: seen})[name]  # type: ignore[arg-type]
    assert np.isfinite(shown).nonzero()[0].tolist() == [*range(200, 300), *range(450, 500)]
    np.testing.assert_allclose(shown[np.isfinite(shown)], 0.8)


def test_a_fault_that_rests_on_other_evidence_has_its_own_probability() -> None:
    hypotheses = [{"side": "sensor", "mode": "stuck", "p": 0.6}, {"side": "none", "mode": "healthy", "p": 0.4}]
    fault = samples.fault(mode="stuck", start_s=20.0, stop_s=30.0, probability=0.6, hypotheses=hypotheses)
    report = samples.report_with() | {"intervals": [fault], "states": [state("stuck", 20.0, 30.0)]}
    name = "evidence.FR.sensor.probability"
    for shown, told in ((0.0, 0.6), (0.8, 0.8)):
        found = known_probability(report, T, 0.1, {name: np.full(1000, shown, np.float32)})  # type: ignore[arg-type]
        np.testing.assert_allclose(found[name][200:300], told)


def test_so_has_one_that_the_columns_show_at_its_beginning_alone() -> None:
    hypotheses = [{"side": "sensor", "mode": "noisy", "p": 0.95}, {"side": "none", "mode": "healthy", "p": 0.05}]
    fault = samples.fault(mode="noisy", start_s=20.0, stop_s=30.0, probability=0.95, hypotheses=hypotheses)
    report = samples.report_with() | {"intervals": [fault], "states": [state("noisy", 20.0, 30.0)]}
    name = "evidence.FR.sensor.probability"
    seen = np.where(T < 23.0, 0.9, 0.02).astype(np.float32)
    found = known_probability(report, T, 0.1, {name: seen})  # type: ignore[arg-type]
    np.testing.assert_allclose(found[name][200:300], 0.95)


def test_so_has_one_that_they_show_only_while_another_fault_lasts() -> None:
    hypotheses = [{"side": "sensor", "mode": "noisy", "p": 0.95}, {"side": "none", "mode": "healthy", "p": 0.05}]
    fault = samples.fault(mode="noisy", start_s=20.0, stop_s=30.0, probability=0.95, hypotheses=hypotheses)
    other = samples.fault(mode="inefficient", start_s=22.0, stop_s=29.0)
    report = samples.report_with() | {"intervals": [fault, other], "states": [state("noisy", 20.0, 30.0)]}
    name = "evidence.FR.sensor.probability"
    seen = np.where((T >= 22.0) & (T < 29.0), 0.9, 0.3).astype(np.float32)
    found = known_probability(report, T, 0.1, {name: seen})  # type: ignore[arg-type]
    np.testing.assert_allclose(found[name][200:300], 0.95)


def test_rows_of_a_fault_that_rests_on_other_evidence_are_those_of_its_hypotheses() -> None:
    hypotheses = [{"side": "sensor", "mode": "noisy", "p": 0.95}, {"side": "none", "mode": "healthy", "p": 0.05}]
    fault = samples.fault(mode="noisy", start_s=20.0, stop_s=30.0, probability=0.95, hypotheses=hypotheses)
    report = samples.report_with() | {"intervals": [fault], "states": [state("noisy", 20.0, 30.0)]}
    base = "evidence.FR.sensor.p_"
    for p, told in ((1.0, {"healthy": 0.05, "noisy": 0.95, "stuck": 0.0}), (0.2, {})):  # which shows the fault itself
        seen = {base + m: np.full(1000, x, np.float32) for m, x in (("healthy", p), ("stuck", 1.0 - p))}
        found = known_modes(report, T, 0.1, seen)  # type: ignore[arg-type]
        assert set(found) == {base + m for m in told}
        for mode, x in told.items():
            np.testing.assert_allclose(found[base + mode][200:300], x, atol=1e-6)
            np.testing.assert_array_equal(found[base + mode][:200], seen.get(base + mode, np.full(1000, np.nan))[:200])


def test_rows_that_were_weighed_over_a_whole_fault_have_its_probabilities_during_it_alone() -> None:
    hypotheses = [
        {"side": "sensor", "mode": "stuck", "p": 0.7},
        {"side": "sensor", "mode": "noisy", "p": 0.1},
        {"side": "actuator", "mode": "stuck", "p": 0.15},
        {"side": "sensor", "mode": "healthy", "p": 0.05},
    ]
    fault = samples.fault(mode="stuck", start_s=20.0, stop_s=30.0, probability=0.7, hypotheses=hypotheses)
    report = samples.report_with() | {"intervals": [fault], "states": [state("healthy", 0.0, 20.0)]}
    found = mode_columns(report, T, 0.1, FR)  # type: ignore[arg-type]
    assert set(found) == {f"evidence.FR.sensor.p_{m}" for m in ("healthy", "stuck", "noisy")}
    for mode, p in (("healthy", 0.2), ("stuck", 0.7), ("noisy", 0.1)):
        column = found[f"evidence.FR.sensor.p_{mode}"]
        np.testing.assert_allclose(column[200:300], p, atol=1e-6)
        assert np.isnan(column[:200]).all()
        assert np.isnan(column[300:]).all()
