"""What users do with a log of strangers: list it, find its signals, draft a machine file from it, diagnose it.

The files are sound; names, units, descriptions of robots and values are not.
"""

from __future__ import annotations

import random
import tempfile
from pathlib import Path

import numpy as np

from diagnosis.pipeline import diagnose
from replay.border import UnforeseenContent, UnforeseenValue
from replay.errors import MfhcaError
from replay.inspection.inspect_log import inspect_index, inspect_log
from replay.log.source_options import SourceOptions
from replay.machine.config import Machine, haulotte
from replay.machine.toml_file import load_machine
from replay.mission import read_signals
from replay.setup.all_channels import channel_rows
from replay.setup.draft import draft_machine, structure_of
from replay.setup.machine_text import machine_text
from replay.setup.read import read_everything
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.damage import blindly, reworded
from tests.ros_robots import WHEELS, Robot, urdf, write_robot

SECONDS, RATE = 20, 20
WORDS = ("wheel", "fl", "FR", "left", "rear", "vorne", "Rad", "roue", "motor", "speed", "velocity", "cmd", "soll", "ist", "Geschwindigkeit", "steer", "angle",
         "Lenkwinkel", "valve", "current", "effort", "pos", "t", "time", "1", "2", "_", ".", "[rpm]", "(km/h)", "[°/s]", "[", "]", "/", "é", "\x1b[31m", "<b>", '"', "'",
         "\\", "x" * 300, "a." * 200, "((((" * 50, "=", "#", "{wheel}", "{", "%s", "\u202e", "\u0130", "ß")  # fmt: skip
VALUES = (
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-300,
    5e-324,
    1e300,
    -1e300,
    1.7e308,
    float("nan"),
    float("inf"),
    float("-inf"),
    3.4e38,
    1e9,
)
SIGNALS = ("t", *(f"wheel.{w}.{k}" for w in ("FR", "FL", "RR", "RL") for k in ("v", "v_ref", "u", "spool", "v2")), "steer.front.phi", "steer.front.u", "steer.front.phi_ref",
           "cmd.v", "cmd.omega", "imu.omega", "gnss.v")  # fmt: skip


