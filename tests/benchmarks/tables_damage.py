"""What libraries make of tables that our reader must read; run as `python tests/benchmarks/tables_damage.py`.

Each case is a text as recorders and damage leave it. One line of JSON per case and peer says whether the peer's columns
equal those of our reader bit for bit, else what differs. Speed of the same peers: `tests/benchmarks/tables.py`.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402
import pyarrow.csv as pa_csv  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from replay.log.source_options import SourceOptions  # noqa: E402
from replay.readers.registry import read_log  # noqa: E402

Columns = dict[str, NDArray[np.float64]]
_ROWS = [f"{t / 1000},{t},{float(np.sin(t))!r}" for t in range(2000)]
_HEAD = "time,count,value"


def _with(row: int, text: str) -> str:
    return "\n".join([_HEAD, *_ROWS[:row], text, *_ROWS[row + 1 :]]) + "\n"


CASES = {
    "sound": _with(0, _ROWS[0]),
    "exact decimals": _with(0, _ROWS[0]).replace("0.84", "0.840000000000000000001"),
    "a cell of text": _with(1500, "1.5,1500,#ERR"),
    "a word for nothing": _with(1500, "1.5,1500,n. def."),
    "German infinity": _with(1500, "1.5,1500,-unendlich"),
    "a row too long": _with(1500, "1.5,1500,0.5,7,8"),
    "a row too short": _with(1500, "1.5,1500"),
    "an empty line": _with(1500, ""),
    "NUL bytes in a row": _with(1500, "1.5,\0\0\0,0.5"),
    "whole numbers that turn real": _with(1999, "1.999,0.25,0.5"),
    "cut in a number": "\n".join([_HEAD, *_ROWS]) + "\n2.0,20",
    "a quote that nothing closes": _with(1500, '1.5,"1500,0.5'),
    "decimal comma": _with(0, _ROWS[0]).replace(",", ";").replace(".", ","),
    "number beyond 64 bits": _with(1500, "1.5,123456789012345678901234,0.5"),
}


def ours(text: str) -> Columns:
    """Columns of our reader; the first is that of its stamps."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        path.write_bytes(text.encode())
        log = read_log(path, SourceOptions())
    return {c.name.rpartition("/")[2]: np.asarray(c.values, np.float64) for c in log.channels.values()}


def by_pandas(text: str) -> Columns:
    """Pandas' C parser."""
    mark = ";" if ";" in text else ","
    decimal = "," if mark == ";" else "."
    frame = pd.read_csv(BytesIO(text.encode()), sep=mark, decimal=decimal)
    return {n: frame[n].to_numpy(np.float64) for n in ("count", "value")}


def by_pandas_skipping(text: str) -> Columns:
    """The same without rows that are too long."""
    mark = ";" if ";" in text else ","
    frame = pd.read_csv(
        BytesIO(text.encode()), sep=mark, decimal="," if mark == ";" else ".",
        on_bad_lines="skip",
    )  # fmt: skip
    return {n: pd.to_numeric(frame[n], errors="coerce").to_numpy(np.float64) for n in ("count", "value")}


def by_pyarrow(text: str) -> Columns:
    """PyArrow's parser, without rows that do not fit."""
    mark = ";" if ";" in text else ","
    table = pa_csv.read_csv(
        BytesIO(text.encode()),
        parse_options=pa_csv.ParseOptions(delimiter=mark, invalid_row_handler=lambda _: "skip"),
        convert_options=pa_csv.ConvertOptions(decimal_point="," if mark == ";" else "."),
    )
    return {n: table[n].to_numpy().astype(np.float64) for n in ("count", "value")}


PEERS: dict[str, Callable[[str], Columns]] = {
    "pandas": by_pandas, "pandas, rows skipped": by_pandas_skipping, "pyarrow, rows skipped": by_pyarrow,
}  # fmt: skip


def difference(mine: Columns, theirs: Columns) -> str:
    """What differs between columns, or that they are the same."""
    for name in ("count", "value"):
        a, b = mine[name], theirs[name]
        if len(a) != len(b):
            return f"{name}: {len(b)} rows instead of {len(a)}"
        if not np.array_equal(a, b, equal_nan=True):
            return f"{name}: {int(np.sum((a != b) & ~(np.isnan(a) & np.isnan(b))))} cells differ"
    return "same"


def main() -> None:
    """Print one line per case and peer."""
    for case, text in CASES.items():
        mine = ours(text)
        for peer, read in PEERS.items():
            try:
                said = difference(mine, read(text))
            except Exception as error:  # whatever a library raises is its answer
                said = f"{type(error).__name__}: {str(error).splitlines()[0][:80]}"
            print(json.dumps({"case": case, "peer": peer, "columns": said}), flush=True)


if __name__ == "__main__":
    main()
