"""Machine files: what is written is read back, and every mistake is named with its key, value and range."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from replay.errors import ConfigError
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.config import Control, Limits, Machine, Noise, Plant, WheelPlant, haulotte
from replay.machine.geometry import Geometry, WheelGeometry, own_axle
from replay.machine.toml_file import load_machine
from replay.machine.toml_text import dump_machine

SETTINGS = settings(max_examples=60, deadline=None)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("machines")


def load(folder: Path, text: str) -> Machine:
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return load_machine(path)


def test_empty_file_is_the_papers_machine(folder: Path) -> None:
    assert load(folder, "") == haulotte()


def test_papers_machine_round_trip(folder: Path) -> None:
    assert load(folder, dump_machine(haulotte())) == haulotte()


def test_everything_given_round_trip(folder: Path) -> None:
    machine = Machine(
        name="six wheels",
        id="HX4-07",
        wheels=("L1", "L2", "L3", "R1", "R2", "R3"),
        geometry=Geometry(
            {
                "L1": WheelGeometry(2.0, 0.9, 0.1, "front"),
                "L2": WheelGeometry(0.0, 0.9, 0.0, "fixed"),
                "L3": WheelGeometry(-2.0, 0.9, 0.1, "L3_steer"),
                "R1": WheelGeometry(2.0, -0.9, -0.1, "front"),
                "R2": WheelGeometry(0.0, -0.9, 0.0, "fixed"),
                "R3": WheelGeometry(-2.0, -0.9, -0.1, "rear"),
            },
            1.25,
        ),
        gear_ratio=20.5,
        max_speed=2.5,
        max_steer=0.6,
        control=Control(law="printed", psi="event_reset", lambda_=2.5, psi0=0.25, phi_dot="measured", u_max=100.0),
        plant=Plant(
            coupling="free",
            flow=8.0,
            wheels={
                "L1": WheelPlant(2.4, 0.25, 0.01, 0.1, 0.02, 0.003),
                "L2": WheelPlant(
                    2.4,
                    0.2,
                    openings=(-1.0, -0.03, 0.025, 1.0),
                    speeds=(-1.9, 0.0, 0.0, 2.3),
                    unseen=(-0.4, 0.0, 0.0, 0.3),
                    hysteresis=0.02,
                    grip=2.5,
                    wander=0.012,
                ),
                "L3": WheelPlant(2.4, 0.2, openings=(-1.0, 1.0), speeds=(-2.0, 2.0), grip=0.0),
            },
        ),
        noise={"wheel.L1.v": Noise(std=0.004, lsb=0.0015), "wheel.R1.u": Noise(std=0.001)},
        limits=Limits(brief=2.0, min_probability=0.95, min_epsilon=0.2, min_sat=0.1, min_assessed=3.0),
        sources={"*.csv": SourceOptions(time="t", time_unit="ms", epoch="2025-01-01", separator=";", scale=True)},
        signals={
            "cmd.v": SignalSource(topic="/cmd_vel", field="twist.linear.x", unit="m/s"),
            "wheel.L1.u": SignalSource(symbol="MAIN.fbWheel[1].fValve", unit="%", gain=-1.0, offset=0.5),
            "wheel.L1.v": SignalSource(column="v 1", unit="rpm", at="motor", source="a.csv", derivative=True),
        },
    )
    assert load(folder, dump_machine(machine)) == machine


def test_one_wheel_without_geometry_round_trip(folder: Path) -> None:
    machine = load(folder, '[machine]\nname = "rig"\nwheels = ["M1"]\n[control]\nlaw = "none"\n')
    assert machine.geometry is None
    assert machine.plant.flow is None
    assert load(folder, dump_machine(machine)) == machine


def test_constants_as_a_fit_computes_them_round_trip(folder: Path) -> None:
    plant = Plant(wheels={"A": WheelPlant(K=np.float64(2.4), tau=np.float64(0.25), K_std=np.float64(1e-5))})
    machine = Machine(name="m", id="", wheels=("A",), geometry=None, plant=plant)
    assert load(folder, dump_machine(machine)) == machine


NAMES = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="."), min_size=1, max_size=8).filter(
    lambda name: name not in ("coupling", "flow", "wheel_diameter", "front", "rear", "fixed")
)
NUMBERS = st.floats(-2.0, 2.0).map(lambda x: x + 0.0)


@st.composite
def machines(draw: st.DrawFn) -> Machine:
    wheels = tuple(draw(st.lists(NAMES, min_size=1, max_size=6, unique=True)))
    places = None
    if draw(st.booleans()):
        places = Geometry(
            {
                w: WheelGeometry(
                    draw(NUMBERS),
                    draw(NUMBERS),
                    draw(NUMBERS),
                    draw(st.sampled_from(["front", "rear", "fixed", own_axle(w)])),
                )
                for w in wheels
            },
            draw(st.floats(0.02, 5.0)),
        )
    plants = {w: WheelPlant(draw(st.floats(1e-9, 1e3)), draw(st.floats(1e-4, 60.0))) for w in wheels[:2]}
    return Machine(
        name=draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=12)),
        id=draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=12)),
        wheels=wheels,
        geometry=places,
        gear_ratio=draw(st.floats(1e-3, 1e4)),
        plant=Plant(wheels=plants),
        limits=Limits(min_sat=draw(st.floats(0.0, 1e6)), brief=draw(st.floats(0.0, 3600.0))),
        sources={draw(NAMES): SourceOptions(time=draw(NAMES))},
        signals={f"wheel.{wheels[0]}.v": SignalSource(column=draw(NAMES), unit="m/s")},
    )


@SETTINGS
@given(machine=machines())
def test_odd_names_round_trip(folder: Path, machine: Machine) -> None:
    assert load(folder, dump_machine(machine)) == machine


def test_speeds_scale_the_limits(folder: Path) -> None:
    fast = load(folder, "[geometry]\nmax_speed = 3.6\n")
    assert fast.limits.driving_speed == pytest.approx(0.5)
    assert fast.limits.min_sat == pytest.approx(0.2)
    given_limit = load(folder, "[geometry]\nmax_speed = 3.6\n[limits]\ndriving_speed = 0.05\n")
    assert given_limit.limits.driving_speed == 0.05


def test_standard_lengths_change_the_four_wheels(folder: Path) -> None:
    machine = load(folder, "[geometry]\nwheelbase = 3.0\nwheel_offset = 0.1\n")
    assert machine.geometry is not None
    assert machine.geometry.wheels["RL"] == WheelGeometry(-1.5, 0.73, 0.1, "rear")
    assert machine.geometry.wheel_diameter == 0.854


def test_places_per_wheel(folder: Path) -> None:
    text = """
    [machine]
    wheels = ["A", "B", "C"]
    [geometry]
    wheel_diameter = 0.5
    A = { x = 1.0, y = 0, steer = "own" }
    B = { x = 0.0, y = 0.4, offset = 0.05, steer = "front" }
    C = { x = 0.0, y = -0.4 }
    [signals]
    "steer.A.phi" = { column = "a", unit = "deg" }
    "steer.A_steer.phi_ref" = { column = "b", unit = "deg" }
    """
    machine = load(folder, text)
    assert machine.geometry is not None
    assert machine.geometry.wheels["A"].axle == "A_steer"
    assert machine.geometry.wheels["C"] == WheelGeometry(0.0, -0.4, 0.0, "fixed")
    assert machine.axles == ("A_steer", "front")
    assert not {*machine.wheels} & {*machine.axles}  # a wheel and its steering are two parts
    assert [*machine.signals] == ["steer.A_steer.phi", "steer.A_steer.phi_ref"]


TWO = '[machine]\nwheels = ["A", "B"]\n'
PLACES = "[geometry]\nwheel_diameter = 0.5\nA = { x = 1.0, y = 0 }\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[geometri]\n", ["[geometri]", "geometry"]),
        ("machine = 3\n", ["machine", "3", "[machine]"]),
        ("[machine]\nwheel = []\n", ["machine.wheel ", "wheels"]),
        ('[machine]\nwheels = "FR"\n', ["machine.wheels", "'FR'", "list"]),
        ("[machine]\nwheels = []\n", ["machine.wheels", "[]"]),
        ('[machine]\nwheels = ["A", "A"]\n', ["machine.wheels", "['A', 'A']"]),
        ('[machine]\nwheels = ["F.R"]\n', ["machine.wheels", "F.R", "without dots"]),
        ("[control]\nlamda = 1\n", ["control.lamda", "lambda"]),
        ("[control]\nlambda = 0\n", ["control.lambda = 0", "s/m", "1e-06 to 10000"]),
        ('[control]\nlambda = "1"\n', ["control.lambda", "'1'", "number"]),
        ("[control]\nlambda = nan\n", ["control.lambda", "nan", "finite"]),
        ("[control]\nxi = true\n", ["control.xi", "True", "number"]),
        ("[control]\nlaw = 3\n", ["control.law", "3", "text"]),
        ('[control]\nlaw = "pid"\n', ["control.law", "'pid'", "signed"]),
        ("[plant]\nX = { K = 1.0, tau = 0.1 }\n", ["plant.X", "FR"]),
        ("[plant]\nFR = 3\n", ["plant.FR", "section"]),
        ('[plant]\ncoupling = "glue"\n', ["plant.coupling", "'glue'", "ground"]),
        ("[plant]\nflow = inf\n", ["plant.flow", "inf", "finite"]),
        ('[noise]\n"wheel.FR.v" = { sd = 1.0 }\n', ["noise.wheel.FR.v.sd", "std"]),
        ('[noise]\n"wheel.FX.v" = { std = 1.0 }\n', ["noise", "wheel.FX.v"]),
        ("[limits]\nbrief = -1\n", ["limits.brief = -1 s", "0 to 3600 s"]),
        ("[limits]\nmin_probability = 1\n", ["limits.min_probability = 1", "0.5 to 0.9999"]),
        ('[sources]\n"*.csv" = { unit = "ms" }\n', ["sources.*.csv.unit", "time_unit"]),
        ('[sources]\n"*.csv" = { time_unit = "h" }\n', ["time_unit", "'h'", "ms"]),
        ('[sources]\n"*.csv" = { scale = 1 }\n', ["sources.*.csv.scale", "true or false"]),
        ('[signals]\n"cmd.v" = "speed"\n', ['signals."cmd.v"', "table"]),
        ('[signals]\n"cmd.v" = { topic = "/a" }\n', ['signals."cmd.v"', "topic with field"]),
        ('[signals]\n"cmd.v" = { column = "a", symbol = "b" }\n', ['signals."cmd.v"', "exactly one"]),
        ('[signals]\n"cmd.v" = { column = "a", at = "hub" }\n', ["cmd.v", "'hub'", "motor or wheel"]),
        ('[signals]\n"cmd.w" = { column = "a" }\n', ["cmd.w", "not a known signal"]),
        ('[signals]\n"wheel.XX.v" = { column = "a" }\n', ["wheel.XX.v", "'XX'", "FR"]),
        ("[geometry]\nwheelbase = 99\n", ["geometry.wheelbase = 99 m", "0.05 to 40 m"]),
        ("[geometry]\nwheel_diameter = 0\n", ["geometry.wheel_diameter = 0 m", "0.02 to 5 m"]),
        ("[geometry]\ngear_ratio = -1\n", ["geometry.gear_ratio = -1", "0.001"]),
        ("[geometry]\nmax_steer = 45\n", ["geometry.max_steer = 45 rad", "0 to 3.2 rad"]),
        ("[geometry]\nmax_speed = []\n", ["geometry.max_speed", "[]", "number"]),
        ("[geometry]\nmax_speed = -1\n", ["geometry.max_speed = -1"]),
        ("[geometry]\nmax_speed = 0\n", ["geometry.max_speed = 0"]),
        ("[geometry]\nwheel_base = 2\n", ["geometry.wheel_base", "wheelbase"]),
        (TWO + "[geometry]\nwheelbase = 2.0\n", ["wheelbase", "['A', 'B']", "[geometry.A]"]),
        (TWO + "[geometry]\nwheel_diameter = 0.5\n", ["wheel_diameter", "[geometry.A]"]),
        (TWO + PLACES, ["geometry", "['A']", "['A', 'B']"]),
        (TWO + PLACES + "B = { x = 1.0 }\n", ["geometry.B", "y [m] is missing"]),
        (TWO + PLACES + "B = { x = 1.0, y = 0, z = 1 }\n", ["geometry.B.z", "offset"]),
        (TWO + PLACES + 'B = { x = "far", y = 0 }\n', ["geometry.B.x", "'far'", "number"]),
        (TWO + PLACES + 'B = { x = 1, y = 0, steer = "left" }\n', ["geometry.B.steer", "'left'", "own"]),
        (TWO + PLACES + "C = { x = 1, y = 0 }\n", ["geometry.C", "'C'", "['A', 'B']"]),
        (TWO + "[geometry]\nA = { x = 1, y = 0 }\nB = { x = 0, y = 0 }\n", ["geometry.wheel_diameter", "missing"]),
        (TWO + PLACES + "wheelbase = 2.0\n", ["geometry.wheelbase", "[geometry.A]"]),
        ("[machine\n", ["not valid TOML", "line 1"]),
    ],
)
def test_mistake_is_named(folder: Path, text: str, words: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        load(folder, text)
    message = str(caught.value)
    assert message.startswith(str(folder / "machine.toml"))
    assert [w for w in words if w not in message] == []
    assert "\n" not in message


def test_unreadable_files(folder: Path) -> None:
    with pytest.raises(ConfigError, match=r"absent\.toml: cannot read"):
        load_machine(folder / "absent.toml")
    (folder / "latin.toml").write_bytes(b'[machine]\nname = "H\xe4nsel"\n')
    with pytest.raises(ConfigError, match=r"latin\.toml: byte 19 is not UTF-8"):
        load_machine(folder / "latin.toml")


def test_maps_of_valves_are_lists_of_numbers(folder: Path) -> None:
    machine = load(
        folder,
        "[plant]\nFR = { K = 2, tau = 0.2, openings = [-1, 0, 1], speeds = [-2, 0, 2.5], unseen = [-0.5, 0, 0.4] }",
    )
    plant = machine.plant.wheels["FR"]
    assert (plant.openings, plant.speeds, plant.unseen) == ((-1.0, 0.0, 1.0), (-2.0, 0.0, 2.5), (-0.5, 0.0, 0.4))
    assert (plant.hysteresis, plant.grip, plant.wander) == (0.0, None, None)
    for wrong, words in (
        ("openings = 0.5", "plant.FR.openings = 0.5 must be a list of numbers"),
        ('openings = [0.0, "1"]', "plant.FR.openings = '1' must be a finite number"),
        ("openings = [0.0, nan]", "plant.FR.openings = nan must be a finite number"),
        ("openings = [0.0, 1.0], speeds = [0.0]", "plant.openings, speeds and unseen have 2, 1 and 0 values"),
        ("opening = [0.0, 1.0]", "plant.FR.opening is not a known key"),
    ):
        with pytest.raises(ConfigError) as raised:
            load(folder, f"[plant]\nFR = {{ K = 2, tau = 0.2, {wrong} }}")
        assert words in str(raised.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[machine]\nwheels = []\n[geometry]\nwheelbase = 2.0\n", "at least one"),
        ("[plant.FR]\ntau = 0.3\n", "plant.FR.K is missing"),
        ("[plant.FR]\n", "plant.FR.K is missing"),
        ("[steering.front]\nslope_up = 1.0\n", "steering.front.slope_down is missing"),
    ],
)
def test_what_is_left_out_is_named(folder: Path, text: str, words: str) -> None:
    (folder / "part.toml").write_text(text)
    with pytest.raises(ConfigError, match=words):
        load_machine(folder / "part.toml")


@pytest.mark.parametrize(
    ("key", "words"),
    [("max_stear", r"is not a known key; expected .*max_steer"), ("wheelbase", "does not go with places per wheel")],
)
def test_a_key_beside_places_per_wheel_is_unknown_or_does_not_go_with_them(folder: Path, key: str, words: str) -> None:
    with pytest.raises(ConfigError, match=rf"geometry\.{key} {words}"):
        load(folder, f"[geometry]\n{key} = 0.6\nFR = {{ x = 1.0, y = -0.7 }}\n")


def test_the_least_driving_speed_of_fast_machines_is_that_of_a_yard(folder: Path) -> None:
    assert load(folder, "[geometry]\nmax_speed = 3.6\n").limits.driving_speed == pytest.approx(0.5)
    assert load(folder, "[geometry]\nmax_speed = 40\n").limits.driving_speed == 2.0


def test_the_usual_four_wheels_have_their_places_in_any_order(tmp_path: Path) -> None:
    machine = load(
        tmp_path, '[machine]\nwheels = ["FL", "FR", "RL", "RR"]\n[geometry]\nwheelbase = 3.0\njoint_spacing = 1.5\n'
    )
    assert machine.geometry is not None
    assert list(machine.geometry.wheels) == ["FL", "FR", "RL", "RR"]
    assert [(w.x, w.y) for w in machine.geometry.wheels.values()] == [
        (1.5, 0.75),
        (1.5, -0.75),
        (-1.5, 0.75),
        (-1.5, -0.75),
    ]
