from __future__ import annotations

import re

import numpy as np
import pytest

from diagnosis.report.machine_picture import condition, machine_picture, places_in_words
from diagnosis.report.path_picture import path_picture, unnamed_words
from diagnosis.report.standing import Standing
from diagnosis.report.thumbnail import thumbnail
from diagnosis.results.vocabulary import Kind
from tests import report_samples as samples

CLEARED = {("FR", side): Standing.CLEARED for side in ("sensor", "actuator")}
FAULT = samples.fault(start_s=3.0, stop_s=4.0)


def test_front_left_stands_at_the_top_left() -> None:
    report, _ = samples.five_faults()
    picture = machine_picture(report)
    places = {
        n: (float(x), float(y))
        for x, y, n in re.findall(r'<text x="([\d.]+)" y="([\d.]+)" class="name">(\w+)<', picture)
    }
    assert places["FL"][0] < places["FR"][0]
    assert places["FL"][1] == places["FR"][1] < places["RR"][1]
    assert 'data-f="F4"' in picture


def test_short_names_of_wheels_are_spelled_out() -> None:
    named = places_in_words(samples.report_with(machine={"wheels": ["FR", "ML"]}))
    assert named == "FR = front right, ML = middle left"
    assert places_in_words(samples.report_with(machine={"wheels": ["FR", "drive"]})) == ""


@pytest.mark.parametrize("count", [0, 1, 3, 12])
def test_any_number_of_wheels_without_geometry(count: int) -> None:
    picture = machine_picture(samples.report_with(machine={"wheels": [f"w{i}" for i in range(count)]}))
    assert picture.count('class="tyre not_assessed"') == count


def test_part_that_was_never_judged_is_not_called_healthy() -> None:
    half = condition("FR", Kind.WHEEL, [], CLEARED | {("FR", "actuator"): Standing.NOT_JUDGED})
    assert (half.state, half.lines) == ("not_assessed", ("No fault found", "drive valve not judged"))
    none = condition("FR", Kind.WHEEL, [], {})
    assert (none.state, none.lines) == ("not_assessed", ("Not judged",))


def test_an_axle_that_was_not_steered_is_told_so_and_is_no_question() -> None:
    both = condition("rear", Kind.STEER, [], {("rear", side): Standing.NOT_STEERED for side in ("sensor", "actuator")})
    assert (both.state, both.lines) == ("not_excited", ("No fault found", "not steered"))
    parts = {("rear", "sensor"): Standing.CLEARED, ("rear", "actuator"): Standing.NOT_STEERED}
    one = condition("rear", Kind.STEER, [], parts)
    assert (one.state, one.title) == ("not_excited", "rear: no fault found, steering valve not steered")
    parts[("rear", "sensor")] = Standing.NOT_JUDGED
    assert condition("rear", Kind.STEER, [], parts).state == "not_assessed"


def test_what_was_not_judged_of_a_faulty_wheel_is_said_too() -> None:
    found = condition("FR", Kind.WHEEL, [FAULT], CLEARED | {("FR", "actuator"): Standing.NOT_JUDGED})
    assert found.lines[-1] == "drive valve not judged"
    assert found.title.endswith(", drive valve not judged")
    assert condition("FR", Kind.WHEEL, [FAULT], CLEARED).lines[-1] == "1.0 s"


def test_thumbnail_keeps_gaps_and_clips_to_the_mission() -> None:
    y = np.where(np.arange(1000) % 300 < 30, np.nan, 1.0)
    picture = thumbnail(FAULT, y, None, 0.0, 0.01)
    assert picture.count("M") >= 1
    assert "nan" not in picture
    assert thumbnail({**FAULT, "start_s": 9.99, "stop_s": 500.0}, np.zeros(1000), None, 0.0, 0.01)
    assert thumbnail(FAULT, np.full(1000, np.nan), None, 0.0, 0.01) == ""


def test_path_is_empty_where_no_position_is_known() -> None:
    nothing = np.full(100, np.nan)
    assert path_picture(nothing, nothing, 0.0, 0.1, [FAULT]) == ""


