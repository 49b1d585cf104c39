"""A valve that wears from mission to mission, found by its trend: `python tests/benchmarks/wear.py [--first 0] [--count 2]`.

Each machine (of the default structure, or of those of `replay.simulation.structures`) drives eight missions in which the loss of
one valve grows from .03 to .4, and eight healthy ones. All are diagnosed with commands, speeds and valve commands alone; the
trend of every wheel's valve is asked after each mission. Printed: the loss at which the worn valve first rises for certain,
and other parts that rise, in the worn missions and in the healthy ones. Tune on seeds below 1000, report from 2000 on.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from accuracy import signals_of

from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.read import Bounds, Part, Result
from diagnosis.audit.fleet.runs import Run
from diagnosis.audit.fleet.trends import trends_of
from diagnosis.pipeline import diagnose_signals
from diagnosis.results.document import ReportDocument
from diagnosis.results.vocabulary import Verdict
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import haulotte
from replay.simulation.options import SimulationOptions
from replay.simulation.plant_options import PlantOptions
from replay.simulation.run import simulate_mission
from replay.simulation.structures import STRUCTURE_NAMES, StructureOptions

MISSIONS, WORN = 8, "FL"
LOSSES = np.geomspace(0.03, 0.4, MISSIONS)


def report_of(structure: str, machine: int, number: int, loss: float, seconds: float) -> ReportDocument:
    """One mission of a machine, diagnosed."""
    fault = FaultSpec(WORN, Side.ACTUATOR, FaultMode.INEFFICIENT, 0.0, seconds, loss)
    options = SimulationOptions(
        scenario="healthy",
        seed=100 * machine + number,
        duration_s=seconds,
        rate_hz=250.0,
        evidence="base",
        faults=(fault,) if loss > 0 else (),
        plant=PlantOptions(wheel_spread=0.0),
    )
    if structure != "default":
        options = replace(options, structure=StructureOptions(structure, machine_seed=machine))
    return diagnose_signals(signals_of(simulate_mission(options), "base"), haulotte()).report


def run_of(number: int, report: ReportDocument) -> Run:
    """What an audit keeps of a report."""
    loss = {(x["component"], x["side"]): x for x in report["loss"]}
    parts = []
    for c in report["coverage"]:
        found = loss.get((c["component"], c["side"]))
        e = None if found is None else Bounds(*(found["epsilon"][k] for k in ("value", "low", "high")))  # type: ignore[literal-required]
        relative = found is not None and found["relative"]
        parts.append(Part(c["component"], c["side"], c["driving_s"], c["decided_driving_s"], e, relative))
    log = report["log"]
    return Run(
        str(number),
        Result(
            number, "ok", "", 1, "M", "", Verdict.READY, "", number * 86_400 * 10**9, log["duration_s"],  # type: ignore[arg-type]
            log["driving_s"], None, False, None, "", "", "", (), tuple(parts),
        ),
    )  # fmt: skip


def rising(runs: list[Run]) -> dict[tuple[str, str], int]:
    """Parts whose trend rises for certain, and after how many missions it first does."""
    first: dict[tuple[str, str], int] = {}
    for n in range(3, len(runs) + 1):
        for t in trends_of(Machine("M", "", tuple(runs[:n]), (), ())):
            if t.trend.direction == "rising":
                first.setdefault((t.component, t.side), n)
    return first


def main() -> None:
    """Simulate, diagnose, follow, print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="first machine; tune below 1000, report from 2000 on")
    parser.add_argument("--count", type=int, default=2, help="machines per structure")
    parser.add_argument("--seconds", type=float, default=120.0, help="length of a mission [s]")
    parser.add_argument("--structure", nargs="+", choices=("default", *STRUCTURE_NAMES), default=["default"])
    asked = parser.parse_args()
    early = series = others = healthy = 0
    for name in asked.structure:
        for machine in range(asked.first, asked.first + asked.count):
            found = []
            for start, losses in ((0, np.zeros(MISSIONS)), (MISSIONS, LOSSES)):
                reports = [report_of(name, machine, start + k, x, asked.seconds) for k, x in enumerate(losses.tolist())]
                found.append(rising([run_of(k, r) for k, r in enumerate(reports)]))
            seen = found[1].pop((WORN, "actuator"), None)
            at = None if seen is None else float(LOSSES[seen - 1])
            early += at is not None and at <= 0.15
            series += 1
            others += len(found[1])
            healthy += len(found[0])
            text = "not found" if at is None else f"found at a loss of {at:.3f}, in mission {seen}"
            print(f"{name} {machine}: {text}; others {found[1]}; healthy missions {found[0]}", flush=True)
    print(f"found at .15 or before: {early} of {series}; other parts {others}; of healthy machines {healthy}")


if __name__ == "__main__":
    main()
