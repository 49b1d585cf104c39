"""What the tool itself wrote: saved results, truth files, and an audit's store with its result objects."""

from __future__ import annotations

import io
import json
import random
import sqlite3
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pyarrow as pa
import pyarrow.parquet as pq

from diagnosis.audit.fleet_files import write_fleet
from diagnosis.audit.store.ingest import ingest
from diagnosis.audit.store.store import FILE_NAME, Store
from diagnosis.comparison.compare import compare_reports
from diagnosis.evaluation.excitation import read_speeds
from diagnosis.output import load_report, rebuild, write_result
from diagnosis.results.result import MissionResult
from replay.border import UnforeseenContent
from replay.errors import ConfigError, LogError, MfhcaError
from replay.truth import read_truth
from tests import fleet_samples, report_samples
from tests.benchmarks.fuzzing import json_tree, sqlite_file
from tests.benchmarks.fuzzing.case import Case, Finding, Reading, Sample
from tests.benchmarks.fuzzing.damage import blindly

_REBUILT = 0.25  # of the documents that pass: a page takes a tenth of a second


class Results:
    """Folders of results: their document, their columns; and truth files."""

    name = "results"

    def corpus(self, folder: Path) -> list[Sample]:
        """A result with five faults, and a truth."""
        report, columns = report_samples.five_faults(20.0, 20.0)
        write_result(MissionResult(report, columns), folder)
        files = {f"r/{p.name}": p.read_bytes() for p in folder.iterdir() if p.suffix != ".html"}
        document = json.loads(files["r/report.json"])
        facts = {"document": document, "paths": json_tree.paths(document)}
        truth: dict[str, Any] = {"schema": "mfhca-truth/1", "wheels": ["FR"], "rate_hz": 100.0, "start_ns": 10**18, "duration_s": 60.0, "slip": [], "intervals": [
            {"component": "FR", "kind": "wheel", "side": "sensor", "mode": "stuck", "start_s": 1.0, "stop_s": 2.0, "epsilon": 1.0, "sat_mean": 0.0, "sat_std": 0.0},
        ]}  # fmt: skip
        return [
            Sample("document", files, "r", "r/report.json", facts),
            Sample("columns", files, "r", "r/report.parquet"),
            Sample("truth", {"a.truth.json": json.dumps(truth).encode()}, "a.truth.json", "a.truth.json", {"document": truth, "paths": json_tree.paths(truth)}),
        ]  # fmt: skip

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Another document, or blind damage."""
        if sample.name == "columns" and source.random() < 0.7:
            return Case(*other_columns(sample.raw, source))
        if "document" not in sample.facts or source.random() < 0.15:
            return Case(*blindly(sample.raw, source))
        return Case(*json_tree.damaged(sample.facts["document"], sample.facts["paths"], source))

    def read(self, path: Path, source: random.Random) -> Reading:
        """Load the document, compare it with a sound one, make the page again."""
        try:
            if path.is_file():
                return Reading("whole", read_truth(path))
            report = load_report(path / "report.json")
            orjson.dumps(compare_reports(report, report, ("a", "b"), force=True).__class__.__name__)
            read_speeds(path / "report.parquet", report["machine"]["wheels"])
            if source.random() < _REBUILT:
                rebuild(path)
            return Reading("whole", report)
        except UnforeseenContent as error:
            raise Finding("foreign", str(error)) from error
        except (LogError, ConfigError) as error:
            text = str(error)
            if ".json" not in text and ".parquet" not in text and "machine" not in text:
                raise Finding("shape", f"a message that names no file: {text[:300]!r}") from error
            return Reading("refused", None, (text,))

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """Nothing to compare with."""


def other_columns(raw: bytes, source: random.Random) -> tuple[bytes, str]:
    """Columns of other types, lengths, names or values, in a sound table."""
    table, done = pq.read_table(io.BytesIO(raw)), []
    for _ in range(source.choice((1, 1, 2, 4))):
        k = source.randrange(table.num_columns) if source.random() < 0.7 else 0
        name, values = table.column_names[k], table.column(k).to_numpy()
        values = values if values.dtype.kind in "fiu" else np.arange(len(values))
        count = len(values)
        with np.errstate(all="ignore"):
            halved, tiny, nothing = values.astype(np.float16), values.astype(np.int8), values * 0
        odd = (
            pa.array(["x"] * count), pa.nulls(count), pa.array([None if i % 3 else float(i) for i in range(count)]), pa.array([[1.0]] * count),
            pa.array([{"a": 1.0}] * count), pa.array([True] * count), pa.array([2**63 + 5] * count, pa.uint64()), pa.array(np.arange(count), pa.timestamp("ns")),
            pa.array(values[::-1]), pa.array(nothing), pa.array(np.full(count, source.choice((np.nan, np.inf, 1e300, -1.0)))), pa.array(halved),
            pa.array([b"x"] * count), pa.array(tiny), pa.array(np.full(count, 1, np.int64)).cast(pa.decimal128(19)),
        )  # fmt: skip
        way = source.random()
        with np.errstate(all="ignore"):
            if way < 0.6:
                table = table.set_column(k, name, source.choice(odd))
            elif way < 0.7:
                table = table.set_column(
                    k, source.choice((*table.column_names, "", "x", "t", "\x1b[31m")), table.column(k)
                )
            elif way < 0.8 and table.num_columns > 1:
                table = table.remove_column(k)
            elif way < 0.9:
                table = table.slice(0, source.choice((0, 1, 2, count // 2)))
            else:
                table = table.append_column(name, table.column(k))
        done.append(name)
        if not table.num_columns or not table.num_rows:
            break
    pq.write_table(table, out := io.BytesIO())
    return out.getvalue(), f"columns {', '.join(done)}"


class AuditStore:
    """The store of an audit, opened, read, and summed up as a page; and result objects taken into a new one."""

    name = "store"

    def corpus(self, folder: Path) -> list[Sample]:
        """A small fleet, and result objects."""
        path = fleet_samples.write_store(folder / FILE_NAME, fleet_samples.few()[::4])
        with sqlite3.connect(path) as link:
            link.execute("pragma wal_checkpoint(truncate)")
            link.execute("pragma journal_mode = delete")
        link.close()
        document = _object()
        name = f"results/{'a' * 8}-{'c' * 8}-1.0-1.json"
        facts = {"document": document, "paths": json_tree.paths(document)}
        return [
            Sample("store", {FILE_NAME: path.read_bytes()}, FILE_NAME, FILE_NAME),
            Sample("object", {name: json.dumps(document).encode()}, "results", name, facts),
        ]

    def damaged(self, sample: Sample, source: random.Random) -> Case:
        """Structure of the database, rows that no audit writes, other documents, or blind damage."""
        if source.random() < 0.2:
            return Case(*blindly(sample.raw, source))
        if "document" in sample.facts:
            return Case(*json_tree.damaged(sample.facts["document"], sample.facts["paths"], source))
        if source.random() < 0.4:
            with tempfile.TemporaryDirectory() as folder:
                return Case(*sqlite_file.rewritten(sample.raw, Path(folder), source))
        return Case(*sqlite_file.damaged(sample.raw, source))

    def read(self, path: Path, source: random.Random) -> Reading:
        """Open the store as an audit does, and make the fleet's page."""
        try:
            if path.is_dir():
                with Store.open(path.parent / FILE_NAME) as store:
                    found = ingest(store)
                if found.attempts:
                    write_fleet(path.parent, path.parent)
                return Reading("refused" if found.problems else "whole", found, found.problems)
            with Store.open(path) as store:
                store.begin_run()
                store.missions()
                store.counts()
            write_fleet(path.parent, path.parent)
            return Reading("whole")
        except MfhcaError as error:
            text = str(error)
            if FILE_NAME not in text and "results" not in text:
                raise Finding("shape", f"a message that names no file: {text[:300]!r}") from error
            return Reading("refused", None, (text,))

    def check(self, sample: Sample, case: Case, path: Path, reading: Reading) -> None:
        """Nothing to compare with."""


