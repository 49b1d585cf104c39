"""Scores on machines that vary far beyond the default one; run as `python tests/benchmarks/variation.py [--quick]`.

Each seed is one machine (`replay.simulation.variation`) that drives a mission with faults and one without, both diagnosed
with the default settings and every level of evidence. Tune on ``--seeds tuning`` alone; published figures come from
``--seeds reporting``, whose ranges reach further. Wheels only; driving time unless said.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from accuracy import EVIDENCE, number, signals_of

from diagnosis.evaluation.counts import Counts, FaultOutcome, add
from diagnosis.evaluation.evaluate import evaluate_report
from diagnosis.evaluation.scores import figures
from diagnosis.pipeline import diagnose_signals
from replay.errors import MfhcaError
from replay.log.source_options import SignalSource
from replay.machine.config import haulotte
from replay.signals.signal import Signals
from replay.simulation.options import SimulatedMission, SimulationOptions, channel_group
from replay.simulation.run import simulate_mission
from replay.simulation.variation import POOLS, Kind, varied_options

_RATES = ((0.0, 100.0), (100.0, 300.0), (300.0, 1000.0))
_ONSETS = ("at once", "growing", "from the first sample")


@dataclass(frozen=True)
class Outcome:
    """One mission at one level of evidence.

    Attributes
    ----------
    options : SimulationOptions
        The machine and its mission.
    evidence : str
        What was logged.
    counts : Counts
        Of its wheels.
    onsets : tuple[str, ...]
        Of each of the counts' faults: one of `_ONSETS`.
    """

    options: SimulationOptions
    evidence: str
    counts: Counts
    onsets: tuple[str, ...]


def recorded_signals(mission: SimulatedMission, evidence: str) -> Signals:
    """Signals with less evidence, without the rows that the recorder lost; each group of channels is a topic."""
    signals = signals_of(mission, evidence)
    items = {
        name: replace(signals.items[name], stamps=stamps, values=values, origin=_origin(name))
        for name, stamps, values in mission.series()
        if name in signals.items
    }
    return replace(signals, items=items)


def _origin(name: str) -> SignalSource:
    slow = name.startswith(("gnss.", "imu."))
    return SignalSource(topic=f"/{name.partition('.')[0] if slow else channel_group(name)}", field=name)


def judge(options: SimulationOptions, evidence: Sequence[str]) -> list[Outcome | str]:
    """Outcomes of one mission by evidence, or the error that ended its diagnosis."""
    mission = simulate_mission(options)
    ramps = {(i.component, i.side.value, round(i.start_s, 6)): i.ramp_s for i in mission.truth.intervals}
    out: list[Outcome | str] = []
    for level in evidence:
        name = f"{options.scenario}, seed {options.seed}, {level}"
        try:
            report = diagnose_signals(recorded_signals(mission, level), haulotte()).report
            counts = evaluate_report(report, mission.truth, name).groups["wheel"]
        except MfhcaError as error:
            out.append(f"{name}: {error}")
            continue
        onsets = tuple(_onset(f, ramps) for f in counts.faults)
        out.append(Outcome(options, level, counts, onsets))
    return out


def _onset(fault: FaultOutcome, ramps: dict[tuple[str, str, float], float]) -> str:
    if fault.start_s <= 0.0:
        return _ONSETS[2]
    near = min(ramps, key=lambda k: (k[0] != fault.component, k[1] != fault.side, abs(k[2] - fault.start_s)))
    return _ONSETS[int(ramps[near] > 0.0)]


def run_all(missions: Sequence[SimulationOptions], evidence: Sequence[str], jobs: int) -> Iterator[list[Outcome | str]]:
    with ProcessPoolExecutor(jobs) as pool:
        futures = [pool.submit(judge, options, evidence) for options in missions]
        for done, future in enumerate(as_completed(futures), 1):
            print(f"\r{done} of {len(missions)} missions   ", end="", file=sys.stderr, flush=True)
            yield future.result()
    print(file=sys.stderr)


_WIDTHS = (26, 4, 6, 6, 6, 6, 1, 6, 6, 6, 6, 1, 6, 6, 6, 7, 7)
_HEAD = ("", "n", "F1", "bal", "dec", "share", "|", "F1", "bal", "dec", "share", "|", "ev.F1", "ε", "fa", "fa/h", "≤")


def row(cells: Sequence[object]) -> str:
    return " ".join(f"{c!s:<{w}}" if i == 0 else f"{c!s:>{w}}" for i, (c, w) in enumerate(zip(cells, _WIDTHS)))  # noqa: B905


def pooled(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Figures of missions with faults, and the false alarms of those without."""
    faulty = [o for o in outcomes if o.options.scenario != "healthy"]
    healthy = [o for o in outcomes if o.options.scenario == "healthy"]
    return {
        "missions": len(faulty),
        "faulty": figures(add([o.counts for o in faulty])),
        "healthy_missions": len(healthy),
        "false_alarms": figures(add([o.counts for o in healthy]))["false_alarms"],
    }


