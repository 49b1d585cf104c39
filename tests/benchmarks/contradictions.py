"""Results that contradict themselves, over hundreds of missions: `python tests/benchmarks/contradictions.py --count 6`.

Six kinds of data: the simulator's scenarios and machines of other structures, in every tier; the machines of other physics beside
this file, with every sort of trouble; ordinary robots set up as `config init` does; the reference data's foreign plant; its real robots,
arms, rigs, car and public logs as they are, and robots with faults written into them; made-up fleets. Each result is read by `tests.contradictions`:
verdict, title, hypotheses, severity, advice, sizes, times, states, the page's and the terminal's words must agree; each fleet by
`tests.fleet_contradictions`: lists, states, headline, table and page. Ends with 1 where one
does not. Seeds from 2000 on. The real logs and the plant lie where ``MFHCA_REFERENCE_DATA`` says; without them they are left out.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import foreign_machine
import numpy as np
import ordinary
import orjson
from all_clear import OTHERS
from ordinary_robots.faults import FAULTS
from ordinary_robots.machines import KINDS
from real_results import real
from troubles import troubles
from variation import recorded_signals

from diagnosis.audit.fleet.fleet_types import FleetDocument
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from diagnosis.pipeline import diagnose_mission, diagnose_signals
from diagnosis.results.result import MissionResult
from replay.errors import MfhcaError
from replay.machine.config import haulotte
from replay.mission import Mission
from replay.signals.timeline import align
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import STRUCTURE_NAMES, StructureOptions
from tests import fleet_samples
from tests.contradictions import contradictions
from tests.fleet_contradictions import fleet_contradictions

TIERS = ("base", "spool", "direct")
Named = tuple[str, MissionResult]


def simulated(count: int, first: int) -> Iterator[Named]:
    """The simulator's scenarios and machines of other structures."""
    for structure in ("", *STRUCTURE_NAMES):
        for k in range(count if structure else 2 * count):
            scenario = ("random", "paper")[k % 2] if not structure else "random"
            options = SimulationOptions(
                scenario=scenario,  # type: ignore[arg-type]
                seed=first + k,
                duration_s=40.0,
                rate_hz=(200.0, 100.0)[k % 2],
                steering_faults=True,
                structure=StructureOptions(structure) if structure else None,
            )
            made = simulate_mission(options)
            for tier in TIERS:
                signals = recorded_signals(made, tier)
                name = f"{structure or scenario} {first + k} {tier}"
                try:
                    mission = Mission(files=(), signals=signals, timeline=align(signals))
                    yield name, diagnose_mission(mission, haulotte())
                except MfhcaError as error:
                    print(f"{name}: {error}")


def other_physics(count: int, first: int) -> Iterator[Named]:
    """Machines of other physics beside this file, all that `all_clear.py` knows, with every so many-th sort of trouble, and sound."""
    kinds = troubles(75.0)
    for place, physics in enumerate(OTHERS.values()):
        for k in range(count):
            trouble = None if (k + place) % 6 == 5 else kinds[(17 * k + 7 * place) % len(kinds)]
            seed = first + 300 + k
            for tier in TIERS:
                signals = physics.signals(seed, trouble.faults if trouble else (), 75.0, tier)
                if trouble is not None and trouble.edit is not None:
                    signals = trouble.edit(signals)
                name = f"{physics.NAME} {seed} {trouble.name if trouble else 'healthy'} {tier}"
                try:
                    yield name, diagnose_signals(signals, physics.machine_of(physics.build(seed)))
                except MfhcaError as error:
                    print(f"{name}: {error}")


def ordinary_robots(count: int, first: int) -> Iterator[Named]:
    """Ordinary robots with one fault each, every sixth sound."""
    for k in range(3 * count):
        kind, fault = KINDS[k % len(KINDS)], "" if k % 6 == 5 else FAULTS[(5 * k) % len(FAULTS)]
        with tempfile.TemporaryDirectory() as folder:
            made = ordinary.case(kind, fault, first + 900 + k, Path(folder))
            yield f"{kind} {first + 900 + k} {fault or 'healthy'}", made.result


