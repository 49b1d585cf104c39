"""All-clears that are wrong, stops that are: `python tests/benchmarks/all_clear.py --seeds reporting`.

Missions of 75 s with every kind of `troubles`, on the default machine and on one of another structure, judged with commands,
speeds and openings alone (``base``), with valve positions (``spool``) and with second speeds (``direct``), and healthy ones. A
mission is

    wrong all-clear   ready, or cleared with faults to watch of which none is on a part that fails
    named             a fault worth an action is on a part that fails; where a machine file is wrong, on any
    wrong part        of what is not named: a fault of severity high on a part that does not fail
    abstained         neither cleared nor named
    (not counted)     no part that fails was driven, or steered, for three seconds of its fault; of one that fades, from where
                      it has lost what counts; of a recorded channel that is changed, where it is off by what counts

Tune on ``--seeds tuning``; the structures of ``reporting`` are others.
"""

from __future__ import annotations

import argparse
import json
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from types import ModuleType

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import closed_circuit
import dumper
import electric
import electrohydraulic
import flow_sharing
import forwarder
import geared_circuit
import harvester
import hydrostatic
import loader
import numpy as np
import paver
import sprayer
import telehandler
import transporter
import tug
from accuracy import EVIDENCE
from campaign import Outcome, Task, judged
from campaign_tables import claims_table, table
from foreign_machine import NAME as FOREIGN
from foreign_machine import faults_for, has, maker, missions, scenario
from troubles import Trouble, troubles
from variation import recorded_signals

from diagnosis.pipeline import diagnose_mission, diagnose_signals
from replay.errors import MfhcaError
from replay.machine.config import Limits, Machine, haulotte
from replay.signals.signal import Signals
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import STRUCTURES, StructureOptions

TIERS = ("base", "spool", "direct")
SECOND = "second"  # second speeds and angles without any valve position
FIRST = {"tuning": 0, "reporting": 2000}
DEFAULT = "default"
OTHERS = {
    m.NAME: m
    for m in (
        hydrostatic,
        electrohydraulic,
        electric,
        flow_sharing,
        closed_circuit,
        geared_circuit,
        forwarder,
        dumper,
        sprayer,
        telehandler,
        paver,
        tug,
        loader,
        transporter,
        harvester,
    )
}
_DRIVEN, _STEERED = 0.06, 0.02  # m/s, rad/s
_DRIVEN_S, _STEERED_S = 3.0, 1.0
_LEAST_SPEED, _LEAST_ANGLE = 0.16, 0.06  # of the top speed, rad: what is less is read off by a share of these


def options_of(task: Task) -> SimulationOptions:
    """The mission."""
    trouble = task.trouble
    structure = None if task.machine == DEFAULT else StructureOptions(task.machine, machine_seed=task.seed % 7)
    return SimulationOptions(
        scenario="random" if trouble else "healthy",
        seed=task.seed,
        duration_s=task.duration,
        rate_hz=200.0,
        faults=trouble.faults if trouble else None,
        structure=structure,
    )


def run(task: Task) -> list[Outcome]:
    """Outcomes of one mission."""
    if task.machine == FOREIGN:
        return run_foreign(task)
    if task.machine in OTHERS:
        return run_other(task, OTHERS[task.machine])
    mission, machine, trouble, out = simulate_mission(options_of(task)), haulotte(), task.trouble, []
    name = trouble.name if trouble else "healthy"
    for tier in task.tiers:
        assert tier in (*EVIDENCE, SECOND)
        signals = as_logged(lambda t: recorded_signals(mission, t), tier)
        if trouble is not None and trouble.edit is not None:
            before, signals = signals, trouble.edit(signals)
            if trouble.parts and not deformed(before, signals, machine):
                continue
        try:
            report = diagnose_signals(signals, machine).report
        except MfhcaError as error:
            out.append(Outcome(task.machine, name, tier, "abstained", 0, 0, "error", str(error)))
            continue
        out.append(judged(task, tier, name, report, trouble.parts if trouble else None))
    columns = mission.columns
    asked = {
        c: columns.get(f"wheel.{c}.v_ref", columns.get(f"steer.{c}.phi_ref"))
        for c in {f.component for f in (trouble.faults if trouble else ())}
    }
    return out if exercised((mission.stamps - mission.stamps[0]) * 1e-9, asked, trouble) else []


