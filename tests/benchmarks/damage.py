"""Damage MCAP files and count what comes back, here and with mcap and rosbags; `python tests/benchmarks/damage.py`.

Several files with known messages are cut off, get single bits flipped, and are damaged in crafted ways. Every message
that a reader gives is compared with what was written, byte by byte: topic, log and publish stamps, payload. Peers keep
the messages that they gave before they raised. A result is *silent* where nothing was said though a message is missing
or wrong; in a file without checksums a changed value cannot be noticed, there our log says ``integrity: unverifiable``.
One JSON document on stdout; every failure of ours is printed with the seed that repeats it.
"""

from __future__ import annotations

import argparse
import json
import struct
import sys
import tempfile
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag2 import ReaderError
from rosbags.typesys import Stores, get_typestore

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.mcap import reader as ours
from replay.readers.registry import read_log, summarise_log

STORE = get_typestore(Stores.LATEST)
TOPICS = (("/speed", "std_msgs/msg/Float64", 1), ("/scan", "std_msgs/msg/Float64MultiArray", 5))
T0 = 1_760_000_000_000_000_000
FILES: dict[str, dict[str, Any]] = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "none": {"compression": CompressionType.NONE},
    "zstd unindexed": {
        "compression": CompressionType.ZSTD, "index_types": IndexType.NONE, "use_statistics": False,
        "use_summary_offsets": False, "repeat_channels": False, "repeat_schemas": False,
    },
    "zstd without checksums": {"compression": CompressionType.ZSTD, "enable_crcs": False},
    "none without checksums": {"compression": CompressionType.NONE, "enable_crcs": False},
    "unchunked, data checksum": {"use_chunking": False, "enable_data_crcs": True},
    "zstd, one chunk": {"compression": CompressionType.ZSTD, "chunk_size": 1 << 30},
    "lz4, one chunk": {"compression": CompressionType.LZ4, "chunk_size": 1 << 30},
    "unchunked": {"use_chunking": False, "enable_crcs": False, "use_statistics": False, "index_types": IndexType.NONE},
}  # fmt: skip
LONG = ("zstd, one chunk", "lz4, one chunk")  # of more messages, fewer of them damaged
CHECKED = (*LONG, "zstd", "lz4", "none", "zstd unindexed", "unchunked, data checksum")
Row = tuple[str, int, int, bytes]


def build(path: Path, options: dict[str, Any], count: int) -> Counter[Row]:
    """Write a file and return its messages."""
    rng, rows = np.random.default_rng(5), []
    with path.open("wb") as file:
        writer = Writer(file, **{"chunk_size": 4000, **options})
        writer.start("ros2", "benchmark")
        channels = []
        for topic, kind, _ in TOPICS:
            text = STORE.generate_msgdef(kind, ros_version=2)[0].encode()
            channels.append(writer.register_channel(topic, "cdr", writer.register_schema(kind, "ros2msg", text)))
        for i in range(count):
            for (topic, _, every), channel in zip(TOPICS, channels, strict=True):
                if i % every:
                    continue
                if topic == "/speed":
                    data = b"\0\1\0\0" + struct.pack("<d", i / 7)
                else:
                    data = b"\0\1\0\0" + struct.pack("<III", 0, 0, 12) + rng.normal(size=12).round(2).tobytes()
                stamp = T0 + i * 10_000_000
                writer.add_message(channel, stamp, data, stamp - 1000, sequence=i)
                rows.append((topic, stamp, stamp - 1000, data))
        writer.add_metadata("machine", {"id": "H-7"})
        writer.add_attachment(T0, T0, "a.bin", "application/octet-stream", bytes(range(50)))
        writer.finish()
    return Counter(rows)


def with_ours(path: Path) -> tuple[list[Row], bool, str]:
    """Messages, whether a loss was said, and the integrity that the log states."""
    report, rows = Report(), []
    opened = ours.open_files([path], path, report, walk=True)
    for blocks in ours.blocks_of(opened[0], None, None):
        for b in blocks:
            assert b.publish_ns is not None
            for at, size, log, publish in zip(b.starts, b.lengths, b.log_ns, b.publish_ns, strict=True):
                rows.append((b.connection.topic, int(log), int(publish), b.data[at : at + size].tobytes()))
    summary = ours.summary_of(opened, path, "mcap", report)
    return rows, bool(summary.damage), summary.metadata["integrity"]


def with_mcap(path: Path, streaming: bool, checked: bool, rows: list[Row]) -> None:
    """Gather what the mcap package gives, as the file lies or through its index."""
    with path.open("rb") as file:
        make: Any = NonSeekingReader if streaming else make_reader
        for _, channel, m in make(file, validate_crcs=checked).iter_messages(log_time_order=False):
            rows.append((channel.topic, m.log_time, m.publish_time, bytes(m.data)))


def with_rosbags(path: Path, rows: list[Row]) -> None:
    """Gather what rosbags gives; it has no publish stamps, so those that belong to the log stamps are put in."""
    with AnyReader([path], default_typestore=STORE) as reader:
        for connection, stamp, raw in reader.messages():
            rows.append((connection.topic, stamp, stamp - 1000, bytes(raw)))


