"""Time of opening an MCAP file and of reading a window of one topic; run as `python tests/benchmarks/opening.py`.

The large file has many topics of random bytes, so that only its index matters; windows are read from the log of
`reading.py`, 1200 s long unless told otherwise. Files are made once and kept in the folder. All times are wall and CPU
milliseconds, medians, after one run that fills the caches; peers that are not installed are left out.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).resolve().parent)]

import numpy as np  # noqa: E402
from reading_logs import log_at  # noqa: E402

from replay.log.reading_notes import Report  # noqa: E402
from replay.log.source_options import SourceOptions  # noqa: E402
from replay.readers.mcap import reader as ours  # noqa: E402
from replay.readers.mcap.chunk import open_chunk  # noqa: E402
from replay.readers.mcap.opening import open_file  # noqa: E402
from replay.readers.mcap.scan import Tally, walk  # noqa: E402
from replay.readers.registry import read_log, summarise_log  # noqa: E402

TOPICS = 40
TOPIC = "/cmd_vel_stamped"


def large(folder: Path, gigabytes: float) -> Path:
    """Return a file of that size, made now unless it is there already."""
    from mcap.writer import CompressionType, Writer

    path = folder / f"large_{gigabytes:g}.mcap"
    if path.exists():
        return path
    draft, noise = path.with_suffix(".part"), np.random.default_rng(1).bytes(1 << 20)
    with draft.open("wb") as file:
        writer = Writer(file, chunk_size=768 << 10, compression=CompressionType.NONE)
        writer.start()
        text = b"float64 data"
        channels = [
            writer.register_channel(f"/topic_{i}", "cdr", writer.register_schema(f"p/msg/T{i}", "ros2msg", text))
            for i in range(TOPICS)
        ]
        for k in range(int(gigabytes * 1e9 / 4096)):
            place = k * 997 % (len(noise) - 4096)
            writer.add_message(channels[k % TOPICS], k * 1_000_000, noise[place : place + 4096], k * 1_000_000)
        writer.finish()
    return draft.rename(path)


def timed(what: str, run: Callable[[], Any], repeats: int) -> dict[str, Any]:
    """Median of the wall and CPU time of a call [ms]."""
    run()
    wall, cpu = [], []
    for _ in range(repeats):
        begin, start = time.perf_counter(), time.process_time()
        run()
        wall.append(1e3 * (time.perf_counter() - begin))
        cpu.append(1e3 * (time.process_time() - start))
    row = {"what": what, "wall_ms": round(statistics.median(wall), 2), "cpu_ms": round(statistics.median(cpu), 2)}
    print(f"{row['wall_ms']:10.2f} wall {row['cpu_ms']:10.2f} CPU  {what}", file=sys.stderr, flush=True)
    return row


def peer_windows(path: Path, window: tuple[int, int]) -> dict[str, Callable[[], int]]:
    """Peers that read a window of one topic, message by message; each returns how many it decoded."""
    runs: dict[str, Callable[[], int]] = {}
    try:
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory

        def with_mcap() -> int:
            with path.open("rb") as file:
                reader = make_reader(file, decoder_factories=[DecoderFactory()])
                times: Any = {"starting_at": window[0], "ending_before": window[1]}
                return sum(1 for _ in reader.iter_decoded_messages([TOPIC], log_time_order=False, **times))

        runs["mcap + mcap-ros2-support"] = with_mcap
    except ImportError:
        print("mcap-ros2-support is not installed; left out", file=sys.stderr)
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        def with_rosbags() -> int:
            with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
                mine = [c for c in reader.connections if c.topic == TOPIC]
                return sum(
                    1 for c, _, raw in reader.messages(mine, window[0], window[1]) if reader.deserialize(raw, c.msgtype)
                )

        runs["rosbags"] = with_rosbags
    except ImportError:
        print("rosbags is not installed; left out", file=sys.stderr)
    return runs


def places(path: Path) -> dict[str, Callable[[], Any]]:
    """Two ways to find the messages of one opened chunk: a scan over its records, and its message indexes."""
    file = open_file(path, Report(), walk=True)
    row = len(file.chunks) // 2
    chunk = open_chunk(file, row)
    assert chunk is not None
    data = chunk.data.copy()
    first, after = (int(n) for n in file.chunks[row : row + 2, :1].ravel())
    rows = walk(file.data, first, after, np.zeros(1 << 16, np.uint8), Tally()).rows[1:]

    def scan() -> int:
        census = file.scanner.census(data, 0, len(data))
        return sum(len(g.body) for g in file.scanner.collect(data, 0, census, census.counts > 0, None))

    def index() -> int:
        count = 0
        for _, start, stop, _ in rows.tolist():
            pairs = file.data[start + 15 : stop].view(np.dtype("<u8").newbyteorder("=")).reshape(-1, 2)
            at = pairs[:, 1].astype(np.int64)
            heads = np.ndarray((len(data) - 30,), "V31", data, strides=(1,))[at]
            dtype = np.dtype(
                {"names": ["size", "publish"], "formats": ["<u8", "<u8"], "offsets": [1, 23], "itemsize": 31}
            )
            found = heads.view(dtype)
            count += len(found["size"] - 22) + 0 * len(found["publish"].astype(np.int64))
        return count

    assert scan() == index()
    return {"chunk: messages found by scanning": scan, "chunk: messages found by its indexes": index}


def main() -> None:
    """Measure and print one JSON document."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()), help="where the logs are kept")
    parser.add_argument("--gigabytes", type=float, default=2.0, help="size of the large file")
    parser.add_argument("--duration", type=float, default=1200.0, help="length of the log with windows [s]")
    parser.add_argument("--repeats", type=int, default=7, help="runs of which the median is taken")
    parser.add_argument("--peers", action="store_true", help="read windows with other libraries as well")
    choice = parser.parse_args()
    rows, options = [], SourceOptions()
    path = large(choice.folder, choice.gigabytes)
    size = f"{path.stat().st_size / 1e9:.2f} GB"
    rows.append(timed(f"open {size} by its summary", lambda: ours.open_files([path], path, Report()), choice.repeats))
    rows.append(timed(f"summarise {size}", lambda: summarise_log(path, options), choice.repeats))
    rows.append(timed(f"walk {size}", lambda: ours.open_files([path], path, Report(), walk=True), choice.repeats))
    log = log_at(choice.folder, "mcap-zstd", choice.duration)
    begin = summarise_log(log, options).start_ns + int(choice.duration / 2) * 10**9
    for span in (0.5, 5.0, 50.0):
        window = (begin, begin + int(span * 1e9))
        what = f"{span:g} s of one topic out of {choice.duration:g} s"
        rows.append(timed(what, lambda w=window: read_log(log, options, [TOPIC], window=w), choice.repeats))  # type: ignore[misc]
        if choice.peers and span <= 5:
            rows += [timed(f"{what}: {name}", run, 3) for name, run in peer_windows(log, window).items()]
    rows += [timed(name, run, 50) for name, run in places(log).items()]
    print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
