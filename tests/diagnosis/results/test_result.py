"""Results become plain JSON: no NaN, no NumPy types, short numbers."""

from __future__ import annotations

import json

import numpy as np
import pytest

from diagnosis.results.result import Epsilon, Hypothesis, Sat, StateSpan, to_json
from replay.faults import State


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (float("nan"), None),
        (np.inf, None),
        (np.float64(0.1), 0.1),
        (np.float32(0.5), 0.5),
        (np.int64(7), 7),
        (np.bool_(True), True),
        (1 / 3, 0.333333333),
        (1_760_000_000_000_000_001, 1_760_000_000_000_000_001),
        ("ε", "ε"),
        (None, None),
        (State.NO_SIGNAL, "no_signal"),
        ((1, [np.float64(np.nan)]), [1, [None]]),
        ({"a": {1: (2.0,)}}, {"a": {"1": [2.0]}}),
        (Epsilon(np.float64(0.5), np.nan, 1.0), {"value": 0.5, "low": None, "high": 1.0}),
    ],
)
def test_plain_values(value: object, expected: object) -> None:
    got = to_json(value)
    assert got == expected
    assert type(got) is type(expected) or isinstance(got, str)
    assert json.loads(json.dumps(got, allow_nan=False)) == expected


def test_nested_records() -> None:
    span = StateSpan("FR", "sensor", State.HEALTHY, 0.0, 1.0)
    got = to_json(
        {"spans": [span], "sat": Sat(0.1, 0.2, 0.0, 0.3, "m/s"), "best": (Hypothesis("sensor", "stuck", 1.0),)}
    )
    assert got == {
        "spans": [
            {"component": "FR", "side": "sensor", "state": "healthy", "start_s": 0.0, "stop_s": 1.0, "reason": ""}
        ],
        "sat": {"mean": 0.1, "rms": 0.2, "low": 0.0, "high": 0.3, "unit": "m/s"},
        "best": [{"side": "sensor", "mode": "stuck", "p": 1.0}],
    }


def test_bounds_hold_what_is_not_known_of_the_healthy_gain() -> None:
    sharp = Epsilon(0.4, 0.399, 0.401)
    wide = sharp.with_gain(0.03)
    assert wide.value == sharp.value
    assert (wide.low, wide.high) == pytest.approx((0.4 - 1.96 * 0.03 * 0.6, 0.4 + 1.96 * 0.03 * 0.6), abs=1e-3)
    assert sharp.with_gain(0.0).low == pytest.approx(sharp.low)


@pytest.mark.parametrize(
    ("value", "half", "expected"), [(0.1, 0.2, 0.5), (0.3, 0.05, 0.0), (0.12, 0.13, 0.38), (0.05, 0.0, 1.0)]
)
def test_how_much_of_a_loss_is_too_small_by_its_bounds(value: float, half: float, expected: float) -> None:
    assert Epsilon(value, value - half, value + half).below(0.1) == pytest.approx(expected, abs=0.01)
