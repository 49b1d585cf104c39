"""Verdicts on ordinary robots that share nothing with the project's simulator; `python tests/benchmarks/ordinary.py --seeds reporting`.

Differential, skid, rocker, Ackermann and mecanum robots, tricycles and cars of random size, motors and encoders drive random missions (slip,
slopes, kerbs, payload, pauses, emergency stops) and record /joint_states, /cmd_vel, /imu/data, and mostly /odom, as MCAP or rosbag2;
--habits are those of `ordinary_robots/habits.py`. The
machine file is the one that `mfhca config init --log` writes, unedited, from the same log. What is printed:

1. healthy missions: parts named although nothing was wrong, verdicts, and the share of driving in which sensors were judged;
2. missions with one fault: whether its time was named at all (found), by the right wheel, and by the right side of it (either of the two
   is a right side too where the finding leaves it open); findings with p ≥ .9 or of high severity that are wrong; missions cleared
   although the fault was not named; how much of the faulty driving its side was called healthy.

An ignored command, an emergency stop, and a fault of gyro or odometry are no wheel's: none may be named.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: more threads only wait for each other

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from ordinary_robots.faults import FAULTS, Fault, fault_of
from ordinary_robots.habits import HABITS, Habits
from ordinary_robots.log import write_log
from ordinary_robots.machines import KINDS, H, Robot, course_of, robot_of
from ordinary_robots.physics import drive

from diagnosis.pipeline import diagnose
from diagnosis.results.document import IntervalRow, ReportDocument
from diagnosis.results.result import MissionResult
from replay.machine.toml_file import load_machine
from replay.setup.draft import draft_machine
from replay.setup.machine_text import machine_text
from replay.setup.read import read_everything

FIRST = {"tuning": 100, "reporting": 2000}
_SLACK_S = 1.5
_SHOWS_S = 1.0


@dataclass(frozen=True)
class Case:
    """A mission and what was said of it."""

    robot: Robot
    fault: Fault | None
    result: MissionResult
    names: dict[str, str]

    @property
    def report(self) -> ReportDocument:
        """Its result document."""
        return self.result.report

    @property
    def told(self) -> list[IntervalRow]:
        """Faults worth a word."""
        return [i for i in self.report["intervals"] if i["severity"] != "info"]

    def right(self, i: IntervalRow, *, side: bool = True) -> bool:
        """Whether a finding names the faulty wheel, and its side."""
        if self.fault is None or self.fault.side == "machine" or not self.meets(i):
            return False
        same = self.names.get(self.robot.wheels[self.fault.wheel].joint) == i["component"]
        return same and (not side or str(i["side"]) in (self.fault.side, "sensor_or_actuator"))

    def meets(self, i: IntervalRow) -> bool:
        """Whether a finding is at the time of the fault."""
        f = self.fault
        return f is not None and i["start_s"] < f.last * H + _SLACK_S and i["stop_s"] > f.first * H - _SLACK_S


def case(kind: str, fault_kind: str, seed: int, folder: Path, habits: str = "usual") -> Case:
    """Drive, write, set up and diagnose one mission."""
    rng = np.random.default_rng([seed, KINDS.index(kind), (FAULTS.index(fault_kind) + 1) if fault_kind else 0])
    robot = robot_of(kind, rng)
    course = course_of(robot, float(rng.uniform(90.0, 150.0)), rng)
    fault = None
    if fault_kind:
        moving = (np.abs(course.v) > 0.2 * robot.top) & ~course.silent & ~course.stop
        fault = fault_of(fault_kind, len(robot.wheels), moving, H, rng)
    driven = drive(robot, course, fault, rng)
    path = folder / (f"{kind}.mcap" if rng.random() < 0.7 else kind)
    write_log(path, robot, course, driven, fault, rng, Habits(habits, seed))
    text = machine_text(draft_machine(read_everything([path], every=False)), path.name)
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    machine = load_machine(folder / "machine.toml")
    result = diagnose([path], machine)
    names = {
        w.joint: name.split(".")[1]
        for w in robot.wheels
        for name, source in machine.signals.items()
        if name.endswith(".v") and w.joint in source.label
    }
    return Case(robot, fault, result, names)


def healthy_score(c: Case) -> Counter[str]:
    """What was said of a healthy mission."""
    driving = [(x["decided_driving_s"], x["driving_s"]) for x in c.report["coverage"] if x["side"] == "sensor"]
    return Counter(
        {
            "missions": 1,
            "alarms": len(c.told),
            "with alarm": bool(c.told),
            f"verdict {c.report['verdict']['status']}": 1,
            "decided": sum(x[0] for x in driving),
            "driving": sum(x[1] for x in driving),
        }
    )


def fault_score(c: Case) -> Counter[str]:
    """What was said of a faulty mission."""
    f = c.fault
    assert f is not None
    hits = [i for i in c.told if c.meets(i)]
    wrong = [i for i in c.told if not c.right(i)]
    event = f.side == "machine"
    out = Counter(
        missions=1,
        found=bool(hits) and not event,
        wheel=any(c.right(i, side=False) for i in c.told),
        part=any(c.right(i) for i in c.told),
        sure=sum(i["probability"] >= 0.9 or i["severity"] == "high" for i in c.told),
        sure_wrong=sum(i["probability"] >= 0.9 or i["severity"] == "high" for i in wrong),
        high=sum(i["severity"] == "high" for i in c.told),
        high_wrong=sum(i["severity"] == "high" for i in wrong),
        beside=sum(not c.right(i, side=False) for i in c.told),
        cleared=c.report["verdict"]["cleared"] and not event and not any(c.right(i, side=False) for i in c.told),
    )
    if not event:
        part = c.names.get(c.robot.wheels[f.wheel].joint)
        for s in c.report["states"]:
            if s["component"] == part and s["side"] == f.side:
                both = min(s["stop_s"], f.last * H) - max(s["start_s"], f.first * H)
                if both > 0.0 and s["state"] != "not_excited":
                    out["faulty_s"] += both
                    out["healthy_s"] += both * (s["state"] == "healthy")
    return out


def _shown(name: str, s: Counter[str]) -> str:
    clear = 100 * s["healthy_s"] / max(s["faulty_s"], 1e-9)
    return (
        f"{name:<16} missions {s['missions']:3d}, found {s['found']:3d}, wheel {s['wheel']:3d}, part {s['part']:3d}; sure {s['sure']:3d}, wrong "
        f"{s['sure_wrong']:2d}; high {s['high']:3d}, wrong {s['high_wrong']:2d}; beside {s['beside']:2d}; cleared {s['cleared']:2d}; called healthy {clear:4.0f} %"
    )


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", choices=FIRST, default="tuning")
    parser.add_argument("--first", type=int, help="first seed, instead of that of --seeds")
    parser.add_argument("--healthy", type=int, default=13, help="healthy missions of each kind of robot")
    parser.add_argument("--faulty", type=int, default=3, help="missions of each kind of robot and fault")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--faults", nargs="*", choices=FAULTS, default=FAULTS)
    parser.add_argument("--habits", choices=HABITS, default="usual", help="of the recorder")
    parser.add_argument(
        "--detail", action="store_true", help="one line for each mission with something wrong in what was said"
    )
    args = parser.parse_args()
    first = FIRST[args.seeds] if args.first is None else args.first
    by: dict[str, Counter[str]] = defaultdict(Counter)
    for kind in args.kinds:
        for seed in range(first, first + args.healthy):
            with tempfile.TemporaryDirectory() as folder:
                c = case(kind, "", seed, Path(folder), args.habits)
            by[kind] += healthy_score(c)
            if args.detail:
                _detail(c, seed)
        s = by[kind]
        verdicts = ", ".join(f"{k.split()[1]} {n}" for k, n in s.items() if k.startswith("verdict"))
        print(
            f"{kind:<16} healthy missions {s['missions']}, parts named {s['alarms']} in {s['with alarm']}; {verdicts}; sensors judged in "
            f"{100 * s['decided'] / max(s['driving'], 1e-9):.0f} % of driving",
            flush=True,
        )
    faults: dict[str, Counter[str]] = defaultdict(Counter)
    for fault_kind in args.faults if args.faulty else ():
        for kind in args.kinds:
            for seed in range(first, first + args.faulty):
                with tempfile.TemporaryDirectory() as folder:
                    c = case(kind, fault_kind, seed, Path(folder), args.habits)
                score = fault_score(c)
                for name in (fault_kind, kind, c.fault.side if c.fault else "", "together"):
                    faults[name] += score
                if args.detail:
                    _detail(c, seed)
        print(_shown(fault_kind, faults[fault_kind]), flush=True)
    for name in (*args.kinds, "sensor", "actuator", "machine", "together") if args.faulty else ():
        print(_shown(name, faults[name]))


def _detail(c: Case, seed: int) -> None:
    """One line of what was said."""
    r, f = c.robot, c.fault
    wheel = "" if f is None else c.names.get(r.wheels[f.wheel].joint, "?")
    head = (
        "healthy"
        if f is None
        else f"{f.kind} {wheel} {f.first * H:.1f}–{f.last * H:.1f} s, {f.size:.2f}{' counted' if f.counted else ''}"
    )
    shape = f"{r.rate:.0f} Hz{' closed' if r.closed else ''}{' positions' if r.positions else ''}{' efforts' if r.efforts else ''} odometry {r.odometry}"
    said = "; ".join(
        f"{i['component']} {i['side']} {i['mode']} {i['start_s']:.1f}–{i['stop_s']:.1f} p {i['probability']:.2f} {i['severity']}"
        f"{'' if c.right(i) else ' ✗'}"
        for i in c.told
    )
    print(
        f"  [{seed} {r.kind}, {shape}] {head}: {c.report['verdict']['status']}, {c.report['verdict']['title']}: {said or 'nothing'}",
        flush=True,
    )


if __name__ == "__main__":
    main()
