"""Make a mission of hours by repeating a simulated one, and diagnose it under a memory limit.

    python tests/benchmarks/long_mission.py --hours 1 2 --evidence base direct

The simulated mission (``--piece`` seconds) is recorded once; its chunks are then repeated with later stamps, one second
apart, so that ten hours at 1 kHz are written in a minute. Wall and CPU time and the largest resident set of a child process
that runs the whole of `mfhca diagnose` are printed; divide two lengths by each other to see whether cost is linear.
The resident set counts pages of files that the system may drop at will; ``--limit`` shows what is really needed.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, ChunkIndex, DataEnd, Footer, MessageIndex
from mcap.stream_reader import StreamReader

_MAGIC = b"\x89MCAP0\r\n"
_SECOND = 1_000_000_000


def repeat(source: Path, target: Path, copies: int, shift_s: int) -> None:
    """Write a log that holds the messages of `source` `copies` times, each `shift_s` seconds later.

    Header stamps are moved too: of every message that starts with one, its seconds stand after the encapsulation.
    """
    records = list(StreamReader(source.open("rb"), emit_chunks=True).records)
    chunks = [r for r in records if isinstance(r, Chunk)]
    indexes = [r for r in records if isinstance(r, MessageIndex)]
    per_chunk = len(indexes) // len(chunks)
    head = [r for r in records if type(r).__name__ == "Header"]
    names = list({(type(r).__name__, r.id): r for r in records if type(r).__name__ in ("Schema", "Channel")}.values())
    plain = [
        np.frombuffer(zstandard.ZstdDecompressor().decompress(c.data, c.uncompressed_size), np.uint8) for c in chunks
    ]
    places = [_stamps(data) for data in plain]
    packer = zstandard.ZstdCompressor(level=1)
    with target.open("wb") as out:
        out.write(_MAGIC)

        def put(*items: object) -> int:
            builder = RecordBuilder()
            for item in items:
                item.write(builder)  # type: ignore[attr-defined]
            return out.write(builder.end())

        put(*head[:1], *names)
        listed: list[ChunkIndex] = []
        for copy in range(copies):
            ns, seconds = copy * shift_s * _SECOND, copy * shift_s
            for k, (chunk, data, (log, header)) in enumerate(zip(chunks, plain, places, strict=True)):
                moved = data.copy()
                for at in log:
                    _add(moved, at, "<u8", ns)
                _add(moved, header, "<u4", seconds)
                packed = packer.compress(moved.data)
                start, first, last = out.tell(), chunk.message_start_time + ns, chunk.message_end_time + ns
                size = put(Chunk("zstd", packed, last, first, zlib.crc32(moved), len(moved)))
                offsets, at = {}, out.tell()
                for index in indexes[k * per_chunk : (k + 1) * per_chunk]:
                    offsets[index.channel_id] = out.tell()
                    put(MessageIndex(index.channel_id, [(t + ns, o) for t, o in index.records]))
                listed.append(
                    ChunkIndex(size, start, "zstd", len(packed), last, out.tell() - at, offsets, first, len(moved))
                )
        put(DataEnd(0))  # no checksum over hours of data
        begin = out.tell()
        builder = RecordBuilder()
        for item in (*names, *listed):
            item.write(builder)
        summary = builder.end()
        out.write(summary)
        crc = zlib.crc32(summary + bytes([2]) + (20).to_bytes(8, "little") + begin.to_bytes(8, "little") + bytes(8))
        put(Footer(begin, 0, crc))
        out.write(_MAGIC)


def _stamps(data: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Places of log and publish stamps, and of the header seconds, in a chunk's bytes."""
    at, log, header = 0, [], []
    raw = data.tobytes()
    while at < len(raw):
        size = int.from_bytes(raw[at + 1 : at + 9], "little")
        if raw[at] == 5:
            log.append(at + 9 + 6)
            if (
                int.from_bytes(raw[at + 9 + 22 + 4 : at + 9 + 22 + 8], "little")
                == int.from_bytes(raw[at + 15 : at + 23], "little") // _SECOND
            ):
                header.append(at + 9 + 22 + 4)
        at += 9 + size
    places = np.array(log, np.int64)
    return (places, places + 8), np.array(header, np.int64)


