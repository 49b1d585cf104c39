from __future__ import annotations

import numpy as np

from diagnosis.fitting.robust import robust_solve


def test_residuals_that_are_all_zero_need_no_floor() -> None:
    x = np.column_stack([np.arange(12.0), np.ones(12)])
    beta, agree = robust_solve(x, x, np.zeros(12), np.ones(12), 0.0)
    np.testing.assert_allclose(beta, 0.0, atol=1e-12)
    assert agree.all()
