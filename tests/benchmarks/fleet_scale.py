"""A fleet of 100 000 missions; run as `python tests/benchmarks/fleet_scale.py [--machines N] [--missions N]`.

The results are made up, not diagnosed, and written as an audit writes them: store, result objects, a report of each machine's
last mission and the mark of all others. Measured are the page with its document and table (aim: 8 MB, 40 units), the history of one machine
(0.5 units), and the room on the disk without the reports (4 GB). One unit is the CPU time of a Python loop of ten million additions, taken
before and after in the same run. Exit code 1 where an aim is missed.
"""

from __future__ import annotations

import argparse
import gc
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from diagnosis.audit.fleet_files import load_fleet, write_fleet
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.objects import Objects, attempt_name, encode
from diagnosis.audit.store.store import Store
from tests import fleet_samples as samples

PAGE_MB, PAGE_UNITS, HISTORY_UNITS, STORE_GB = 8.0, 40.0, 0.5, 4.0
_BLOCK = 4096
_SOME = 500
_TREND = (
    "SELECT r.start_ns, c.component, c.side, c.epsilon, c.epsilon_low, c.epsilon_high FROM result r JOIN component c "
    "ON c.result = r.id WHERE r.machine_id = ? ORDER BY r.start_ns"
)


def unit() -> float:
    """CPU time of the loop [s]."""
    start = time.process_time()
    x = 0
    for i in range(10_000_000):
        x += i
    return time.process_time() - start


def units(work: Callable[[], object]) -> tuple[float, float]:
    """CPU time of some work in units, and one unit [s]."""
    gc.collect()  # what was left by the work before is not this one's
    loop = unit()
    start = time.process_time()
    work()
    took = time.process_time() - start
    one = (loop + unit()) / 2
    return took / one, one


def object_of(sample: samples.Sample, number: int) -> bytes:
    """A result object as an audit writes it for such a mission."""
    key = Key(f"{number:064x}", "c" * 64, "1.0")
    parts = [
        {
            "component": c, "side": s, "driving_s": 1800.0, "decided_s": 1710.0, "healthy_s": 1710.0, "faulty_s": 0.0, "worst": "",
            "epsilon": e[0], "epsilon_low": e[1], "epsilon_high": e[2], "epsilon_s": 1710.0, "epsilon_relative": 0,
        }
        for (c, s), e in sample.epsilon.items()
    ]  # fmt: skip
    facts = {
        "machine_id": sample.machine,
        "machine_name": "Boom lift",
        "verdict": sample.verdict,
        "title": "No fault found",
    }
    file = {"path": f"../logs/{sample.name}.mcap", "size": 10**6, "stamp": "1793000000000000000", "sha256": "0" * 64}
    document: dict[str, Any] = {
        "schema": "mfhca-result/1", "mission": {"name": sample.name, "files": [file], "bytes": 10**6}, "key": key.record,
        "made_ns": samples.START_NS, "attempt": {"number": 1, "state": "ok", "reason": "", "wall_s": 1.0, "cpu_s": 1.0, "peak_mb": 300.0},
        "report": f"missions/{sample.name}", "machine_id": "", "summary": {"result": facts, "faults": [], "components": parts},
    }  # fmt: skip
    return encode(document)


def on_disk(size: int) -> int:
    """Room that a file takes [bytes]."""
    return -(-size // _BLOCK) * _BLOCK


def history(store: Path, machine: str) -> int:
    """Ask what is known of one machine: its missions, and ε̂ of each part in them."""
    with Store.open(store, read_only=True) as opened:
        return len(opened.missions_of(machine)) + len(opened.database.rows(_TREND, (machine,)))


def main() -> int:
    """Make the fleet, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=500)
    parser.add_argument("--missions", type=int, default=100_000)
    given = parser.parse_args()
    fleet = samples.large(given.machines, given.missions // given.machines)
    with tempfile.TemporaryDirectory(prefix="mfhca-benchmark-") as name:
        out = Path(name)
        store = samples.write_store(out / "fleet.sqlite", fleet)
        for machine, last in {s.machine: s for s in fleet}.items():
            if last.state == "ok":
                samples.write_report(out, last.name, cleared=not last.faults)
            assert machine
        write = Objects(str(out / "results"))
        some = [object_of(sample, k) for k, sample in enumerate(fleet[:_SOME], 1)]
        for k, content in enumerate(some, 1):
            write.put(attempt_name(Key(f"{k:064x}", "c" * 64, "1.0").stem, 1), content)
        objects = sum(on_disk(len(content)) for content in some) / len(some) * len(fleet)
        page, one = units(lambda: write_fleet(store, out))
        reading, _ = units(lambda: load_fleet(store, out))
        asked, _ = units(lambda: history(store, fleet[-1].machine))
        sizes = {p.suffix: p.stat().st_size / 1e6 for p in out.iterdir() if p.is_file()}
        room = (on_disk(store.stat().st_size) + objects) / 1e9
    print(f"{len(fleet)} missions of {given.machines} machines; one unit is {one:.3f} s")
    print(f"page {sizes['.html']:.1f} MB, document {sizes['.json']:.0f} MB, table {sizes['.csv']:.0f} MB")
    print(f"page, document and table: {page:.1f} units, of which reading with trends {reading:.1f}")
    print(f"history of one machine: {asked:.3f} units")
    print(f"store and result objects: {room:.2f} GB")
    aims = (
        (sizes[".html"], PAGE_MB, "page"),
        (page, PAGE_UNITS, "CPU"),
        (asked, HISTORY_UNITS, "history"),
        (room, STORE_GB, "store"),
    )
    missed = [what for value, most, what in aims if value > most]
    print(f"missed: {', '.join(missed)}" if missed else "every aim is met")
    return bool(missed)


if __name__ == "__main__":
    sys.exit(main())
