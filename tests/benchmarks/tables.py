"""Speed of reading tables, in megabytes of text per second of CPU; run as `python tests/benchmarks/tables.py`.

Tables are made once and kept in the folder: TwinCAT Scope exports in both default dialects (the tool's with a TAB, a
decimal comma, a full header and groups of different lengths; the dialog's with a comma and a point), plain tables, packed
ones, and Parquet. Each reading takes place after one that fills the caches; medians. Peers parse the same plain tables
with one thread: pandas, polars and pyarrow; those that are not installed are left out. `--memory` adds the peak of a
process before and after it reads the table once (Linux), and what its columns take.
"""

from __future__ import annotations

import argparse
import gzip
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

os.environ["POLARS_MAX_THREADS"] = "1"
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
import pyarrow as pa  # noqa: E402
import pyarrow.csv as pa_csv  # noqa: E402
import pyarrow.parquet as pq  # noqa: E402

from replay.export.formats.twincat import ScopeGroup, write_scope  # noqa: E402
from replay.log.source_options import SourceOptions  # noqa: E402
from replay.readers.registry import open_log, read_log, summarise_log  # noqa: E402

KINDS = ("scope_tool", "scope_dialog", "plain", "comma", "short", "gzip", "zstd", "parquet")
_ONE_RUN = """
import re, sys
sys.path.insert(0, sys.argv[3])
from pathlib import Path
from replay.readers.registry import read_log
from replay.log.source_options import SourceOptions
peak = lambda: int(re.search(r"VmHWM:\\s*(\\d+)", Path("/proc/self/status").read_text())[1]) / 1024
read_log(Path(sys.argv[2]), SourceOptions())  # loads the compiled parser
before = peak()
log = read_log(Path(sys.argv[1]), SourceOptions())
seen = {id(a): a.nbytes for c in log.channels.values() for a in (c.stamps, c.values)}
print(before, peak(), sum(seen.values()) / 2**20)
"""


def walks(rows: int, columns: int) -> list[np.ndarray[Any, np.dtype[np.float64]]]:
    """Random walks as a PLC records them: full doubles, and some with three decimals."""
    source = np.random.default_rng(1)
    found = [np.cumsum(source.normal(size=rows)) * 0.01 for _ in range(columns)]
    return [np.round(x, 3) if i % 4 == 3 else x for i, x in enumerate(found)]


def make(folder: Path, kind: str, megabytes: float) -> Path:
    """Return a table of about that size of text, made now unless it is there already."""
    suffix = {"gzip": "csv.gz", "zstd": "csv.zst", "parquet": "parquet"}.get(kind, "csv")
    path = folder / f"{kind}_{megabytes:g}.{suffix}"
    if path.exists():
        return path
    rows, columns = int(megabytes * 1e6 / (60 if kind == "short" else 200)), 10
    values, draft = walks(rows, columns), path.with_suffix(".part")
    if kind == "short":
        values = [np.round(x, 2) for x in values]
    if kind == "scope_tool":
        names = [f"MAIN.fbWheel[{i}].fVelocity" for i in range(columns)]
        stamps = 1_700_000_000_000_000_000 + np.arange(rows) * 1_000_000
        fast = ScopeGroup(1.0, names[:8], ["rpm"] * 8, stamps, values[:8])
        slow = ScopeGroup(5.0, names[8:], ["bar"] * 2, stamps[::5], [v[::5] for v in values[8:]])
        write_scope(draft, [fast, slow])
        return draft.rename(path)
    table = pa.table({"time": np.arange(rows) * 0.001} | {f"channel {i}": v for i, v in enumerate(values)})
    if kind == "parquet":
        pq.write_table(table, draft, compression="zstd")
        return draft.rename(path)
    sink = pa.BufferOutputStream()
    mark = ";" if kind == "comma" else ","
    options = pa_csv.WriteOptions(delimiter=mark, quoting_style="none", include_header=kind != "scope_dialog")
    pa_csv.write_csv(table, sink, options)
    text = sink.getvalue().to_pybytes()
    if kind == "comma":
        text = text.replace(b".", b",")
    if kind == "scope_dialog":
        head = [
            "Name,Scope",
            "File,x.tcscopex",
            "Starttime of export,133000000000000000,a,b",
            "Endtime of export,133000000000000000,a,b",
        ]
        head += ["", "", ",".join(["Name", *(f"channel {i}" for i in range(columns))]), "", ""]
        text = "\n".join(head).encode() + text
    if kind == "gzip":
        text = gzip.compress(text, 6, mtime=0)
    if kind == "zstd":
        text = pa.compress(text, "zstd", asbytes=True)
    draft.write_bytes(text)
    return draft.rename(path)


