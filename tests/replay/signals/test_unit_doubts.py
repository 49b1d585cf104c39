"""Values that cannot be ask for the line that mends them; faults of one sensor do not."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replay.errors import ConfigError
from replay.log.raw_log import Channel, LogSummary, RawLog
from replay.log.source_options import SignalSource
from replay.machine.config import Machine, haulotte
from replay.machine.toml_file import load_machine
from replay.mission import check_units
from replay.signals.mapping import map_signals
from replay.signals.signal import Signals
from replay.signals.unit_doubts import doubt

WHEELS = haulotte().wheels
KNOWN = replace(haulotte(), assumed=())
WAVE = np.sin(np.arange(400) * 0.05)


def mapped(columns: dict[str, Any], given: dict[str, SignalSource], machine: Machine = KNOWN) -> Signals:
    stamps = np.arange(400) * 10_000_000
    channels = {n: Channel(n, "", n, stamps, np.asarray(v)) for n, v in columns.items()}
    log = RawLog("run.csv", "csv", "header", channels, LogSummary("run.csv", "csv", 0, 0, ()))
    return map_signals([log], replace(machine, signals=given))


@pytest.mark.parametrize(
    ("signal", "unit", "size", "line"),
    [
        ("wheel.FR.u", "1", 5.6, '"wheel.FR.u" = { column = "x", unit = "%" }'),
        ("wheel.FR.u", "1", 32767.0, '"wheel.FR.u" = { column = "x", unit = "1", gain = 3.05e-05 }'),
        ("steer.front.phi", "rad", 31.0, '"steer.front.phi" = { column = "x", unit = "deg" }'),
        ("wheel.FR.v", "m/s", 142.0, '"wheel.FR.v" = { column = "x", unit = "rpm", at = "motor" }'),
        ("cmd.v", "m/s", 300.0, '"cmd.v" = { column = "x", unit = "mm/s" }'),
    ],
)
def test_a_unit_that_cannot_be_asks_for_the_line(signal: str, unit: str, size: float, line: str) -> None:
    found = mapped({"x": size * WAVE}, {signal: SignalSource(column="x", unit=unit)})
    assert len(found.questions) == 1
    assert line in found.questions[0]
    with pytest.raises(ConfigError, match="values that cannot be, so nothing was judged"):
        check_units(found)


@pytest.mark.parametrize(("name", "unit"), [("nDrehzahl_Ist_VR", "rpm"), ("fRad_VR", "rad/s")])
def test_a_name_that_says_turns_per_minute_comes_before_the_unit_that_fits_best(name: str, unit: str) -> None:
    small = replace(KNOWN.geometry, wheel_diameter=0.2)  # type: ignore[type-var]
    machine = replace(KNOWN, geometry=small, gear_ratio=1.0, max_speed=10.0)
    found = mapped({name: 143.0 * WAVE}, {"wheel.FR.v": SignalSource(column=name, unit="m/s")}, machine)
    assert f'unit = "{unit}"' in found.questions[0]


def test_the_line_is_read_back_and_answers_the_question() -> None:
    found = mapped({"x": 31.0 * WAVE}, {"steer.front.phi": SignalSource(column="x", unit="rad")})
    line = found.questions[0].partition("write: ")[2]
    name, table = next(iter(tomllib.loads(line).items()))
    assert not mapped({"x": 31.0 * WAVE}, {name: SignalSource(**table)}).questions


def test_80_metres_per_second_are_asked_about_without_a_machine_file() -> None:
    found = mapped({"x": 80.0 * WAVE}, {"wheel.FR.v": SignalSource(column="x", unit="m/s")}, haulotte())
    assert "reaches 80 m/s" in found.questions[0]


def test_a_faster_robot_than_the_paper_s_is_no_question_while_its_top_speed_is_not_known() -> None:
    given = {"wheel.FR.v": SignalSource(column="x", unit="m/s")}
    assert not mapped({"x": 5.0 * WAVE}, given, haulotte()).questions
    assert mapped({"x": 5.0 * WAVE}, given).questions


def test_a_sensor_that_lies_beside_sound_ones_is_no_question() -> None:
    columns = dict.fromkeys(WHEELS, 0.3 * WAVE) | {"FR": np.full(400, 2.0)}
    given = {f"wheel.{w}.v": SignalSource(column=w, unit="m/s") for w in WHEELS}
    found = mapped(columns, given)
    assert not found.questions
    assert any("wheel.FR.v reaches 2 m/s" in note for note in found.notes)


def test_spikes_are_no_question() -> None:
    wave = 0.3 * WAVE
    wave[::40] = 900.0
    assert not mapped({"x": wave}, {"wheel.FR.v": SignalSource(column="x", unit="m/s")}).questions


@pytest.mark.parametrize(
    ("text", "assumed"),
    [
        ("", ("geometry", "gear_ratio", "max_speed", "max_steer", "flow", "control")),
        ("[geometry]\nmax_speed = 2\nmax_steer = 0.5\n", ("geometry", "flow", "control")),
        ('[machine]\nwheels = ["L", "R"]\n[control]\nlaw = "none"\n', ("max_speed",)),
        (
            '[machine]\nwheels = ["L", "R"]\n[control]\nlaw = "none"\n[geometry]\nwheel_diameter = 0.3\nmax_speed = 2\n'
            "L = { x = 0.0, y = 0.3 }\nR = { x = 0.0, y = -0.3 }\n",
            (),
        ),
    ],
)
def test_a_machine_knows_what_is_the_paper_s(tmp_path: Path, text: str, assumed: tuple[str, ...]) -> None:
    (tmp_path / "m.toml").write_text(text)
    assert load_machine(tmp_path / "m.toml").assumed == assumed


@pytest.mark.parametrize(("unit", "size", "line"), [("rad", 10.0, 'unit = "deg"'), ("m", 60.0, 'unit = "mm"')])
def test_a_position_is_offered_units_of_positions(unit: str, size: float, line: str) -> None:
    """Its slope is the speed: a unit of speed beside derivative = true would be none of its own."""
    source = SignalSource(column="x", unit=unit, derivative=True)
    (question,) = mapped({"x": size * WAVE}, {"wheel.FR.v": source}).questions
    assert f"{line}, derivative = true" in question


def test_turns_per_minute_are_offered_though_neither_speed_nor_size_is_known() -> None:
    """A top speed that stands in is no reason to take slow turns for kilometres per hour."""
    machine = replace(haulotte(), max_speed=10.0)
    values = 40.0 * np.sin(np.linspace(0.0, 20.0, 500))
    found = doubt("wheel.FR.v", values, SignalSource(column="MAIN.fbRad_VR.rDrehzahl_Ist"), machine)
    assert found is not None
    assert "rpm" in found.line
    unknown = replace(machine, geometry=None)
    found = doubt("wheel.FR.v", 10.0 * values, SignalSource(topic="/rpm", field="data"), unknown)
    assert found is not None
    assert 'unit = "rpm" } with [geometry] wheel_diameter' in found.line


@pytest.mark.parametrize(("dead", "asked"), [(True, False), (False, True)])
def test_a_wheel_that_runs_away_from_a_dead_speed_is_no_wrong_unit(dead: bool, asked: bool) -> None:
    at = np.arange(400) * 0.01
    columns = {"v": 0.0 * at if dead else 2.0 * WAVE, "p": 30.0 * KNOWN.max_speed * at, "o": 0.02 * WAVE}
    given = {
        "wheel.FR.v": SignalSource(column="v", unit="rad/s"),
        "wheel.FR.v_position": SignalSource(column="p", unit="rad", derivative=True),
        "wheel.FL.v_position": SignalSource(column="o", unit="rad", derivative=True),
    }
    assert bool(mapped(columns, given).questions) is asked


@pytest.mark.parametrize("wild", [1.0, 20.0])
def test_speeds_recorded_alike_get_one_unit_whatever_each_of_them_reaches(wild: float) -> None:
    """Of wheels that reach 372 and 490 in mm/s one was offered deg/s and the other mm/s."""
    small = replace(KNOWN.geometry, wheel_diameter=0.2)  # type: ignore[type-var]
    machine = replace(KNOWN, wheels=("FR", "FL", "RR", "RL"), geometry=small, gear_ratio=1.0, max_speed=0.451)
    sizes = {"FR": 372.0, "FL": 490.0, "RR": 376.0, "RL": 488.0 * wild}
    given = {f"wheel.{w}.v": SignalSource(column=w, unit="m/s") for w in sizes}
    found = mapped({w: size * WAVE for w, size in sizes.items()}, given, machine)
    assert len(found.questions) == 4
    assert all('unit = "mm/s"' in q for q in found.questions)
    assert all("max_speed = 490 if" in q for q in found.questions)