def foreign(count: int, first: int) -> Iterator[Named]:
    """The reference data's foreign plant, with faults."""
    make = foreign_machine.maker()
    for k in range(count):
        drive = foreign_machine.scenario(make, 5200 + first + k, ("forced", "printed")[k % 2], 60.0)
        rng = np.random.default_rng(abs(first - 2000) + k)
        modes = ("stuck", "no_signal", "inefficient", "noisy")
        faults = [
            make.Fault(
                int(rng.integers(4)),
                str(rng.choice(["sensor", "actuator"])),
                str(rng.choice(modes)),
                a,
                a + 8.0,
                0.5,
                0.15,
            )
            for a in (15.0, 30.0, 45.0)
        ]
        drive = replace(drive, faults=faults)
        for tier, mission, machine in foreign_machine.missions(make, drive, TIERS):
            yield f"foreign {5200 + first + k} {tier}", diagnose_mission(mission, machine)


def fleets(count: int, first: int) -> Iterator[tuple[str, FleetDocument]]:
    """Fleets of three machines with missions of every kind."""
    parts = fleet_samples.PARTS
    for k in range(20 * count):
        rng = np.random.default_rng(first + k)
        missions = []
        for n in range(int(rng.integers(4, 14))):
            faults = [
                fleet_samples.Fault(
                    *parts[rng.integers(len(parts))],
                    str(rng.choice(["stuck", "inefficient", "noisy"])),
                    str(rng.choice(["high", "medium", "low"])),
                    tuple(np.sort(rng.uniform(0.0, 1.0, 3))[[1, 0, 2]].tolist()),
                    float(rng.choice([10.0, 2515.0])),
                )
                for _ in range(int(rng.choice([0, 0, 0, 1, 2])))
            ]
            worst = "stop" if any(f.severity == "high" for f in faults) else "watch" if faults else ""
            verdict = worst or str(rng.choice(["ready", "not_assessed"], p=[0.8, 0.2]))
            blind = [p for p in parts if rng.random() < 0.2] if verdict == "not_assessed" else []
            state = str(rng.choice(["ok", "unreadable"], p=[0.95, 0.05]))
            day = float(n) if rng.random() < 0.9 else None
            machine = f"HX-{rng.integers(3)}"
            missions.append(fleet_samples.Sample(f"{n}", machine, day, state, verdict, faults, {}, blind))
        with tempfile.TemporaryDirectory() as folder:
            store = fleet_samples.write_store(Path(folder) / "fleet.sqlite", missions)
            yield f"fleet {first + k}", fleet_json(load_fleet(store, axis=("hours", "days")[k % 2]))


def main() -> None:
    """Diagnose, check, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=6)
    parser.add_argument("--first", type=int, default=2000, help="first seed, to run many results in parts")
    parser.add_argument(
        "--only",
        nargs="*",
        help="kinds of data: simulated, other physics, ordinary robots, foreign plant, real, fleets",
    )
    asked = parser.parse_args()
    count = asked.count
    sources = {
        "simulated": simulated(count, asked.first),
        "other physics": other_physics(count, asked.first),
        "ordinary robots": ordinary_robots(count, asked.first),
    }
    data = Path(os.environ.get("MFHCA_REFERENCE_DATA", "../shared"))
    left_out = ""
    if (data / "fault_data").is_dir():
        sources |= {"foreign plant": foreign(count, asked.first), "real": real(count, asked.first)}
    else:
        left_out = (
            f"left out: foreign plant and real robots, for there are no reference data in {data} (MFHCA_REFERENCE_DATA)"
        )
        print(left_out, flush=True)
    results: Counter[str] = Counter()
    wrong: Counter[str] = Counter()
    for kind, reports in sources.items():
        if asked.only and kind not in asked.only:
            continue
        for name, result in reports:
            results[kind] += 1
            found = contradictions(orjson.loads(orjson.dumps(result.report)), result.columns)
            wrong[kind] += bool(found)
            for text in found:
                print(f"{name}: {text}", flush=True)
        print(f"{kind}: {results[kind]} results, {wrong[kind]} contradict themselves", flush=True)
    if not asked.only or "fleets" in asked.only:
        for name, document in fleets(count, asked.first):
            results["fleets"] += 1
            told = fleet_contradictions(document)
            wrong["fleets"] += bool(told)
            for text in told:
                print(f"{name}: {text}", flush=True)
        print(f"fleets: {results['fleets']} results, {wrong['fleets']} contradict themselves", flush=True)
    print(f"all: {sum(results.values())} results, {sum(wrong.values())} contradict themselves")
    if left_out:
        print(left_out)
    sys.exit(1 if sum(wrong.values()) else 0)


if __name__ == "__main__":
    main()
