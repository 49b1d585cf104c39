"""Machine files and ``mission.toml``: other values, keys, nesting and texts."""

from __future__ import annotations

import random
from pathlib import Path

from diagnosis.audit.discovery.discover import discover
from replay.border import UnforeseenValue
from replay.errors import ConfigError
from replay.machine.toml_file import load_machine
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.damage import FAR, blindly, reworded

VALUES = (*map(str, FAR), "-1", "1e400", "nan", "-inf", "true", '""', "'x'", '"\\u0000"', '"\\ud800"', '"""\n"""', "[]", "{}", "[[]]", "[1, 'a']", "{ a = 1 }",
          "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "0x" + "f" * 90, "9" * 5000, "0o7", "1_0", "[" * 40, "[" * 5000, "{a=" * 40, '"x" * 3', "0.1.2",
          '"http://a/b"', '"../../etc/passwd"', '"/etc/passwd"', '["../x.csv"]', '["a\\u0000b"]', "[" + "1," * 30000 + "]", '"' + "x" * 3000 + '"',
          '"-"', '"*"', '"m/s"', '"km/h/s/s"', '"rad/rad/rad"', '["FR", "FR"]', '[""]', '["a.b"]', '["x", "y", "z"]', "1e-300", "-0.0")  # fmt: skip
KEYS = ("a", '""', '"é"', "a.b.c", ".".join("a" * 60), "machine", "[machine]", "[[machine]]", "[plant.FR]", '[signals."x"]', "[a" + ".a" * 40 + "]",
        "[geometry.FR]", "[drive.FR]", "[steering.front]", "[noise.x]", "[sources.'*.csv']", '["'  # an open key
        )  # fmt: skip
MACHINE = """
[machine]
name = "Boom lift"
id = "HX4-07"
wheels = ["FR", "FL", "RR", "RL"]
[geometry]
wheelbase = 2.1
joint_spacing = 1.46
wheel_offset = 0.2
wheel_diameter = 0.854
gear_ratio = 40.0
max_speed = 1.8
max_steer = 0.5
[control]
lambda = 2.5
xi = 0.1
[plant]
coupling = "auto"
[plant.FR]
K = 1.8
tau = 0.3
openings = [-1.0, -0.1, 0.1, 1.0]
speeds = [-1.5, 0.0, 0.0, 1.5]
hysteresis = 0.01
[noise."wheel.FR.v"]
std = 0.01
[steering.front]
slope_up = 0.5
slope_down = 0.5
dead_up = 0.05
dead_down = 0.05
lag = 0.1
play = 0.001
[drive.FR.effort]
offset = 1.0
slope = 2.0
between = 0.1
drift = 0.1
noise = 0.1
slowest = 0.1
fastest = 1.5
[limits]
brief = 1.0
clear_at = 0.25
[sources."plc.csv"]
time = "t"
time_unit = "ms"
clock_offset = 0.5
[signals."wheel.FR.v"]
topic = "/joint_states"
field = "velocity[fr]"
unit = "rpm"
at = "motor"
[signals."wheel.FL.v"]
column = "v_fl"
unit = "km/h"
"""
OWN = """
[machine]
wheels = ["L", "R"]
[geometry]
wheel_diameter = 0.3
[geometry.L]
x = 0.0
y = 0.3
steer = "fixed"
[geometry.R]
x = 0.0
y = -0.3
offset = 0.0
steer = "own"
"""
MISSION = 'name = "run 7"\nmachine_id = "HX4-07"\nmachine = "machine.toml"\nfiles = ["a.csv", "b.csv"]\n'


class Toml:
    """Machine files as the commands read them, and missions as an audit finds them."""

    name = "toml"

    def corpus(self, folder: Path) -> list[Sample]:
        """Two machine files and a mission's folder."""
        files = {
            "m/a.csv": b"t,v\n0,1\n1,2\n",
            "m/b.csv": b"t,w\n0,1\n1,2\n",
            "m/machine.toml": MACHINE.encode(),
            "m/mission.toml": MISSION.encode(),
        }
        return [
            *(Sample(name, {"m.toml": text.encode()}, "m.toml", "m.toml") for name, text in (("machine", MACHINE), ("own wheels", OWN))),
            Sample("mission", files, "m", "m/mission.toml"),
        ]  # fmt: skip

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Other lines, or blind damage."""
        if source.random() < 0.15:
            return Case(*reworded(sample.raw, source))
        if source.random() < 0.2:
            return Case(*blindly(sample.raw, source))
        lines, done = sample.raw.decode().splitlines(), []
        for _ in range(source.choice((1, 1, 2, 3))):
            k = source.randrange(len(lines))
            key, sign, _ = lines[k].partition(" = ")
            way = source.random()
            if way < 0.6 and sign:
                lines[k] = f"{key} = {source.choice(VALUES)}"
            elif way < 0.7:
                lines[k] = f"{source.choice(KEYS)}{sign or ''}{source.choice(VALUES) if sign else ''}"
            elif way < 0.8:
                lines.insert(k, source.choice(lines))
            elif way < 0.9 and len(lines) > 1:
                lines.pop(k)
            else:
                lines.insert(k, f"{source.choice(KEYS)} = {source.choice(VALUES)}")
            done.append(f"line {k}: {lines[min(k, len(lines) - 1)][:40]}")
        return Case("\n".join(lines).encode(), "; ".join(done))

    def read(self, path: Path, source: random.Random) -> Reading:
        """Load a machine; find a mission."""
        if path.is_dir():
            found = discover([str(path)])
            inside = str(path.resolve())
            for mission in found.missions:
                for file in mission.files:
                    if "://" in str(file) or not str(Path(str(file)).resolve()).startswith(inside):
                        raise Finding("shape", f"a mission leads out of its folder: {file}")
            return Reading("refused" if found.problems else "whole", found, found.problems)
        try:
            return Reading("whole", load_machine(path))
        except UnforeseenValue as error:
            raise Finding("foreign", str(error)) from error
        except ConfigError as error:
            text = str(error)
            if path.name not in text or len(text) > 4000:
                raise Finding("shape", f"a message that names no file, or is long: {text[:300]!r}") from error
            return Reading("refused", None, (text,))

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """Nothing to compare with."""