def _object() -> dict[str, Any]:
    """An attempt as an audit writes it."""
    result = {"machine_name": "Boom lift", "verdict": "watch", "title": "One fault.", "start_ns": 1_793_000_000 * 10**9, "duration_s": 60.0,
              "driving_s": 50.0, "decided_s": 40.0, "distance_m": 20.0, "open_loop": 0}  # fmt: skip
    fault = {"id": "F1", "component": "FR", "kind": "wheel", "side": "sensor", "mode": "stuck", "severity": "low", "start_s": 1.0, "stop_s": 2.0,
             "start_ns": 1_793_000_001 * 10**9, "epsilon": None, "epsilon_low": None, "epsilon_high": None, "sat": None, "sat_unit": None,
             "probability": 0.99}  # fmt: skip
    part = {"component": "FR", "side": "sensor", "driving_s": 50.0, "decided_s": 40.0, "healthy_s": 30.0, "faulty_s": 1.0, "worst": "stuck",
            "epsilon": None, "epsilon_low": None, "epsilon_high": None, "epsilon_s": None, "epsilon_relative": 0}  # fmt: skip
    return {
        "schema": "mfhca-audit-result/1", "made_ns": 1_793_000_100 * 10**9, "report": "missions/a", "machine_id": "HX-1",
        "mission": {"name": "a", "files": [{"path": "a.mcap", "size": 9, "stamp": "1", "sha256": "a" * 64}], "bytes": 9},
        "key": {"log_hash": "a" * 64, "config_hash": "c" * 64, "version": "1.0"},
        "attempt": {"number": 1, "state": "ok", "reason": "", "wall_s": 1.0, "cpu_s": 1.0, "peak_mb": 100.0},
        "summary": {"result": result, "faults": [fault], "components": [part]},
    }  # fmt: skip
