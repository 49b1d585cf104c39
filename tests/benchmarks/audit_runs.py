"""What scripts about audits share: short missions, the command, what an audit acknowledged and what of it stands, its processes."""

from __future__ import annotations

import json
import sqlite3
import sys
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from replay.export.mission import write_mission  # noqa: E402
from replay.simulation.options import SimulationOptions  # noqa: E402
from replay.simulation.run import simulate_mission  # noqa: E402

DAMAGED = 1_000_000


def simulate(path: Path, seconds: float, rate: float, seed: int) -> Path:
    """Write a random mission of so many seconds and samples a second."""
    options = SimulationOptions(scenario="random", seed=seed, duration_s=seconds, rate_hz=rate)
    write_mission(simulate_mission(options), path, "mcap")
    return path


def short_missions(folder: Path, count: int, seed: int = 500) -> Path:
    """Write missions of 12 s at 100 Hz."""
    folder.mkdir(parents=True)
    for i in range(count):
        simulate(folder / f"m{i:02d}.mcap", 12.0, 100.0, seed + i)
    return folder


def command(*words: str) -> list[str]:
    """Command line of an audit of this checkout."""
    call = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from cli.main import main; main()"
    return [sys.executable, "-c", call, "audit", *words]


def told(events: Path) -> Iterator[dict[str, object]]:
    """Events so far, without a line that is only begun."""
    if events.is_file():
        for line in events.read_text(encoding="utf-8").splitlines():
            if line.endswith("}"):
                yield json.loads(line)


def ended(events: Path) -> list[str]:
    """Names of the missions whose end was acknowledged, in that order."""
    return [str(one["name"]) for one in told(events) if one["event"] == "mission"]


def ended_twice(events: Path) -> int:
    """How many missions were acknowledged more than once."""
    names = ended(events)
    return len(names) - len(set(names))


def lost(out: Path, events: Path) -> int:
    """Missions that were acknowledged with a verdict but do not stand in the store with a whole report; `DAMAGED` of a damaged store."""
    judged = {str(one["name"]) for one in told(events) if one["event"] == "mission" and one["report"]}
    if not judged:
        return 0
    store = sqlite3.connect(out / "fleet.sqlite")
    try:
        if store.execute("PRAGMA integrity_check").fetchone() != ("ok",):
            return DAMAGED
        stored = dict(
            store.execute("SELECT m.name, r.report FROM mission m JOIN result r ON r.id = m.result").fetchall()
        )
    finally:
        store.close()
    return sum(not _whole(out / str(stored.get(name))) for name in judged)


def _whole(report: Path) -> bool:
    try:
        json.loads((report / "report.json").read_bytes())
        return (report / "report.html").read_bytes().rstrip().endswith(b"</html>")
    except (OSError, ValueError):
        return False


def states(out: Path) -> dict[str, str]:
    """State of every mission in a store."""
    store = sqlite3.connect(out / "fleet.sqlite")
    try:
        return dict(store.execute("SELECT m.name, r.state FROM mission m JOIN result r ON r.id = m.result").fetchall())
    finally:
        store.close()


def left_behind(out: Path, temporary: Path) -> list[str]:
    """What an audit that has ended leaves in its working folder and in the folder for temporary files."""
    found = [path for path in (out / ".work").iterdir() if path.name != "claims"] if (out / ".work").is_dir() else []
    return [path.name for path in (*found, *temporary.glob("mfhca-*"))]


def children_of(pid: int) -> list[int]:
    """Processes that a process has started and that are there."""
    out = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            out += [int(word) for word in path.read_text(encoding="ascii").split()]
        except OSError:
            continue
    return out


def below(pid: int) -> list[int]:
    """All processes below a process."""
    return [one for child in children_of(pid) for one in (child, *below(child))]


def still_there(pids: list[int], patience_s: float = 30.0) -> int:
    """How many of some processes do not end by themselves within a time."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end and any(map(_alive, pids)):
        time.sleep(0.05)
    return sum(map(_alive, pids))


def _alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
