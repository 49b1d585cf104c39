"""Cells of the table are what was found: quoted where they must be, and none that a spreadsheet runs."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from diagnosis.audit.fleet.table import fleet_csv
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from tests import fleet_samples as samples
from tests.fleet_samples import Fault, Sample


@pytest.mark.parametrize(
    ("name", "cell"),
    [
        ("plain 2026-11-01T07:30", "plain 2026-11-01T07:30"),
        ("lift, old", "lift, old"),
        ('lift "7"', 'lift "7"'),
        ("=1+1", "'=1+1"),
        ("-7", "'-7"),
        ("Kühllift", "Kühllift"),
        ("a\nb", "a\\x0ab"),
        ("a\x7f", "a\\x7f"),
    ],
)
def test_a_name_comes_back_as_one_cell(tmp_path: Path, name: str, cell: str) -> None:
    store = samples.write_store(tmp_path / "fleet.sqlite", [Sample("a", name), Sample("b", "other")])
    text = fleet_csv(fleet_json(load_fleet(store)))
    rows = {r["mission"]: r for r in csv.DictReader(io.StringIO(text))}
    assert rows["a"]["machine"] == cell
    assert rows["b"]["machine"] == "other"
    assert rows["b"]["driving_s"] == "1800.0"
    assert rows["b"]["start_utc"] == "2026-10-26 07:33:20"


def test_a_fault_of_unclear_kind_is_called_so_as_on_the_page(tmp_path: Path) -> None:
    found = [Fault("FR", "actuator", "inefficient", "medium", (0.5, 0.4, 0.6))]
    store = samples.write_store(tmp_path / "fleet.sqlite", [Sample("a", verdict="watch", faults=found)])
    document = fleet_json(load_fleet(store))
    (clear,) = csv.DictReader(io.StringIO(fleet_csv(document)))
    assert (clear["worst_mode"], clear["worst_epsilon"]) == ("inefficient", "0.5")
    document["missions"][0]["faults"][0]["unclear"] = True
    (unclear,) = csv.DictReader(io.StringIO(fleet_csv(document)))
    assert (unclear["worst_mode"], unclear["worst_epsilon"]) == ("faulty, kind unclear", "")