class FirstLook:
    """A ROS robot and a table of wheels."""

    name = "first-look"

    def corpus(self, folder: Path) -> list[Sample]:
        """Both sound."""
        robot = folder / "robot.mcap"
        write_robot(robot, Robot(description=urdf()), float(SECONDS))
        columns = _columns(np.random.default_rng(1))
        facts = {"columns": columns}
        return [
            Sample("robot", {"log.mcap": robot.read_bytes()}, "log.mcap", "log.mcap"),
            Sample("table", {"log.csv": _table(columns)}, "log.csv", "log.csv", facts),
            Sample("signals", {"log.csv": _table(columns)}, "log.csv", "log.csv", facts),
        ]

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Other names and descriptions, or other values."""
        if sample.name == "robot":
            return _robot(source)
        columns = {name: values.copy() for name, values in sample.facts["columns"].items()}
        done = [_values(columns, source) for _ in range(source.choice((1, 1, 2, 5)))]
        if sample.name == "table":
            names = source.sample(list(columns), source.choice((1, 3, len(columns))))
            columns = {(_name(source) if k in names and k != "t" else k): v for k, v in columns.items()}
            done.append("names")
        return Case(_table(columns), "; ".join(done))

    def read(self, path: Path, source: random.Random) -> Reading:
        """One of the commands."""
        machine, way = haulotte(), source.random()
        try:
            if way < 0.15:
                return Reading("whole", (inspect_index(path, SourceOptions()), inspect_log(path, SourceOptions())))
            if way < 0.35:
                return Reading("whole", read_signals([path], machine))
            if way < 0.7:
                return Reading("whole", _drafted(path))
            return Reading("whole", diagnose([path], machine).report)
        except (UnforeseenContent, UnforeseenValue) as error:
            raise Finding("foreign", str(error)) from error
        except MfhcaError as error:
            text = str(error)
            if len(text) > 2500 or "\x1b" in text:
                raise Finding("shape", f"a message that is long or has control characters: {text[:300]!r}") from error
            return Reading("refused", None, (text,))

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """Nothing to compare with."""


def _drafted(path: Path) -> Machine:
    """A machine file as `mfhca config init --log` writes it, read back."""
    every = read_everything([path])
    channel_rows(every, structure_of(every).machine())
    logs = read_everything([path], every=False)
    draft = draft_machine(logs, None)
    text = machine_text(draft, path.name, channel_rows(logs, draft.machine))
    with tempfile.TemporaryDirectory() as folder:
        (file := Path(folder) / "machine.toml").write_text(text, encoding="utf-8")
        try:
            return load_machine(file)
        except MfhcaError as error:
            raise Finding("shape", f"the drafted machine file cannot be read: {error}") from error


def _name(source: random.Random) -> str:
    return "".join(
        source.choice(WORDS) + source.choice(("", "_", " ", ".")) for _ in range(source.choice((1, 2, 3, 5)))
    )


def _columns(rng: np.random.Generator) -> dict[str, np.ndarray]:
    count = SECONDS * RATE
    speeds = np.repeat(rng.uniform(-0.3, 0.3, count // 40), 40)
    columns = {"t": np.arange(count) / RATE}
    for k, name in enumerate(SIGNALS[1:]):
        columns[name] = speeds * (1 + k % 3 * 0.1) + rng.normal(0, 0.003, count)
    return columns


def _table(columns: dict[str, np.ndarray]) -> bytes:
    head = ",".join('"' + name.replace('"', '""') + '"' for name in columns)
    rows = (
        ",".join("" if v != v else repr(v) for v in row) for row in np.column_stack(list(columns.values())).tolist()
    )
    return "\n".join([head, *rows, ""]).encode("utf-8", "replace")


def _values(columns: dict[str, np.ndarray], source: random.Random) -> str:
    """Change the values of a column."""
    name = source.choice(list(columns))
    values, way = columns[name], source.randrange(9)
    a, b = sorted(source.choices(range(len(values) + 1), k=2))
    value = source.choice(VALUES)
    with np.errstate(all="ignore"):
        if way == 0:
            values[a:b] = value
        elif way == 1:
            values[:] = value
        elif way == 2:
            values[a : a + 1] = value
        elif way == 3:
            values *= value
        elif way == 4:
            values += value
        elif way == 5:
            values[a:b] = values[a] if a < b else 0.0
        elif way == 6:
            columns.pop(name)
        elif way == 7:
            values[:] = np.round(values / 10.0 ** source.choice((-3, 0, 2))) * 10.0 ** source.choice((-3, 0, 300))
        else:
            for key in columns:
                columns[key] = (
                    columns[key][: source.choice((0, 1, 2, 3, b))] if source.random() < 0.02 else columns[key]
                )
            size = min(map(len, columns.values()))
            columns.update({key: v[:size] for key, v in columns.items()})
    return f"{name}: {way}"


def _robot(source: random.Random) -> Case:
    """A short drive with other joints and another description."""
    wheels = dict(WHEELS)
    if source.random() < 0.5:
        wheels = {
            _name(source): (source.choice(VALUES), source.choice(VALUES)) for _ in range(source.choice((0, 1, 2, 4, 9)))
        }
    text = urdf(wheels if source.random() < 0.7 else WHEELS, tuple(source.sample(list(wheels), len(wheels) // 2)))
    way = source.random()
    if way < 0.4:
        text = source.choice((blindly, reworded))(text.encode(), source)[0].decode(errors="replace")
    elif way < 0.6:
        text = text.replace('<robot name="lorry">', source.choice(_DESCRIPTIONS))
    elif way < 0.8:
        for old, new in (("0.56", "0.28"), (str(0.165), source.choice(("nan", "inf", "-1", "1e308", "", "0", "x"))), ("continuous", source.choice(("revolute", "fixed", ""))), ("base_link", source.choice(("base_link", "wheel", "")))):  # fmt: skip
            if source.random() < 0.5:
                text = text.replace(old, new)
    robot = Robot(
        wheels=wheels, description=text.replace("\x00", ""), commands=source.random() < 0.8, imu=source.random() < 0.8
    )
    with tempfile.TemporaryDirectory() as folder, np.errstate(all="ignore"):
        write_robot(path := Path(folder) / "log.mcap", robot, source.choice((0.05, 0.5, 5.0)), source.randrange(99))
        return Case(path.read_bytes(), f"robot of {list(wheels)}"[:200])


_DESCRIPTIONS = (
    '<robot name="' + "x" * 5000 + '">', "<robot>" + "<a>" * 20_000, '<?xml version="1.0" encoding="utf-16"?><robot>', '<?xml version="1.0" encoding="nonsense"?><robot>',
    "<!DOCTYPE a SYSTEM 'file:///etc/passwd'><robot>", "<robot>" + "<link/>" * 50_000, '<robot name="\x1b[31m">', '<robot xmlns="http://a/b">', "<robot>" + "<joint><parent/><child/></joint>" * 3000,
    "".join(["<robot>", *(f'<joint name="wheel{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/></joint>' for k in range(600))]),
    '<robot><joint name="wheel" type="continuous"><parent link="a"/><child link="a"/></joint>', '<robot><joint name="wheel" type="continuous"><parent link="a"/><child link="b"/></joint><joint name="w" type="revolute"><parent link="b"/><child link="a"/></joint>',
)  # fmt: skip