def text_size(path: Path, kind: str) -> float:
    """Megabytes of text in a table; of Parquet, of its cells."""
    if kind == "parquet":
        meta = pq.read_metadata(path)
        return float(meta.num_rows * meta.num_columns * 8 / 1e6)
    if kind in ("gzip", "zstd"):
        with pa.CompressedInputStream(pa.OSFile(str(path)), kind) as stream:
            return sum(len(piece) for piece in iter(lambda: stream.read(1 << 20), b"")) / 1e6
    return path.stat().st_size / 1e6


def peers(path: Path, kind: str) -> dict[str, Callable[[], Any]]:
    """Readings of a plain table by others, with one thread."""
    if kind not in ("plain", "comma", "short"):
        return {}
    mark, decimal = (";", ",") if kind == "comma" else (",", ".")
    found: dict[str, Callable[[], Any]] = {}
    if importlib.util.find_spec("pandas"):
        import pandas as pd

        found["pandas"] = lambda: pd.read_csv(path, sep=mark, decimal=decimal)
    if importlib.util.find_spec("polars"):
        import polars as pl

        found["polars"] = lambda: pl.read_csv(path, separator=mark, decimal_comma=kind == "comma")
    found["pyarrow"] = lambda: pa_csv.read_csv(
        path,
        pa_csv.ReadOptions(use_threads=False),
        pa_csv.ParseOptions(delimiter=mark),
        pa_csv.ConvertOptions(decimal_point=decimal),
    )
    return found


def timed(run: Callable[[], Any], repeats: int) -> tuple[float, float]:
    """Median CPU and wall seconds."""
    run()
    cpu, wall = [], []
    for _ in range(repeats):
        before, start = time.process_time(), time.perf_counter()
        run()
        cpu.append(time.process_time() - before)
        wall.append(time.perf_counter() - start)
    return statistics.median(cpu), statistics.median(wall)


def main() -> None:
    """Measure and print one line of JSON per reading."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"tables to read: {', '.join(KINDS)} (default: all)")
    parser.add_argument("--megabytes", type=float, default=100.0, help="size of the text (default 100)")
    parser.add_argument("--repeats", type=int, default=5, help="readings per median (default 5)")
    parser.add_argument(
        "--folder", type=Path, default=Path(tempfile.gettempdir()) / "mfhca-tables", help="for the tables"
    )
    parser.add_argument("--memory", action="store_true", help="measure the memory of a reading process, too")
    options = parser.parse_args()
    unknown = sorted(set(options.kinds) - set(KINDS))
    if unknown:
        parser.error(f"unknown KIND {', '.join(unknown)}")
    options.folder.mkdir(parents=True, exist_ok=True)
    for kind in options.kinds or KINDS:
        path = make(options.folder, kind, options.megabytes)
        size = text_size(path, kind)
        runs: dict[str, Callable[[], Any]] = {
            "read": partial(read_log, path, SourceOptions()),
            "summary": partial(summarise_log, path, SourceOptions()),
            "matches": partial(open_log, path),
            **peers(path, kind),
        }
        for what, run in runs.items():
            cpu, wall = timed(run, options.repeats)
            row = {"table": kind, "what": what, "mb": round(size, 1), "cpu_s": round(cpu, 4), "wall_s": round(wall, 4)}
            print(json.dumps(row | {"mb_per_cpu_s": round(size / cpu)}), flush=True)
        if options.memory:
            small = make(options.folder, kind, 0.1)
            command = [sys.executable, "-c", _ONE_RUN, str(path), str(small), str(ROOT)]
            said = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
            names = ("before_mib", "peak_mib", "columns_mib")
            print(
                json.dumps(
                    {"table": kind, "what": "memory"} | {n: round(float(x)) for n, x in zip(names, said, strict=True)}
                )
            )


if __name__ == "__main__":
    main()
