"""What of a wheel is unusual beside the others."""

from __future__ import annotations

import numpy as np

from diagnosis.response.assess import assess_response
from diagnosis.response.channel import samples_of
from diagnosis.response.inputs import FollowerData
from diagnosis.response.rivals import _wild_share
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds


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


def test_a_wheel_that_another_view_shows_may_differ_together_with_one_that_nothing_shows() -> None:
    measured, asked, body = speeds(8, ("FR", "RR", "FL"))
    part = slice(round(60 / DT), round(75 / DT))
    for w, gain in (("FR", 0.5), ("RR", 0.7), ("FL", 0.6)):
        measured[w][part] *= gain
    data: dict[str, FollowerData] = followers_of(measured, asked, body)
    judged = assess_response(data, geometry(tuple(measured)), None, Limits(), DT)
    assert judged.parts.keys() == data.keys()
