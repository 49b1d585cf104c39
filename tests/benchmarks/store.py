"""Times of the audit's store; run as `python tests/benchmarks/store.py [--missions 5000] [--folder DIR]`.

Writes missions of 56 rows (4 wheels and 2 axles on 2 sides, faults for the rest) as an audit does, one by one and each on the
disk before the next; then asks what a fleet page and a resume ask. Result objects are written in a second round.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.store.ingest import ingest
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.outcome import Outcome
from diagnosis.audit.store.store import Store

_ROWS = 56
_COMPONENTS = ("FR", "FL", "RR", "RL", "front", "rear")
_MACHINES = 10
_TREND = (
    "SELECT r.start_ns, c.epsilon, c.epsilon_low, c.epsilon_high FROM result r JOIN component c ON c.result = r.id "
    "WHERE r.machine_id = ? AND c.component = 'FR' AND c.side = 'actuator' ORDER BY r.start_ns"
)


def summary_of(number: int) -> dict[str, Any]:
    """Rows of one mission."""
    start = 1_760_000_000_000_000_000 + number * 3_600_000_000_000
    epsilon = {"epsilon": 0.1, "epsilon_low": 0.05, "epsilon_high": 0.15}
    components = [
        {
            "component": component, "side": side, "driving_s": 500.0, "decided_s": 480.0, "healthy_s": 400.0,
            "faulty_s": 80.0, "worst": "inefficient", **epsilon, "epsilon_s": 400.0, "epsilon_relative": 0,
        }
        for component in _COMPONENTS
        for side in ("sensor", "actuator")
    ]  # fmt: skip
    faults = [
        {
            "id": f"F{i}", "component": _COMPONENTS[i % 6], "kind": "wheel", "side": "actuator", "mode": "inefficient",
            "severity": "medium", "start_s": 10.0 * i, "stop_s": 10.0 * i + 5, "start_ns": start + i, **epsilon,
            "sat": 0.1, "sat_unit": "m/s", "probability": 0.98,
        }
        for i in range(_ROWS - len(components))
    ]  # fmt: skip
    result = {
        "machine_id": f"H-{number % _MACHINES:02d}", "machine_name": "Haulotte", "verdict": "watch", "start_ns": start,
        "title": "44 faults to watch", "duration_s": 600.0, "driving_s": 500.0, "decided_s": 480.0, "distance_m": 300.0,
        "open_loop": 0,
    }  # fmt: skip
    return {"result": result, "faults": faults, "components": components}


@contextmanager
def timed(what: str, count: int = 1) -> Iterator[None]:
    """Print how long a block took."""
    start = time.perf_counter()
    yield
    took = time.perf_counter() - start
    each = f"  ({took / count * 1e3:.3f} ms each)" if count > 1 else ""
    print(f"{what:58s} {took * 1e3:10.1f} ms{each}", flush=True)


def measure(folder: Path, count: int, *, objects: bool) -> None:
    """Write, ask and resume."""
    print(f"{count} missions of {_ROWS} rows, {'with' if objects else 'without'} result objects")
    path = folder / ("with" if objects else "without") / "fleet.sqlite"
    missions = [
        MissionSource(f"m{i}", (str(folder / "logs" / f"m{i}.mcap"),), 1000 + i, (str(i),), sizes=(1000 + i,))
        for i in range(count)
    ]
    keys = [Key(hashlib.sha256(str(i).encode()).hexdigest(), "c" * 64, "1") for i in range(count)]
    ends = [Outcome("ok", wall_s=1.0, cpu_s=1.0, peak_mb=300.0, summary=summary_of(i)) for i in range(count)]
    with Store(path, objects=objects) as store:
        store.begin_run()
        with timed("enter discovered missions"):
            missions = list(store.adopt(missions, [str(folder / "logs")]))
        with timed("record, each on the disk before the next", count):
            for mission, key, end in zip(missions, keys, ends, strict=True):
                store.record(mission, key, end, f"missions/{mission.name}", hashes=[key.log_hash])
    print(f"{'size of the store':58s} {path.stat().st_size / 1e6:10.1f} MB")
    with Store.open(path) as store:
        store.begin_run()
        with timed("enter the same missions again"):
            store.adopt(missions, [str(folder / "logs")])
        some = missions[:: max(1, count // 1000)][:1000]
        with timed(f"resume: hashes and results of {len(some)} missions", len(some)):
            for mission in some:
                sha256 = store.known_hash(mission.files[0], mission.bytes, mission.stamps[0])
                assert sha256 is not None
                assert store.lookup(Key(sha256, "c" * 64, "1")) is not None
        with timed(f"trend of one side of one machine, {count // _MACHINES} missions"):
            assert len(store.database.rows(_TREND, ("H-03",))) == count // _MACHINES
        with timed("missions of one machine in the order of the log's clock"):
            assert len(store.missions_of("H-03")) == count // _MACHINES
        with timed("all missions with their results"):
            assert len(store.missions()) == count
    if objects:
        again = folder / "again" / "fleet.sqlite"
        with Store(again, objects=False) as store, timed("make a lost store again from its objects"):
            assert ingest(store, str(path.parent / "results")).attempts == count


def main() -> None:
    """Run all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missions", type=int, default=5000)
    parser.add_argument("--folder", type=Path, help="where to write; default: the folder for temporary files")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mfhca-store-", dir=asked.folder) as folder:
        for objects in (False, True):
            measure(Path(folder), asked.missions, objects=objects)


if __name__ == "__main__":
    main()
