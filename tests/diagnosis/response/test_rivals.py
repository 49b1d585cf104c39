"""What of a wheel is unusual beside the others."""

from __future__ import annotations

import numpy as np

from diagnosis.response.channel import samples_of
from diagnosis.response.rivals import _wild_share


def test_spikes_are_counted_per_reading_of_a_wheel_that_turns() -> None:
    rng = np.random.default_rng(3)
    t = np.arange(4000)
    y = 1.0 + 0.3 * np.sin(t / 50.0) + rng.normal(0.0, 0.01, t.size)
    y[100::200] += 4.0
    held = np.where(t < 1000, y, 0.0)
    fresh = np.ones(t.size, np.bool_)
    turning, jammed = (_wild_share(samples_of(x, fresh)) for x in (y, held))
    assert 0.004 < turning < 0.006
    assert 0.5 < jammed / turning < 2.0
    assert _wild_share(samples_of(np.full(10, np.nan), fresh[:10])) == 0.0
