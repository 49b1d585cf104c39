"""A machine that stands, by readings whose noise is more than standstill."""

import numpy as np

from diagnosis.channels.standstill import not_followed, without_noise

_DT, _N = 0.05, 1200


def _asked() -> np.ndarray:
    return np.where(np.arange(_N) > 60, 1.0, 0.0)


def test_noise_is_no_motion() -> None:
    rng, fresh = np.random.default_rng(1), np.ones(_N, np.bool_)
    speeds = [rng.normal(0.0, 0.02, _N) for _ in range(4)]
    asked = [_asked()] * 4
    assert not not_followed(speeds, asked, 0.05, _DT)
    seen = [without_noise(y, fresh, c, 0.05) for y, c in zip(speeds, asked, strict=True)]
    ((first, stop),) = not_followed(seen, asked, 0.05, _DT, speeds)
    assert (first, stop) == (61, _N)


def test_slow_motion_is_no_noise_and_a_quiet_speed_is_as_it_is() -> None:
    rng, fresh = np.random.default_rng(2), np.ones(_N, np.bool_)
    slow = 0.15 * _asked() + rng.normal(0.0, 0.02, _N)
    assert not not_followed([without_noise(slow, fresh, _asked(), 0.05)] * 2, [_asked()] * 2, 0.05, _DT)
    quiet = np.full(_N, 0.015)
    assert np.array_equal(without_noise(quiet, fresh, _asked(), 0.05), quiet)


def test_readings_that_are_not_about_nothing_are_no_standstill() -> None:
    rng, fresh = np.random.default_rng(3), np.ones(_N, np.bool_)
    creeps = [np.abs(rng.normal(0.0, 0.02, _N)) for _ in range(2)]
    seen = [without_noise(y, fresh, _asked(), 0.05) for y in creeps]
    assert not not_followed(seen, [_asked()] * 2, 0.05, _DT, creeps)