def _add(data: np.ndarray, at: np.ndarray, kind: str, amount: int) -> None:
    width = np.dtype(kind).itemsize
    cells = at[:, None] + np.arange(width)
    data[cells] = (data[cells].copy().view(kind) + np.array(amount, kind)).view(np.uint8)


def _limited(gib: float) -> tuple[Path, list[str]]:
    """A control group that may use so much memory, caches of files included, and the command's words to enter it."""
    first = Path("/sys/fs/cgroup/memory")
    group = (first if first.is_dir() else Path("/sys/fs/cgroup")) / f"mfhca-{gib:g}"
    group.mkdir(exist_ok=True)
    file = "memory.limit_in_bytes" if first.is_dir() else "memory.max"
    (group / file).write_text(str(round(gib * 2**30)))
    return group, ["sh", "-c", f'echo $$ > {group}/cgroup.procs; exec "$@"', "sh"]


def _measure(log: Path, out: Path, limit: float | None) -> tuple[float, float, float, str]:
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    group, enter = (None, []) if limit is None else _limited(limit)
    command = [*enter, sys.executable, "-m", "cli.main", "diagnose", str(log), "-o", str(out), "--quiet"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    largest = anonymous = 0
    while child.poll() is None:
        try:
            fields = dict(line.split(":", 1) for line in Path(f"/proc/{child.pid}/status").read_text().splitlines())
            largest = max(largest, int(fields["VmRSS"].split()[0]))
            anonymous = max(anonymous, int(fields["RssAnon"].split()[0]))
        except (OSError, KeyError):
            pass
        time.sleep(0.05)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    said = child.stdout.read().strip() if child.stdout else ""
    if group is not None:
        said += f" (within {limit:g} GiB, caches included)"
        group.rmdir()
    rest = f"{anonymous / 2**20:.2f} GiB private, exit {child.returncode} {said}"
    return time.monotonic() - begun, cpu, largest / 2**20, rest


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, nargs="+", default=[1.0])
    parser.add_argument("--piece", type=int, default=599, help="length of the simulated mission [s]")
    parser.add_argument("--evidence", nargs="+", default=["base"], choices=["base", "spool", "direct"])
    parser.add_argument("--scenario", default="random", choices=["random", "healthy", "paper"])
    parser.add_argument("--seed", type=int, default=2000)
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "mfhca-long")
    parser.add_argument("--limit", type=float, metavar="GIB", help="run in a control group of that much memory (root)")
    parser.add_argument("--only-write", action="store_true")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    for evidence in options.evidence:
        piece = options.folder / f"{evidence}-{options.scenario}-{options.seed}-{options.piece}.mcap"
        if not piece.exists():
            simulate = [sys.executable, "-m", "cli.main", "simulate", "-o", str(piece), "--evidence", evidence, "-q"]
            simulate += ["--duration", str(options.piece), "--seed", str(options.seed), "--scenario", options.scenario]
            subprocess.run(simulate, check=True)
        for hours in options.hours:
            log = options.folder / f"{piece.stem}-{hours:g}h.mcap"
            if not log.exists():
                partial = log.with_suffix(".part")
                repeat(piece, partial, max(1, round(hours * 3600 / (options.piece + 1))), options.piece + 1)
                partial.rename(log)
            if not options.only_write:
                wall, cpu, rss, rest = _measure(log, options.folder / f"{log.stem}-report", options.limit)
                size = log.stat().st_size / 1e6
                print(
                    f"{evidence:6s} {hours:5g} h {size:6.0f} MB log: {wall:6.1f} s wall, {cpu:6.1f} s CPU, {rss:.2f} GiB, {rest}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
