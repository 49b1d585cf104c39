"""Write a counterfactual: page, JSON and time series, all of them or none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import orjson
import pyarrow as pa
import pyarrow.parquet as pq

from diagnosis.counterfactual.columns import world_columns
from diagnosis.counterfactual.page import build_counterfactual_page
from diagnosis.counterfactual.run import CounterfactualResult
from diagnosis.results.json_text import dump_json
from diagnosis.results.result import to_json
from replay.atomic_write import atomic_paths, made_folder

HTML, JSON, PARQUET = "counterfactual.html", "counterfactual.json", "counterfactual.parquet"


def write_counterfactual(result: CounterfactualResult, folder: Path) -> tuple[Path, ...]:
    """Write ``counterfactual.html``, ``.json`` and ``.parquet`` into a folder, which is made if absent.

    Raises
    ------
    OutputError
        Where the folder cannot be written.
    """
    columns = world_columns(result.abducted, result.wheels, result.worlds, result.proof)
    paths = tuple(folder / name for name in (HTML, JSON, PARQUET))
    page = build_counterfactual_page(result.document, columns, result.abducted, result.wheels)
    with made_folder(folder), atomic_paths(*paths) as (html, document, table):
        shown = {k: pa.array(v if k == "t" else v.astype(np.float32)) for k, v in columns.items()}
        with table.open("wb") as file:
            pq.write_table(pa.table(shown), file, compression="zstd", use_dictionary=False, use_byte_stream_split=True)
        document.write_bytes(dump_json(to_json(result.document), orjson.OPT_INDENT_2) + b"\n")
        html.write_text(page, encoding="utf-8", newline="\n")
    return paths
