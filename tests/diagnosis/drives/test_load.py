"""Extra load of a drive: the effort map from several missions, and a load that comes and goes within one."""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray

from diagnosis.drives import load as load_module
from diagnosis.drives.effort_map import identify_effort, step_means
from diagnosis.drives.inputs import DriveRecord
from diagnosis.drives.load import track_load
from replay.machine.drive_model import EffortMap

Array = NDArray[np.float64]

DT = 0.02
MAP = EffortMap(offset=6.0, slope=2.0, between=0.5, drift=0.03, noise=0.1, slowest=1.0, fastest=4.0)


def mission(seed: int, speed: float, offset: float = 0.0, seconds: int = 30) -> DriveRecord:
    """Effort 6 + 2·v + offset with noise, at one commanded speed."""
    rng = np.random.default_rng(seed)
    size = round(seconds / DT)
    y = speed + rng.normal(0, 0.1, size)
    u = 6.0 + 2.0 * speed + offset + rng.normal(0, 0.3, size)
    return DriveRecord(y, np.full(size, speed), u, DT)


def loaded(record: DriveRecord, start_s: float, stop_s: float, load: float) -> DriveRecord:
    t = np.arange(record.y.size) * DT
    return DriveRecord(record.y, record.command, record.u + load * ((t >= start_s) & (t < stop_s)), DT)


def test_the_map_and_the_spread_of_missions_are_found() -> None:
    rng = np.random.default_rng(0)
    own = rng.normal(0, 0.5, 24)
    found = identify_effort([mission(i, 1.0 + i % 4, own[i]) for i in range(24)], 0.1)
    assert found is not None
    assert found.offset == pytest.approx(6.0, abs=0.6)
    assert found.slope == pytest.approx(2.0, abs=0.25)
    assert found.between == pytest.approx(float(np.std(own)), rel=0.3)
    assert found.drift < 0.05
    assert (found.slowest, found.fastest) == pytest.approx((1.0, 4.0), abs=0.1)


def test_one_speed_gives_a_line_through_zero() -> None:
    found = identify_effort([mission(i, 3.0) for i in range(4)], 0.1)
    assert found is not None
    assert found.offset == 0.0
    assert found.slope == pytest.approx(4.0, rel=0.02)


def test_fewer_than_three_missions_give_no_map() -> None:
    assert identify_effort([mission(0, 1.0), mission(1, 2.0)], 0.1) is None


def test_the_offset_of_a_mission_is_no_load() -> None:
    track = track_load(mission(1, 2.0, offset=0.6), MAP, 0.1)
    assert np.nanmax(track.probability) < 0.5


@pytest.mark.parametrize("load", [1.0, 3.0])
def test_a_load_within_a_mission_is_found_with_its_size(load: float) -> None:
    track = track_load(loaded(mission(2, 2.0, offset=-0.4), 10, 20, load), MAP, 0.1)
    assert track.probability[11:19].min() > 0.95
    assert np.r_[track.probability[:9], track.probability[21:]].max() < 0.2
    assert track.level[11:19].mean() == pytest.approx(load, rel=0.15)
    assert track.expected[11:19].mean() == pytest.approx(9.6, abs=0.3)


def test_driving_backward_is_the_same() -> None:
    ahead = loaded(mission(3, 2.0), 10, 20, 2.0)
    back = DriveRecord(-ahead.y, -ahead.command, -ahead.u, DT)
    assert track_load(back, MAP, 0.1).probability == pytest.approx(track_load(ahead, MAP, 0.1).probability)


def test_standing_is_left_out() -> None:
    record = mission(4, 2.0)
    record.command[:500] = 0.0
    track = track_load(record, MAP, 0.1)
    assert np.isnan(track.probability[:10]).all()
    assert np.isfinite(track.probability[10:]).all()
    assert np.isfinite(track.sampled(track.probability, 1500)[480:]).all()


def test_steps_at_speeds_of_no_healthy_mission_are_not_covered() -> None:
    slow, fast = mission(5, 4.1), mission(6, 4.4)
    record = DriveRecord(*(np.concatenate([getattr(r, x) for r in (slow, fast)]) for x in ("y", "command", "u")), DT)
    assert track_load(record, MAP, 0.1).covered.tolist() == [1.0] * 30 + [0.0] * 30


def test_nothing_driven_gives_nothing() -> None:
    record = DriveRecord(np.full(500, np.nan), np.zeros(500), np.zeros(500), DT)
    assert np.isnan(track_load(record, MAP, 0.1).probability).all()


def test_without_loads_the_offset_is_a_kalman_smoothers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(load_module, "_LOADED", 0.0)
    wide = EffortMap(offset=6.0, slope=2.0, between=0.5, drift=0.1, noise=0.1, slowest=1.0, fastest=4.0)
    record = mission(5, 2.0, offset=0.5, seconds=20)
    record.u[:] += 0.4 * np.sin(np.arange(record.u.size) * DT / 4)
    speed, effort, _ = step_means(record, 0.1)
    kf = KalmanFilter(dim_x=1, dim_z=1)
    kf.x, kf.P, kf.F, kf.H = np.zeros((1, 1)), np.eye(1) * 0.5**2, np.eye(1), np.eye(1)
    kf.Q, kf.R = np.eye(1) * 0.1**2, np.eye(1) * 0.1**2
    means, covs = [], []
    for k, z in enumerate(effort - 6.0 - 2.0 * speed):
        if k:
            kf.predict()
        kf.update(z)
        means.append(kf.x.copy())
        covs.append(kf.P.copy())
    smooth = kf.rts_smoother(np.array(means), np.array(covs))[0].ravel()
    track = track_load(record, wide, 0.1)
    assert track.expected - 6.0 - 2.0 * speed == pytest.approx(smooth, abs=0.03)
    assert track.probability == pytest.approx(0.0, abs=1e-9)
