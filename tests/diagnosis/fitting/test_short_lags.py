"""A lag that is shorter than a step of the log is fitted, and known to half a step at best."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.fitting.wheels import fit_wheel
from diagnosis.fitting.windows import WheelRecord


@pytest.mark.parametrize("seed", range(3))
def test_a_log_of_ten_readings_a_second_that_shows_no_lag_is_fitted(seed: int) -> None:
    rng, dt = np.random.default_rng(seed), 0.1
    u = np.repeat(rng.choice([0.3, 0.5, 0.7, 0.9], 40), 30) + 0.05 * np.repeat(rng.normal(size=240), 5)
    y = 0.8 * u + rng.normal(0.0, 0.003, u.size)
    record = WheelRecord(y, u[:, None], 0.8 * u, np.ones(u.size, np.bool_), dt, 0.05)
    fit = fit_wheel([record], 0.2)
    assert fit.refused == ""
    assert np.isfinite([fit.K.value, fit.tau.value]).all()
    assert fit.tau.std >= 0.5 * dt or not np.isfinite(fit.tau.std)
