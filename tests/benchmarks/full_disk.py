"""What an audit does on a disk that is full at any moment; run as root: `python tests/benchmarks/full_disk.py [--sizes N]`.

Short missions are audited on a file system in memory, of each of N sizes between one page and what the audit needs, with events and
exported tables on it too. It has to end with one sentence and code 2. Then the disk gets room: what was acknowledged must
stand in the store, whole, and the next audit does exactly the rest.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from audit import _again, _ended, _lost, command, simulate

_PAGE = 4096
_AMPLE = 1 << 30


def mount(place: Path, size: int, *, again: bool = False) -> None:
    options = f"{'remount,' if again else ''}size={size}"
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)], check=True)


def unmount(place: Path) -> None:
    subprocess.run(["umount", str(place)], check=True)


def used(place: Path) -> int:
    told = subprocess.run(["stat", "-f", "-c", "%b %f", str(place)], capture_output=True, text=True, check=True)
    whole, free = map(int, told.stdout.split())
    return (whole - free) * _PAGE


def audit_into(place: Path, logs: Path) -> tuple[int, list[str]]:
    """Exit code, and what stands on stderr."""
    words = [
        str(logs),
        "-o",
        str(place / "out"),
        "-j",
        "2",
        "--events",
        str(place / "events.jsonl"),
        "--export",
        "parquet",
    ]
    done = subprocess.run(command(*words, "--fail-on", "never", "-q"), capture_output=True, text=True, check=False)
    return done.returncode, done.stderr.splitlines()


def _settled(events: Path) -> int:
    """Missions that ended, or whose result was there already when the store had lost its own."""
    told = [json.loads(line) for line in events.read_text(encoding="utf-8").splitlines()]
    return len({one["name"] for one in told if one["event"] in ("mission", "skipped")})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, default=20)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mfhca-benchmark-") as name:
        logs, place = Path(name) / "logs", Path(name) / "disk"
        logs.mkdir()
        place.mkdir()
        for i in range(4):
            simulate(logs / f"m{i}.mcap", 12.0, 100.0, 700 + i)
        mount(place, _AMPLE)
        first, lines = audit_into(place, logs)
        needed = used(place)
        unmount(place)
        print(f"with room: code {first}, {needed / 2**20:.1f} MB")
        stopped = wrong = 0
        for k in range(given.sizes):
            size = _PAGE + (needed - _PAGE) * k // given.sizes // _PAGE * _PAGE
            mount(place, size)
            try:
                code, lines = audit_into(place, logs)
                mount(place, _AMPLE, again=True)
                stopped += code == 2
                off = code not in (first, 2) or (code == 2 and len(lines) != 1)
                lost, told = _lost(place / "out", place / "events.jsonl"), len(_ended(place / "events.jsonl"))
                code_again, lines_again = audit_into(place, logs)
                done, again = _settled(place / "events.jsonl"), _again(place / "events.jsonl")
                off = off or bool(lost or again) or code_again != first or done < 4
                left = [p.name for p in (place / "out" / ".work").iterdir() if p.name != "claims"]
            finally:
                unmount(place)
            if off or left:
                wrong += 1
                print(
                    f"{size} bytes: code {code}, {told} acknowledged, {lost} lost, then code {code_again}, {done} done, {again} again, left {left}"
                )
                print(*lines, *lines_again, sep="\n  ")
        print(f"full disk: {given.sizes} sizes, {stopped} audits stopped, {wrong} wrong")


if __name__ == "__main__":
    if sys.platform != "linux":
        sys.exit("needs Linux, and the right to mount file systems")
    main()
