"""Which driving the models of wheels are measured from."""

from __future__ import annotations

import numpy as np

from diagnosis.wheels.plant_windows import Drive, usual_driving


def test_speeds_next_to_nothing_are_no_effort() -> None:
    n = 400
    y, u = np.full((n, 1), 0.5), np.full((n, 1), 0.25)
    y[:100], u[100:150] = 5e-324, 2.0  # u ÷ y leaves the range; far more opening than usual
    drive = Drive(u=u, y=y, body=np.zeros(n), moving=np.ones((n, 1), dtype=bool), dt=0.01)
    (kept,) = usual_driving([drive], 1.0)
    assert not kept.moving[100:150].any()
    assert kept.moving[150:].all()