def as_logged(signals_of: Callable[[str], Signals], tier: str) -> Signals:
    """A mission as a recorder of a tier has it; `signals_of` gives it for a tier of the machine."""
    if tier != SECOND:
        return signals_of(tier)
    whole = signals_of("direct")
    return replace(whole, items={name: s for name, s in whole.items.items() if not name.endswith(".u_applied")})


def run_other(task: Task, physics: ModuleType) -> list[Outcome]:
    """Outcomes of one mission of a machine of other physics."""
    trouble, out = task.trouble, []
    machine = physics.machine_of(physics.build(task.seed))
    name = trouble.name if trouble else "healthy"
    if trouble and not exercised(*physics.asked(task.seed, task.duration), trouble):
        return []
    for tier in task.tiers:
        faults = trouble.faults if trouble else ()
        signals = as_logged(lambda t, f=faults: physics.signals(task.seed, f, task.duration, t), tier)
        if trouble is not None and trouble.edit is not None:
            before, signals = signals, trouble.edit(signals)
            if trouble.parts and not deformed(before, signals, machine):
                continue
        try:
            report = diagnose_signals(signals, machine).report
        except Exception as error:  # a bug of the diagnosis, which the campaign outlives
            words = "".join(traceback.format_exception(error)[-2:])
            out.append(
                Outcome(task.machine, name, tier, "crashed", 0, 0, "error", words, seed=task.seed, kind=task.kind)
            )
            continue
        out.append(judged(task, tier, name, report, trouble.parts if trouble else None))
    return out


def run_foreign(task: Task) -> list[Outcome]:
    """Outcomes of one mission of the reference data's foreign plant, at its own rate; its steering has no faults."""
    make, trouble = maker(), task.trouble
    drive = scenario(make, 9000 + task.seed, "forced", task.duration)
    faults = trouble.faults if trouble else ()
    if trouble and (trouble.edit or not all(has(make, f) for f in faults)):
        return []
    drive.faults = faults_for(make, faults)
    name = trouble.name if trouble else "healthy"
    return [
        judged(task, tier, name, diagnose_mission(mission, machine).report, trouble.parts if trouble else None)
        for tier, mission, machine in missions(make, drive, [t for t in task.tiers if t != SECOND])
    ]


def exercised(t: np.ndarray, asked: Mapping[str, np.ndarray], trouble: Trouble | None) -> bool:
    """Whether a part that fails is driven, or its valve asked to steer, for some time of its fault; true where none is simulated."""
    if trouble is None or not trouble.faults:
        return True
    time: dict[str, float] = {}
    for f in trouble.faults:
        wheel = f.component not in ("front", "rear")
        used = np.abs(asked[f.component]) > _DRIVEN if wheel else np.abs(np.gradient(asked[f.component], t)) > _STEERED
        counts = f.start_s + f.ramp_s * min(1.0, Limits().clear_at / f.epsilon)  # a fault that grows, from then on
        time[f.component] = time.get(f.component, 0.0) + float(np.mean(np.diff(t))) * float(
            np.count_nonzero(used & (t >= counts) & (t < f.stop_s))
        )
    return any(s >= (_STEERED_S if c in ("front", "rear") else _DRIVEN_S) for c, s in time.items())


def deformed(before: Signals, after: Signals, machine: Machine) -> bool:
    """Whether what happened to a recorded channel takes away, or adds, the share that counts, for three seconds in all."""
    for name, one in after.items.items():
        old = before.items[name]
        if not np.array_equal(one.stamps, old.stamps):
            return True
        floor = _LEAST_ANGLE if name.startswith("steer.") else _LEAST_SPEED * machine.max_speed
        counts = ~(np.abs(one.values - old.values) < Limits().clear_at * np.maximum(np.abs(old.values), floor))
        if np.count_nonzero(counts & np.isfinite(old.values)) * np.median(np.diff(one.stamps)) * 1e-9 >= _DRIVEN_S:
            return True
    return False


