"""How large a fault must be to be found, against faults that are laid into the recorded columns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.clearing import axle_rates
from diagnosis.clearing.alone import Straight
from diagnosis.clearing.cells import Frame
from diagnosis.clearing.checks import checks_of
from diagnosis.clearing.detectable import detectable, places_of
from diagnosis.clearing.gauges import Gauges, gauges_of
from diagnosis.clearing.placements import Placements, countered, placements
from diagnosis.results.clearing import Check
from diagnosis.results.detectability import Deviation
from diagnosis.results.machine_words import HYDRAULIC
from replay.faults import FaultMode, FaultSpec, Side
from replay.simulation.options import SimulatedMission
from tests.campaigns import campaign_of_rows
from tests.diagnosis.clearing.missions import LENGTH, in_cells, simulated

_COLUMNS = {
    ("FR", Side.SENSOR): "wheel.FR.v",
    ("FR", Side.ACTUATOR): "wheel.FR.u_applied",
    ("rear", Side.SENSOR): "steer.rear.phi",
}


def _gauges(mission: SimulatedMission, part: str, side: Side, *, base: bool) -> Gauges:
    return next(g for g in gauges_of(in_cells(mission, base=base)) if (g.component, g.side) == (part, side))


def _with(mission: SimulatedMission, name: str, start: float, stop: float, factor: float) -> SimulatedMission:
    t = (mission.stamps - mission.stamps[0]) * 1e-9
    x = mission.columns[name]
    return replace(mission, columns={**mission.columns, name: np.where((t >= start) & (t < stop), factor * x, x)})


def _found(mission: SimulatedMission, part: str, *, base: bool) -> bool:
    return any(c.component == part and not c.passed for c in checks_of(in_cells(mission, base=base), HYDRAULIC))


@pytest.mark.parametrize(
    ("part", "side", "base", "length"),
    campaign_of_rows(
        [
            ("FR", Side.SENSOR, False, 2.0),
            ("FR", Side.ACTUATOR, False, 10.0),
            ("FR", Side.SENSOR, True, 2.0),
            ("rear", Side.SENSOR, False, 10.0),
            ("FR", Side.SENSOR, False, 10.0),
            ("FR", Side.ACTUATOR, False, 2.0),
            ("FR", Side.SENSOR, True, 10.0),
        ],
        4,
    ),
)
def test_a_loss_is_found_from_the_size_that_is_stated(part: str, side: Side, base: bool, length: float) -> None:
    mission, name = simulated(), _COLUMNS[part, side]
    gauges, cells = _gauges(mission, part, side, base=base), in_cells(mission, base=base)
    places = places_of(gauges, cells, length)
    sizes = gauges.sizes(places, lambda r: r.loss, lambda r: r.loss)
    known = np.flatnonzero((sizes > 0.0) & (sizes < 0.75))
    assert known.size
    for k in known[:: max(1, known.size // 4)]:
        span = float(places.first[k] * cells.dt), float(places.last[k] * cells.dt)
        assert _found(_with(mission, name, *span, 1.0 - 1.25 * sizes[k]), part, base=base), (span, sizes[k])
        if side is Side.ACTUATOR:  # where no other check sees it earlier
            assert not _found(_with(mission, name, *span, 1.0 - 0.5 * sizes[k]), part, base=base), (span, sizes[k])


def test_a_fault_shorter_than_a_cell_has_no_place() -> None:
    assert placements(np.ones(30, dtype=np.bool_), 0, 30).first.size == 0


def test_rows_state_every_part_and_length() -> None:
    cells = in_cells(simulated(), base=False)
    found = detectable(cells)
    parts = {(d.component, d.side) for d in found.rows}
    assert len(parts) == 12
    for part in parts:
        own = [d for d in found.rows if (d.component, d.side) == part]
        assert {d.for_s for d in own if d.deviation is Deviation.INEFFICIENT} == {2.0, 10.0, None}
        assert {d.told for d in own} == {part[1]}
    assert {d.told for d in detectable(in_cells(simulated(), base=True)).rows} == {Side.SENSOR_OR_ACTUATOR}
    assert {(t.component, t.side) for t in found.traces} == parts
    longer = {
        d.for_s: d.size for d in found.rows if (d.component, d.side, d.deviation) == ("FR", "sensor", "inefficient")
    }
    assert longer[2.0] is not None
    assert longer[10.0] is not None
    assert longer[2.0] > longer[10.0]


def test_what_is_stated_is_no_place_for_another_fault() -> None:
    cells = in_cells(simulated(FaultSpec("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL, 10.0, 30.0)), base=False)
    stated = replace(cells, stated={"FR": [(10.0, 30.0)]})
    gauges = next(g for g in gauges_of(stated) if g.component == "FR")
    places = places_of(gauges, stated, 2.0)
    assert places.first.size
    assert not np.any((places.first * cells.dt > 10.2) & (places.last * cells.dt < 29.8))


def test_what_is_stated_for_most_of_the_mission_leaves_nothing_to_show_over_all_of_it() -> None:
    cells = in_cells(simulated(), base=True)
    stated = replace(cells, stated={"FR": [(5.0, 55.0)], "front": [(5.0, 55.0)]})
    for part, side in (("FR", Side.ACTUATOR), ("front", Side.ACTUATOR)):
        free, told = (next(g for g in gauges_of(x) if (g.component, g.side) == (part, side)) for x in (cells, stated))
        assert {Deviation.INEFFICIENT, Deviation.EXCESS} <= set(free.lasting)
        assert not told.lasting
    sensor = next(g for g in gauges_of(stated) if (g.component, g.side) == ("FR", Side.SENSOR))
    assert sensor.rough is not None
    assert np.isnan(sensor.rough.quick[stated.explained("FR")]).all()


def test_a_window_that_is_rough_as_it_is_shows_no_noise_of_no_size() -> None:
    mission, name = simulated(), "wheel.FR.v"
    x = mission.columns[name].copy()
    x[2000:2400] += 0.1 * np.random.default_rng(2).standard_normal(400)
    rough = next(
        g for g in gauges_of(in_cells(replace(mission, columns={**mission.columns, name: x}), base=True))
    ).rough
    assert rough is not None
    assert np.isnan(rough.quick).any()
    known = np.isfinite(rough.quick)
    assert (rough.quick[known] < (rough.limit * rough.size)[known]).all()


def test_a_part_that_rests_has_no_places() -> None:
    moving = np.zeros(600, dtype=np.bool_)
    assert placements(moving, 20, 600).first.size == 0
    whole = placements(moving, None, 600)
    assert (whole.first.tolist(), whole.last.tolist()) == ([0], [600])
    moving[100:200] = True
    assert placements(moving, 20, 600).first.min() == 92  # 12 of 20 cells are driven
    assert LENGTH == 60.0


def test_a_loop_that_counters_an_excess_hides_some_of_it() -> None:
    less = np.array([-0.1, 0.0, 0.2, 0.5, 1.0, 2.0])
    np.testing.assert_allclose(countered(less), [0.0, 0.0, 0.25, 1.0, np.inf, np.inf])


def test_an_angle_that_is_off_shows_where_the_machine_goes_straight() -> None:
    off = np.full(600, np.nan)
    off[100:300] = 0.01
    check = Straight(Frame(600, 30, 5), off, 0.06)
    places = Placements(np.array([150, 400]), np.array([250, 500]))
    sizes = check.offset(places.overlap(check.frame))
    assert sizes[0] == pytest.approx(0.07)
    assert np.isinf(sizes[1])


def test_a_window_that_is_beyond_the_limit_as_it_is_shows_no_fault_of_no_size() -> None:
    """A valve whose check passes all the same is not *found with an excess of 0 %*, which would leave it not cleared."""
    mission = _with(simulated(), "wheel.FR.u_applied", 20.0, 20.8, 4.0)
    reference = _gauges(mission, "FR", Side.ACTUATOR, base=False).reference
    assert reference is not None
    all_windows = reference.compared._replace(moves=np.ones_like(reference.compared.moves))
    assert (all_windows.off >= reference.limit).any()
    assert not (reference.compared.moves & (all_windows.off >= reference.limit)).any()
    rows = detectable(in_cells(mission, base=False)).rows
    sizes = [r.size for r in rows if (r.component, r.side) == ("FR", Side.ACTUATOR) and r.size is not None]
    assert min(sizes) > 0.0


def test_what_would_show_of_axles_is_what_their_check_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    bands = np.array([0.0, 0.035])  # so nearly alike that the check takes them as one
    monkeypatch.setattr(axle_rates, "dead_bands", lambda rate, opening: bands)
    cells = in_cells(simulated(), base=True)
    asked = {c.component: c for c in checks_of(cells, HYDRAULIC) if c.check is Check.LASTING_RATE}
    assert set(asked) == {"front", "rear"}
    for g in gauges_of(cells):
        if g.component in asked:
            check = asked[g.component]
            assert check.passed
            assert check.worst is not None
            room = min(-np.log1p(-g.lasting[Deviation.INEFFICIENT]), np.log1p(g.lasting[Deviation.EXCESS]))
            assert room == pytest.approx(check.limit - check.worst)
