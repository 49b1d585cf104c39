"""Forward acceleration beside the changes of a speed: what is identified, against sums that are written out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from diagnosis.response.acceleration import ENOUGH, Relation, acceleration_of, changes

Array = NDArray[np.float64]

H, N = 0.05, 4000
NOWHERE = np.zeros(N, np.bool_)


def driven(seed: int) -> Array:
    """A speed that is asked for in steps and reached by ramps [m/s]."""
    rng = np.random.default_rng(seed)
    asked = np.repeat(rng.uniform(0.0, 2.0, N // 80), 80)
    v = np.zeros(N)
    for k in range(1, N):
        v[k] = v[k - 1] + np.clip(asked[k] - v[k - 1], -0.08, 0.08)
    return v


def read(v: Array, seed: int, gain: float = 1.0, noise: float = 0.3) -> Array:
    """What a unit on a hilly way reads of it, with its bias [m/s²]."""
    rng = np.random.default_rng(seed)
    slope = 0.05 * np.sin(2 * np.pi * np.arange(N) * H / 40.0)
    return np.asarray(gain * np.gradient(v, H) + 9.81 * np.sin(slope) + 0.2 + rng.normal(0.0, noise, N))


def test_changes_are_those_of_a_window_less_half_of_its_neighbours() -> None:
    value = np.random.default_rng(0).normal(size=50).cumsum()
    for reach in (2, 4):
        got = changes(value, reach)
        for k in range(50):
            first = k - reach // 2
            if first - reach < 0 or first + 2 * reach >= 50:
                assert np.isnan(got[k])
                continue
            step = [value[first + j * reach + reach] - value[first + j * reach] for j in (-1, 0, 1)]
            assert got[k] == pytest.approx(step[1] - 0.5 * (step[0] + step[2]))


def test_a_bias_and_a_ramp_of_it_vanish() -> None:
    t = np.arange(200) * H
    integral = 3.0 * t + 0.5 * 0.7 * t**2
    assert np.nanmax(np.abs(changes(integral, 10))) < 1e-12
    assert np.isfinite(changes(integral, 10)).sum() == 200 - 30


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("gain", "late"), [(1.0, 0), (-1.0, 2), (0.8, -1)])
def test_gain_and_delay_are_found(seed: int, gain: float, late: int) -> None:
    v = driven(seed)
    seen = np.r_[np.zeros(late), v[: N - late]] if late >= 0 else np.r_[v[-late:], np.full(-late, v[-1])]
    found = acceleration_of(seen, read(v, seed + 50, gain), NOWHERE, H)
    assert found is not None
    assert found.gain == pytest.approx(gain, rel=0.15)
    assert abs(found.delay - late) <= 1


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("unit", ["another axis", "dead", "nothing", "of a body that stands"])
def test_what_is_of_something_else_is_not_related(seed: int, unit: str) -> None:
    v = driven(seed)
    a = {
        "another axis": read(driven(seed + 900), seed),
        "dead": np.zeros(N),
        "nothing": np.full(N, np.nan),
        "of a body that stands": read(np.zeros(N), seed),
    }[unit]
    assert acceleration_of(v, a, NOWHERE, H) is None


def test_what_a_change_says_is_the_ratio_of_two_normal_laws() -> None:
    y, x = np.full(9, 1.5), np.full(9, 0.6)
    one = Relation(0.9, 0, 2, 0.2, 0.3, 0.4, y, x)
    own, body = norm(0.0, np.hypot(0.2, 0.9 * 0.4)), norm(0.9 * 1.5, np.hypot(0.2, 0.3 * 0.9 * 1.5))
    peaks = own.logpdf(0.0) - body.logpdf(0.9 * 1.5)  # what their widths make of it does not count
    assert one.says(4) == pytest.approx((own.logpdf(0.6) - body.logpdf(0.6) - peaks, 1.5, 0.6 / 0.9))
    assert one._replace(x=np.full(9, np.nan)).says(4)[0] == 0.0


@pytest.mark.parametrize("share", [0.6, 1.0, 2.0, 4.0])
def test_a_body_that_does_more_than_half_of_a_change_or_more_than_all_of_it_is_none_for_the_sensor(
    share: float,
) -> None:
    one = Relation(0.9, 0, 2, 0.02, 0.1, 0.4, np.full(9, 1.5), np.full(9, share * 0.9 * 1.5))
    assert one.says(4)[0] <= -ENOUGH


def test_the_smallest_change_that_shows_does_so_and_a_smaller_one_does_not() -> None:
    one = Relation(1.0, 0, 2, 0.1, 0.2, 0.1, np.zeros(9), np.zeros(9))
    for share, shows in ((1.01, True), (0.99, False)):
        nats = one._replace(y=np.full(9, share * one.least)).says(4)[0]
        assert (nats > ENOUGH) is shows
    assert one._replace(spread=3.0).least == np.inf
