"""Loss of effectiveness over a mission: value, bounds that cover, and nothing where nothing can be said."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.results.loss import loss_of, loss_rows

DT = 0.01


def drive(seed: int, epsilon: float, seconds: float = 60.0) -> tuple[np.ndarray, np.ndarray]:
    """Reference and reading of a part that loses `epsilon`, with errors that last for a tenth of a second."""
    rng = np.random.default_rng(seed)
    n = round(seconds / DT)
    x = np.sin(2 * np.pi * np.arange(n) * DT / 7.0) + 0.3 * rng.normal(size=n // 200 + 1).repeat(200)[:n]
    error = np.convolve(rng.normal(0, 0.03, n), np.ones(10) / 3.0, mode="same")
    return x, (1 - epsilon) * x + error


def test_value_and_time() -> None:
    x, y = drive(0, 0.07)
    found = loss_of(y, x, np.ones(x.size, np.bool_), DT)
    assert found is not None
    assert found.epsilon.value == pytest.approx(0.07, abs=0.01)
    assert found.epsilon.low < 0.07 < found.epsilon.high
    assert found.seconds == pytest.approx(60.0)


def test_bounds_cover_nineteen_of_twenty() -> None:
    inside = 0
    for seed in range(300):
        x, y = drive(seed, 0.05, 40.0)
        found = loss_of(y, x, np.ones(x.size, np.bool_), DT)
        assert found is not None
        inside += found.epsilon.low <= 0.05 <= found.epsilon.high
    assert 0.91 <= inside / 300 <= 0.98


def test_samples_that_do_not_count_change_nothing() -> None:
    x, y = drive(1, 0.05)
    use = np.ones(x.size, np.bool_)
    use[1000:3000] = False
    wild, gone = y.copy(), y.copy()
    wild[1000:3000], gone[1000:3000] = 100.0, np.nan
    assert loss_of(wild, x, use, DT) == loss_of(gone, x, np.ones(x.size, np.bool_), DT)


def test_too_little_gives_nothing() -> None:
    x, y = drive(2, 0.05, 8.0)
    assert loss_of(y, x, np.ones(x.size, np.bool_), DT) is None
    x, y = drive(2, 0.05)
    assert loss_of(y, x, np.zeros(x.size, np.bool_), DT) is None
    assert loss_of(y, np.zeros(x.size), np.ones(x.size, np.bool_), DT) is None


def test_blocks_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    x, y = drive(3, 0.05)
    use = np.ones(x.size, np.bool_)
    whole = loss_of(y, x, use, DT)
    monkeypatch.setattr("replay.arrays.blocks.BLOCK", 700)
    assert loss_of(y, x, use, DT) == whole


def test_rows_of_the_report() -> None:
    x, y = drive(4, 0.05)
    found = loss_of(y, x, np.ones(x.size, np.bool_), DT)
    assert found is not None
    rows = loss_rows({("FR", "sensor"): found, ("FR", "actuator"): None})
    expected = {"component": "FR", "side": "sensor", "epsilon": found.epsilon.row(), "seconds": found.seconds}
    assert rows == [{**expected, "relative": False}]
