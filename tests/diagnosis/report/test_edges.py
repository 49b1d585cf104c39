from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from diagnosis.report.compared_channels import Pair, pair_of
from diagnosis.report.edges import Edge, edge_of, edge_words, time_words
from diagnosis.results.machine_words import HYDRAULIC

STEP = 0.005
FAULT = {"component": "FR", "kind": "wheel", "side": "sensor", "tier": "direct", "start_s": 5.0, "stop_s": 6.0}


def log(*, second: bool) -> dict[str, np.ndarray[Any, Any]]:
    """A speed with noise of 0.01 m/s that lacks 0.5 m/s from 5 s to 6 s."""
    rng = np.random.default_rng(3)
    t = np.arange(2000) * STEP
    v = 1.0 + 0.01 * rng.standard_normal(t.size)
    v[1000:1200] -= 0.5
    return {"wheel.FR.v": v, **({"wheel.FR.v_true": np.ones(t.size)} if second else {})}


def edge(name: str, columns: dict[str, Any], *others: dict[str, Any], **changes: Any) -> tuple[Edge | None, Pair]:
    fault = {**FAULT, **changes}
    pair = pair_of(fault, columns, HYDRAULIC)
    assert pair is not None
    return edge_of(name, fault, [fault, *others], pair, columns, (0.0, STEP)), pair


@pytest.mark.parametrize("second", [True, False])
@pytest.mark.parametrize(("name", "words"), [("onset", "First faulty sample"), ("end", "Last faulty sample")])
def test_a_jump_is_measured_against_the_noise(second: bool, name: str, words: str) -> None:
    found, pair = edge(name, log(second=second))
    assert found is not None
    assert found.shift is not None
    assert found.shift[0] - found.shift[1] == pytest.approx(0.5, abs=0.04)
    assert found.noise == pytest.approx(0.01, rel=0.4)
    assert edge_words(found, pair).startswith(words)
    assert "m/s (" in edge_words(found, pair)


def test_window_holds_thirty_samples_or_fifty_milliseconds_on_each_side() -> None:
    columns = log(second=True)
    found, _ = edge("onset", columns)
    assert found is not None
    np.testing.assert_allclose(found.t[[0, 30, -1]], [-0.15, 0.0, 0.15], atol=1e-12)
    np.testing.assert_array_equal(found.y, columns["wheel.FR.v"][970:1031])
    pair = pair_of(FAULT, columns, HYDRAULIC)
    assert pair is not None
    fast = edge_of("onset", {**FAULT, "start_s": 1.0, "stop_s": 1.2}, [], pair, columns, (0.0, 0.001))
    assert fast is not None
    assert fast.reach == pytest.approx(0.05)


def test_a_bend_starts_within_the_noise() -> None:
    columns = log(second=True)
    columns["wheel.FR.v"][1000:1200] += 0.5 * np.exp(-np.arange(200) / 100)
    found, pair = edge("onset", columns)
    assert found is not None
    assert edge_words(found, pair).startswith("First faulty sample deviates by 0.0")
    assert ", and by up to 0.15" in edge_words(found, pair)


def test_an_onset_that_does_not_show_is_said() -> None:
    columns = log(second=True)
    columns["wheel.FR.v"][1000:1200] += 0.5
    found, pair = edge("onset", columns)
    assert found is not None
    assert edge_words(found, pair).startswith("No sample of the 150 ms after stands out of the noise: at most 0.0")


def test_a_brief_fault_is_measured_inside_it_alone() -> None:
    columns = log(second=True)
    columns["wheel.FR.v"][1005:1200] += 3.0
    found, _ = edge("onset", columns, stop_s=5.025)
    assert found is not None
    assert found.most == pytest.approx(0.5, abs=0.04)


def test_lost_samples_stay_lost() -> None:
    columns = log(second=True)
    columns["wheel.FR.v"][1000:1003] = np.nan
    found, _ = edge("onset", columns)
    assert found is not None
    assert np.isnan(found.y[30:33]).all()
    assert found.shift is not None


def test_samples_of_another_fault_do_not_count_as_healthy() -> None:
    before = {**FAULT, "start_s": 4.0, "stop_s": 5.0}
    found, pair = edge("onset", log(second=True), before)
    assert found is not None
    assert (found.shift, found.noise) == (None, None)
    assert edge_words(found, pair) == "Too few healthy samples before it to estimate the noise."
    other_wheel, _ = edge("onset", log(second=True), {**before, "component": "RL"})
    assert other_wheel is not None
    assert other_wheel.noise is not None


def test_a_fault_to_the_end_of_the_log_has_no_end() -> None:
    assert edge("end", log(second=True), stop_s=10.0)[0] is None
    assert edge("onset", log(second=True), start_s=0.0)[0] is None


def test_a_constant_before_has_no_noise() -> None:
    columns = {"wheel.FR.v": np.r_[np.ones(1000), np.zeros(1000)]}
    found, pair = edge("onset", columns)
    assert found is not None
    assert found.noise is None
    assert edge_words(found, pair) == "First faulty sample deviates by 1 m/s from the course before it."


def test_times() -> None:
    assert [time_words(s) for s in (0.005, -0.02, 1.25)] == ["5 ms", "−20 ms", "1.25 s"]


def test_a_channel_that_is_off_before_its_onset_is_said_to_be() -> None:
    columns = log(second=True)
    columns["wheel.FR.v"][880:1000] -= 0.2
    found, pair = edge("onset", columns)
    assert found is not None
    said = edge_words(found, pair)
    assert re.match(
        r"First faulty sample is 0\.(49|5)\d* m/s off the .*, a change of 0\.\d+ \(\d+ σ\) against the samples before it",
        said,
    )
    assert re.search(r"which were 0\.(2|19)\d* m/s off the .* already", said)

    columns["wheel.FR.v"][1000:1200] += 0.3
    found, pair = edge("onset", columns)
    assert found is not None
    assert edge_words(found, pair).startswith(
        "No sample of the 150 ms after stands out of the noise against the samples before it, which were 0."
    )
