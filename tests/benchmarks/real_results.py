"""Results of all real logs of the reference data, as they are and with faults written into some; for `contradictions.py`."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import robot_arm
import robots
import rosa

from diagnosis.pipeline import diagnose, diagnose_mission
from diagnosis.results.result import MissionResult
from replay.errors import MfhcaError
from replay.machine.config import Machine, haulotte
from replay.machine.toml_file import load_machine
from replay.mission import load_mission
from replay.setup.draft import draft_machine
from replay.setup.machine_text import machine_text
from replay.setup.read import read_everything

Named = tuple[str, MissionResult]
_CAR = ("commandData", "coreData", "imuData", "odomData")


def real(count: int, first: int) -> Iterator[Named]:
    """Robots as they are and with faults, the disabled one, a car, arms, motor rigs, and public logs with the files that setup writes for them."""
    yield from _robots(count, first)
    folder = robots.data_folder()
    disabled = load_machine(folder / "robots/warthog_disabled.toml")
    yield "disabled warthog", diagnose([folder / "robots/warthog_disabled.csv"], disabled)
    car = folder / "robots/f1tenth"
    yield from _unless_refused("car", [car / f"{name}.csv" for name in _CAR], load_machine(car / "machine.toml"))
    raw = folder / "robot_arm_raw"
    arms = [(load_machine(raw / "machine.toml"), path) for path in sorted(raw.glob("*.csv"))[: 10 * count]]
    arms += [(robot_arm.arm(), path) for path in sorted(robot_arm.data_folder().glob("*.csv"))[::4][: 3 * count]]
    for machine, path in arms:
        yield f"arm {path.stem}", diagnose([path], machine)
    bare, fitted = rosa.rig(), replace(rosa.rig(), drives={"M": rosa.fit(rosa.rig())})
    for kind in rosa.FOLDERS:
        for path in rosa.files_of(kind, "reporting")[:count]:
            for words, machine in (("", bare), (" with a model", fitted)):
                yield f"rig {kind} {path.name}{words}", diagnose([path], machine)
    yield from public()


def _robots(count: int, first: int) -> Iterator[Named]:
    folder = robots.data_folder()
    for name in ("husky_bag", "warthog_bag"):
        machine = load_machine(folder / f"robots/{name}.toml")
        mission = load_mission([folder / "robots" / name], machine)
        yield name, diagnose_mission(mission, machine)
        rng, t = np.random.default_rng(first), mission.timeline
        for k in range(2 * count):
            wheel, kind = machine.wheels[rng.integers(len(machine.wheels))], robots.KINDS[k % len(robots.KINDS)]
            start = rng.uniform(15.0, t.size * t.dt - 20.0)
            part = slice(int(start / t.dt), int((start + robots.SPELL_S) / t.dt))
            speed = robots.injected(t.signals[f"wheel.{wheel}.v"], kind, part, robots.RADIUS[name], rng)
            changed = replace(mission, timeline=replace(t, signals={**t.signals, f"wheel.{wheel}.v": speed}))
            yield f"{name} {wheel} {kind} {start:.0f} s", diagnose_mission(changed, machine)


def public() -> Iterator[Named]:
    """Public logs, whatever they hold, each with the paper's machine and with the file that setup writes for it."""
    base = robots.data_folder().parent / "reference_logs"
    if not base.is_dir():
        return
    logs = [*sorted(base.rglob("*.bag")), *sorted({p.parent for p in base.rglob("metadata.yaml")})]
    logs += [base / "abitobot"]
    for log in logs:
        name = str(log.relative_to(base))
        for words, machine in (("the paper's machine", haulotte()), ("setup", _set_up(log))):
            if machine is not None:
                yield from _unless_refused(f"{name} with {words}", [log], machine)


def _unless_refused(name: str, logs: Sequence[Path], machine: Machine) -> Iterator[Named]:
    """The result of a log; none where it is refused with a reason, as those are that hold no wheel."""
    with suppress(MfhcaError):
        yield name, diagnose(logs, machine)


def _set_up(log: Path) -> Machine | None:
    """The machine that setup writes for a log; None where it refuses to."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        try:
            path.write_text(
                machine_text(draft_machine(read_everything([log], every=False)), log.name), encoding="utf-8"
            )
            return load_machine(path)
        except MfhcaError:
            return None