def summary(name: str, found: dict[str, Any]) -> str:
    cells: list[object] = [name, found["missions"]]
    for side in ("sensor", "actuator"):
        s = found["faulty"]["sides"][side]
        keys = ("macro_f1", "balanced_accuracy", "balanced_accuracy_decided", "decided_share")
        cells += [*(number(s[k]) for k in keys), "|"]
    alarms = found["false_alarms"]
    cells += [number(found["faulty"]["events"]["f1"]), number(found["faulty"]["epsilon"]["mae"]), alarms["count"]]
    return row([*cells, number(alarms["per_hour"], 2), number(alarms["per_hour_high"], 2)])


def by_onset(outcomes: Sequence[Outcome]) -> dict[str, dict[str, Any]]:
    """Events by the shape of their onset: how many were found, in the right row, and how well."""
    out = {}
    for shape in _ONSETS:
        mine = [f for o in outcomes for f, s in zip(o.counts.faults, o.onsets, strict=True) if s == shape]
        mine = [f for f in mine if f.outcome not in ("not_excited", "masked")]
        right = [f for f in mine if f.outcome == "right"]
        epsilon = [f.epsilon_error for f in right if f.epsilon_error is not None]
        onset = sorted(abs(f.onset_error_s) for f in right if f.onset_error_s is not None)
        out[shape] = {
            "faults": len(mine),
            "right": len(right),
            "missed": sum(f.outcome == "missed" for f in mine),
            "epsilon_mae": sum(epsilon) / len(epsilon) if epsilon else None,
            "onset_median_s": onset[len(onset) // 2] if onset else None,
        }
    return out


def _band(options: SimulationOptions) -> str:
    low, high = next(b for b in _RATES if b[0] < options.rate_hz <= b[1])
    return f"{low:g}–{high:g} Hz" if low else f"at most {high:g} Hz"


_SPLITS: tuple[tuple[str, Callable[[SimulationOptions], str]], ...] = (
    ("law", lambda o: o.law),
    ("coupling", lambda o: o.coupling),
    ("rate", _band),
    ("lost rows", lambda o: "rows lost" if o.drop_share else "no row lost"),
)


def main() -> None:
    """Simulate, diagnose, score, print."""
    parser = argparse.ArgumentParser(description="Scores of the diagnosis on varied machines.")
    parser.add_argument("--seeds", choices=list(POOLS), default="tuning", help="tune on one, publish the other")
    parser.add_argument("--count", type=int, default=40, help="number of machines")
    parser.add_argument("--quick", action="store_true", help="six machines and 60 s, for a first impression")
    parser.add_argument("--duration", type=float, default=120.0, help="length of a mission [s]")
    parser.add_argument("--evidence", choices=EVIDENCE, nargs="+", default=EVIDENCE)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    asked = parser.parse_args()
    kind: Kind = asked.seeds
    seeds = POOLS[kind][: 6 if asked.quick else asked.count]
    duration = 60.0 if asked.quick else asked.duration
    missions = [
        varied_options(seed, kind=kind, scenario=scenario, duration_s=duration)
        for seed, scenario in product(seeds, (None, "healthy"))
    ]
    results = [x for found in run_all(missions, asked.evidence, asked.jobs) for x in found]
    failed = sorted(x for x in results if isinstance(x, str))
    outcomes = sorted(
        (x for x in results if isinstance(x, Outcome)), key=lambda o: (o.options.seed, o.options.scenario)
    )
    print(f"{kind} seeds {seeds[0]}–{seeds[-1]}, {duration:g} s, {len(missions)} missions")
    document: dict[str, Any] = {"seeds": kind, "count": len(seeds), "duration_s": duration, "evidence": {}}
    for level in asked.evidence:
        mine = [o for o in outcomes if o.evidence == level]
        print(f"\n{level:31}{'sensor':^29}{'actuator':^28}")
        print(row(_HEAD))
        found = {"all": pooled(mine)}
        print(summary("all", found["all"]))
        for split, value in _SPLITS:
            for name in sorted({value(o.options) for o in mine}):
                part = pooled([o for o in mine if value(o.options) == name])
                found[f"{split}: {name}"] = part
                print(summary(f"{split}: {name}", part))
        shapes = by_onset(mine)
        for shape, s in shapes.items():
            print(
                f"onset {shape}: {s['right']} of {s['faults']} events right, {s['missed']} missed, ε "
                f"{number(s['epsilon_mae'])}, onset {number(s['onset_median_s'], 0, 1e3)} ms"
            )
        document["evidence"][level] = found | {"onsets": shapes}
    for text in failed:
        print(f"not judged: {text}")
    if asked.json:
        asked.json.write_text(json.dumps(document | {"failed": failed}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
