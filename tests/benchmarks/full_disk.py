"""What an audit does on a disk that is full at any moment; run as root: `python tests/benchmarks/full_disk.py [--sizes N]`.

Short missions are audited on a file system in memory, of each of N sizes between one page and what the audit needs, with events and
exported tables on it too. It has to end with one sentence and code 2. Then the disk gets room: what was acknowledged must
stand in the store, whole, and the next audit does exactly the rest.

Then the folder for temporary files alone is that small, with a mission that needs it: such an audit ends with 2, 3 or as with room, never with
70, and the next one with room does the rest.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import zstandard
from audit_runs import command, ended, ended_twice, left_behind, lost, short_missions, told

_PAGE = 4096
_AMPLE = 1 << 30
_TEMPORARY = 1 << 21
_MISSIONS = 4


def mount(place: Path, size: int, *, again: bool = False) -> None:
    options = f"{'remount,' if again else ''}size={size}"
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)], check=True)


def unmount(place: Path) -> None:
    subprocess.run(["umount", str(place)], check=True)


def used(place: Path) -> int:
    told = subprocess.run(["stat", "-f", "-c", "%b %f", str(place)], capture_output=True, text=True, check=True)
    whole, free = map(int, told.stdout.split())
    return (whole - free) * _PAGE


def audit_into(out: Path, events: Path, logs: Path, temporary: Path | None = None) -> tuple[int, list[str]]:
    """Exit code, and what stands on stderr."""
    words = [str(logs), "-o", str(out), "-j", "2", "--events", str(events), "--export", "parquet"]
    environment = {**os.environ, "TMPDIR": str(temporary)} if temporary else None
    done = subprocess.run(
        command(*words, "--fail-on", "never", "-q"), capture_output=True, text=True, check=False, env=environment
    )
    return done.returncode, done.stderr.splitlines()


def settled(events: Path) -> int:
    """Missions that ended, or whose result was there already when the store had lost its own."""
    return len({one["name"] for one in told(events) if one["event"] in ("mission", "skipped")})


def sizes_of(needed: int, count: int) -> list[int]:
    """Sizes of a disk from one page to nearly what is needed [bytes]."""
    return [_PAGE + (needed - _PAGE) * k // count // _PAGE * _PAGE for k in range(count)]


def full_output(place: Path, logs: Path, sizes: int) -> int:
    """Output on a small disk; how often anything was wrong."""
    out, events = place / "out", place / "events.jsonl"
    mount(place, _AMPLE)
    first, lines = audit_into(out, events, logs)
    needed = used(place)
    unmount(place)
    print(f"with room: code {first}, {needed / 2**20:.1f} MB")
    stopped = wrong = 0
    for size in sizes_of(needed, sizes):
        mount(place, size)
        try:
            code, lines = audit_into(out, events, logs)
            mount(place, _AMPLE, again=True)
            stopped += code == 2
            off = code not in (first, 2) or (code == 2 and len(lines) != 1)
            gone, acknowledged = lost(out, events), len(ended(events))
            code_again, lines_again = audit_into(out, events, logs)
            done, again = settled(events), ended_twice(events)
            off = off or bool(gone or again) or code_again != first or done < _MISSIONS
            left = left_behind(out, place)
        finally:
            unmount(place)
        if off or left:
            wrong += 1
            print(
                f"{size} bytes: code {code}, {acknowledged} acknowledged, {gone} lost, then code {code_again}, {done} done, "
                f"{again} again, left {left}"
            )
            print(*lines, *lines_again, sep="\n  ")
    print(f"full disk: {sizes} sizes, {stopped} audits stopped, {wrong} wrong", flush=True)
    return wrong


def full_temporary(place: Path, folder: Path, logs: Path, sizes: int) -> int:
    """Folder for temporary files on a small disk; how often anything was wrong."""
    codes, wrong = list[int](), 0
    for k, size in enumerate(sizes_of(_TEMPORARY, sizes)):
        out, events = folder / f"out{k}", folder / f"events{k}.jsonl"
        mount(place, size)
        try:
            code, lines = audit_into(out, events, logs, place)
            gone = lost(out, events) if events.is_file() else 0
            mount(place, _AMPLE, again=True)
            code_again, lines_again = audit_into(out, events, logs, place)
            left = left_behind(out, place)
        finally:
            unmount(place)
        codes.append(code)
        crashed = sum(one.get("state") == "crashed" for one in told(events))
        if code not in (0, 2, 3) or code_again != 0 or gone or crashed or left:
            wrong += 1
            print(
                f"temporary files, {size} bytes: code {code}, {gone} lost, {crashed} crashed, then code {code_again}, left {left}"
            )
            print(*lines, *lines_again, sep="\n  ")
    print(f"full folder for temporary files: {sizes} sizes, codes {sorted(codes)}, {wrong} wrong")
    return wrong


def main() -> int:
    """Fill, audit, make room, audit again."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, default=20)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mfhca-benchmark-") as name:
        folder = Path(name)
        logs, place = short_missions(folder / "logs", _MISSIONS, 700), folder / "disk"
        place.mkdir()
        wrong = full_output(place, logs, given.sizes)
        packed = folder / "packed"  # each is expanded into the folder for temporary files
        packed.mkdir()
        for log in logs.iterdir():
            (packed / f"{log.name}.zstd").write_bytes(zstandard.compress(log.read_bytes()))
        wrong += full_temporary(place, folder, packed, given.sizes)
    return bool(wrong)


if __name__ == "__main__":
    if sys.platform != "linux":
        sys.exit("needs Linux, and the right to mount file systems")
    sys.exit(main())