def tasks_of(
    seeds: str,
    machines: Sequence[str],
    duration: float,
    every: int,
    healthy: int,
    first: int,
    named: str | None,
    offset: int = 0,
) -> list[Task]:
    """All missions: one of every so many kinds, and healthy ones, of every machine."""
    start, kinds = (
        FIRST[seeds] + first,
        [k for k, t in enumerate(troubles(duration)) if named is None or named in t.name],
    )
    out = []
    for m, machine in enumerate(machines):
        faulty = [Task(machine, k, start + k, duration, TIERS) for k in kinds if k % every == (m + offset) % every]
        sound = [Task(machine, None, start + 500 + k, duration, TIERS) for k in range(healthy)]
        out += [*faulty, *sound]
    return out


def run_all(tasks: Sequence[Task], jobs: int) -> Iterator[list[Outcome]]:
    """Outcomes as they come."""
    with ProcessPoolExecutor(jobs) as pool:
        futures = [pool.submit(run, task) for task in tasks]
        for done, future in enumerate(as_completed(futures), 1):
            print(f"\r{done} of {len(tasks)} missions   ", end="", file=sys.stderr, flush=True)
            yield future.result()
    print(file=sys.stderr)


def main() -> None:
    """Simulate, judge, print."""
    parser = argparse.ArgumentParser(description="Wrong all-clears and wrong stops.")
    parser.add_argument("--seeds", choices=FIRST, default="tuning")
    parser.add_argument("--first", type=int, default=0, help="added to the first seed")
    parser.add_argument(
        "--machine",
        nargs="+",
        default=None,
        choices=sorted({DEFAULT, FOREIGN, *STRUCTURES, *OTHERS}),
    )
    parser.add_argument("--duration", type=float, default=75.0, help="length of a mission [s]")
    parser.add_argument("--every", type=int, default=1, help="one of so many kinds of trouble")
    parser.add_argument("--offset", type=int, default=0, help="first kind, with --every")
    parser.add_argument("--healthy", type=int, default=40, help="healthy missions of each machine")
    parser.add_argument("--kinds", default=None, help="only kinds whose name has this text")
    parser.add_argument("--tiers", nargs="+", choices=(*TIERS, SECOND), default=TIERS)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every outcome")
    parser.add_argument("--read", type=Path, nargs="+", metavar="FILE", help="run nothing: tables of what --json wrote")
    asked = parser.parse_args()
    if asked.read:
        lines = [line for file in asked.read for line in file.read_text().splitlines()]
        return show([Outcome(**json.loads(line)) for line in lines])
    structure = next(n for n, s in STRUCTURES.items() if s.kind == asked.seeds)
    machines = asked.machine or [DEFAULT, structure]
    tasks = tasks_of(
        asked.seeds, machines, asked.duration, asked.every, asked.healthy, asked.first, asked.kinds, asked.offset
    )
    tasks = [replace(task, tiers=tuple(asked.tiers)) for task in tasks]
    outcomes = []
    with asked.json.open("w") if asked.json else nullcontext() as file:
        for batch in run_all(tasks, asked.jobs):
            outcomes += batch
            if file:
                file.write("".join(json.dumps(asdict(o)) + "\n" for o in batch))
                file.flush()
    return show(outcomes)


def show(outcomes: Sequence[Outcome]) -> None:
    """Print the tables, and what was cleared or crashed."""
    print("\n".join([*table(outcomes, (*TIERS, SECOND)), "", *claims_table(outcomes, (*TIERS, SECOND))]))
    for o in outcomes:
        if o.outcome in ("cleared", "crashed"):
            print(f"{o.outcome}: {o.machine}, {o.tier}: {o.trouble}, seed {o.seed}")


if __name__ == "__main__":
    main()