def test_path_breaks_at_gaps_and_survives_standing_still() -> None:
    x = np.linspace(0, 5, 100)
    x[40:50] = np.nan
    assert "nan" not in path_picture(x, np.zeros(100), 0.0, 0.1, [FAULT])
    assert path_picture(np.zeros(100), np.zeros(100), 0.0, 0.1, [FAULT]).count('class="mark') == 1


def test_a_part_that_is_not_cleared_is_not_called_healthy() -> None:
    short = {("FR", "actuator"): Standing.NOT_LONG_ENOUGH}
    one = condition("FR", Kind.WHEEL, [], CLEARED | short)
    assert (one.state, one.lines) == ("not_assessed", ("No fault found", "drive valve not judged long enough"))
    each = condition("FR", Kind.WHEEL, [], {("FR", "sensor"): Standing.NOT_CLEARED} | short)
    assert each.lines == ("No fault found", "speed sensor not cleared", "drive valve not judged long enough")
    both = condition("FR", Kind.WHEEL, [], dict.fromkeys(CLEARED, Standing.NOT_CLEARED))
    assert both.lines == ("No fault found", "not cleared")
    assert condition("FR", Kind.WHEEL, [], CLEARED).lines == ("Healthy",)


def test_long_words_stand_in_several_lines() -> None:
    wheels = ["FL", "FR"]
    geometry = {w: {"x": 1.0, "y": y, "offset": 0.0, "axle": ""} for w, y in zip(wheels, (1.0, -1.0), strict=True)}
    fault = samples.fault(side="sensor_or_actuator", mode="outside_table", severity="medium", start_s=3.0, stop_s=4.0)
    rows = [
        {
            "component": "FL",
            "side": s,
            "tier": "model",
            "seconds": {"healthy": 5.0},
            "driving_s": 5.0,
            "decided_driving_s": 5.0,
        }
        for s in ("sensor", "actuator")
    ]
    report = samples.report_with(machine={"wheels": wheels, "geometry": geometry}, intervals=[fault], coverage=rows)
    words = re.findall(r'class="side[^"]*">([^<]*)<', machine_picture(report))
    assert words == [
        "No fault found",
        "not judged long",
        "enough",
        "Speed sensor or",
        "drive valve",
        "outside the",
        "tables",
        "1.0 s",
    ]
    assert max(map(len, words)) <= 15


def test_what_is_of_little_severity_is_a_remark_and_paints_no_part() -> None:
    faint = samples.fault(mode="noisy", severity="info", start_s=30.0, stop_s=30.013)
    found = condition("FR", Kind.WHEEL, [faint], CLEARED)
    assert (found.state, found.lines, found.fault) == ("healthy", ("Healthy", "1 remark"), faint["id"])
    assert condition("FR", Kind.WHEEL, [faint, samples.fault(id="F2")], CLEARED).state == "stuck"


def test_a_drive_to_stop_at_once_for_comes_before_a_sensor_as_among_the_actions() -> None:
    sensor = samples.fault(id="F1", component="FR", side="sensor", mode="stuck", severity="high", start_s=1.0)
    drive = samples.fault(id="F2", component="FR", side="actuator", mode="stuck", severity="high", start_s=3.0)
    assert condition("FR", Kind.WHEEL, [sensor, drive], {}).fault == "F2"
    assert condition("FR", Kind.WHEEL, [sensor, {**drive, "severity": "medium"}], {}).fault == "F1"


def test_a_path_says_how_many_faults_it_leaves_unnamed() -> None:
    assert unnamed_words([FAULT] * 24) == ""
    assert "24 most severe of 34 faults drawn; the other 10 are" in unnamed_words([FAULT] * 34)


def test_wheels_of_turntables_stand_on_their_side() -> None:
    """All joints are in the middle: the sides are those of the wheels' own distances from them."""
    places = {"FR": -1.0, "FL": 1.0}
    geometry = {w: {"x": 1.7, "y": 0.0, "offset": offset, "axle": "front"} for w, offset in places.items()}
    report = samples.report_with(machine={"wheels": list(places), "geometry": geometry}, intervals=[], coverage=[])
    picture = machine_picture(report)
    assert picture.index('data-c="FL"') < picture.index('data-c="FR"')