PEERS: dict[str, tuple[Callable[[Path, list[Row]], None], tuple[type[Exception], ...]]] = {
    "mcap": (lambda p, r: with_mcap(p, False, False, r), (McapError,)),
    "mcap, streaming": (lambda p, r: with_mcap(p, True, False, r), (McapError,)),
    "mcap, streaming, checksums on": (lambda p, r: with_mcap(p, True, True, r), (McapError,)),
    "rosbags": (with_rosbags, (AnyReaderError, ReaderError)),
}
CHECKING = ["mcap, streaming, checksums on", "rosbags"]


class Score:
    """Counts of one reader over many damaged files."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()

    def add(self, got: Counter[Row], truth: Counter[Row], told: bool) -> int:
        right = sum((got & truth).values())
        wrong = sum((got - truth).values())
        self.counts["files"] += 1
        self.counts["messages right"] += right
        self.counts["messages wrong"] += wrong
        if not told:
            self.counts["wrong messages in silence"] += wrong
            self.counts["files silently wrong"] += wrong > 0
            self.counts["files silently short"] += wrong == 0 and right < sum(truth.values())
        return right


def mutations(raw: bytes, cuts: int, flips: int, seed: int) -> Iterator[tuple[str, bytes]]:
    """Files cut off at places spread over the whole, and files with one flipped bit."""
    for place in np.linspace(0, len(raw) - 1, cuts).astype(int).tolist():
        yield f"cut at {place}", raw[:place]
    rng = np.random.default_rng(seed)
    for _ in range(flips):
        place, bit = int(rng.integers(0, len(raw))), int(rng.integers(0, 8))
        changed = bytearray(raw)
        changed[place] ^= 1 << bit
        yield f"flip bit {bit} of byte {place}", bytes(changed)


def without_publish(got: Counter[Row], truth: Counter[Row]) -> int:
    """Right messages but for their publish stamps, which not every reader gives."""
    mine, theirs = (Counter((t, log, data) for t, log, _, data in rows.elements()) for rows in (got, truth))
    return sum((mine & theirs).values())


def judge(path: Path, name: str, what: str, truth: Counter[Row], scores: dict[str, Score]) -> dict[str, int]:
    """Read one damaged file with every reader; return the right messages of each."""
    right: dict[str, int] = {}
    for peer, (run, own) in PEERS.items():
        rows: list[Row] = []
        score, told = scores.setdefault(peer, Score()), True
        try:
            run(path, rows)
            told = False
        except own:
            score.counts["raised own error"] += 1
        except Exception:  # what users of the peer would see
            score.counts["raised another error"] += 1
        score.add(Counter(rows), truth, told)
        right[peer] = without_publish(Counter(rows), truth)
    score = scores.setdefault("ours", Score())
    rows, told, integrity = [], True, ""
    try:
        rows, told, integrity = with_ours(path)
        score.counts["degraded"] += told
    except LogError:
        score.counts["raised own error"] += 1
    except Exception as error:
        score.counts["raised another error"] += 1
        print(f"{name}, {what}: {type(error).__name__}: {error}", file=sys.stderr)
    got = Counter(rows)
    score.add(got, truth, told)
    right["ours"] = without_publish(got, truth)
    if got != truth and not told:
        covered = integrity != "unverifiable"
        score.counts["silent although checksums were said to hold"] += covered
        if covered or right["ours"] < sum(truth.values()) - 1:
            print(
                f"{name}, {what}: silent, {right['ours']} right, {sum((got - truth).values())} wrong", file=sys.stderr
            )
    for kind, peers in (("any peer", list(PEERS)), ("any peer that checks checksums", CHECKING)):
        best = max(right[peer] for peer in peers)
        if right["ours"] < best:
            score.counts[f"files with fewer right than {kind}"] += 1
            score.counts[f"messages fewer than {kind}"] += best - right["ours"]
            if peers is CHECKING:
                print(f"{name}, {what}: {right}", file=sys.stderr)
    return right


def whole_way(path: Path) -> str:
    """Read the damaged file as users do; the kind of a foreign error, or nothing."""
    try:
        summarise_log(path, SourceOptions())
        read_log(path, SourceOptions())
        read_log(path, SourceOptions(), ["/scan"], window=(T0, T0 + 10**9))
    except LogError:
        return ""
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return ""


def reseal(raw: bytes) -> bytes:
    """Give a changed summary its right checksum."""
    (start,) = struct.unpack_from("<Q", raw, len(raw) - 28)
    return raw[:-12] + struct.pack("<I", zlib.crc32(raw[start:-12])) + raw[-8:]


def records(raw: bytes, start: int = 8) -> list[tuple[int, int, int]]:
    """Opcode, start and end of the records of a sound file."""
    found, at = [], start
    while at + 9 <= len(raw) - 8:
        end = at + 9 + int.from_bytes(raw[at + 1 : at + 9], "little")
        found.append((raw[at], at, end))
        at = end
    return found


def crafted(raw: bytes) -> Iterator[tuple[str, bytes]]:
    """Damage that a random flip seldom makes."""
    parts = records(raw)
    of = {op: [(a, b) for o, a, b in parts if o == op] for op in range(1, 16)}
    yield "empty", b""
    yield "magic only", raw[:8]
    yield "header only", raw[: parts[0][2]]
    yield "garbage tail", raw + np.random.default_rng(1).bytes(3000)
    middle = parts[len(parts) // 3][1]
    yield "garbage between records", raw[:middle] + np.random.default_rng(2).bytes(3000) + raw[middle:]
    yield "zeros over the last third", raw[: 2 * len(raw) // 3] + bytes(len(raw) // 3)
    yield "a hole of 600 bytes", raw[: len(raw) // 2] + raw[len(raw) // 2 + 600 :]
    yield "600 bytes overwritten", raw[: len(raw) // 2] + bytes([0xA5] * 600) + raw[len(raw) // 2 + 600 :]
    yield "footer missing", raw[:-37]
    if of[6]:
        start, end = of[6][len(of[6]) // 2]
        for op in (0, 7, 0x86, 0x46):
            yield f"opcode of a chunk is {op:#x}", raw[:start] + bytes([op]) + raw[start + 1 :]
        yield "length of a chunk", raw[: start + 1] + (2**40).to_bytes(8, "little") + raw[start + 9 :]
        yield "declared size of a chunk", raw[: start + 25] + (2**40).to_bytes(8, "little") + raw[start + 33 :]
        yield "compression of a chunk", raw[: start + 41] + b"q" + raw[start + 42 :]
        yield "cut inside a chunk", raw[: (start + end) // 2]
    if of[8]:
        start, end = of[8][len(of[8]) // 2]
        gone = raw[:start] + raw[end:]
        footer = gone.rindex(b"\x02\x14\0\0\0\0\0\0\0")
        no_offsets = gone[: footer + 17] + bytes(8) + gone[footer + 25 :]
        yield "a chunk index deleted, sealed again", reseal(no_offsets)
        double = raw[:start] + raw[start:end] * 2 + raw[end:]
        footer = double.rindex(b"\x02\x14\0\0\0\0\0\0\0")
        yield "a chunk listed twice, sealed again", reseal(double[: footer + 17] + bytes(8) + double[footer + 25 :])
        elsewhere = raw[: start + 25] + struct.pack("<Q", 1000) + raw[start + 33 :]
        yield "an index that points elsewhere, sealed again", reseal(elsewhere)
    if of[11]:
        start = of[11][0][0]
        yield "other statistics, sealed again", reseal(raw[: start + 9] + struct.pack("<Q", 7) + raw[start + 17 :])
    at = raw.find(b"float64 data")
    if at >= 0:
        yield "one bad definition", raw[: at + 3] + b"\0\0\0" + raw[at + 6 :]
        yield "definition of a service", raw[:at] + b"\n---\nf data" + raw[at + 10 :]


def main() -> None:
    """Run the campaign and print one JSON document."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cuts", type=int, default=1000, help="truncations over all files")
    parser.add_argument("--flips", type=int, default=10_000, help="flipped bits over all files")
    parser.add_argument("--seed", type=int, default=2000, help="seed of the flips")
    parser.add_argument("--messages", type=int, default=250, help="messages of the faster topic in each file")
    choice = parser.parse_args()
    warnings.simplefilter("ignore")
    out: dict[str, Any] = {}
    share = len(FILES)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        for k, (name, options) in enumerate(FILES.items()):
            times = 16 if name in LONG else 1
            truth = build(path, options, choice.messages * times)
            raw = path.read_bytes()
            kinds: dict[str, dict[str, Score]] = {}
            foreign: Counter[str] = Counter()
            cases = list(mutations(raw, choice.cuts // share, choice.flips // share // times, choice.seed + k))
            for i, (what, content) in enumerate(cases):
                path.write_bytes(content)
                judge(path, name, what, truth, kinds.setdefault(what.split()[0], {}))
                if i % 5 == 0 and (kind := whole_way(path)):
                    foreign[kind] += 1
            table = {}
            for what, content in crafted(raw):
                path.write_bytes(content)
                table[what] = judge(path, name, what, truth, kinds.setdefault("crafted", {}))
                if kind := whole_way(path):
                    foreign[kind] += 1
            out[name] = {
                "bytes": len(raw), "messages": sum(truth.values()), "checksums": name in CHECKED,
                **{what: {r: dict(s.counts) for r, s in scores.items()} for what, scores in kinds.items()},
                "crafted, messages right": table, "foreign errors on the whole way": dict(foreign),
            }  # fmt: skip
            print(f"{name}: {len(cases)} done", file=sys.stderr, flush=True)
    totals: dict[str, Counter[str]] = {}
    for result in out.values():
        for what in ("cut", "flip", "crafted"):
            for reader, counts in result.get(what, {}).items():
                totals.setdefault(reader, Counter()).update(counts)
    print(json.dumps({"totals": totals, "files": out}, indent=1))


if __name__ == "__main__":
    main()
