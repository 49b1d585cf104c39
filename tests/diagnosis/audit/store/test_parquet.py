from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest

from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.outcome import Outcome
from diagnosis.audit.store.parquet import export
from diagnosis.audit.store.store import Store
from diagnosis.audit.store.summary import summarise
from replay.errors import OutputError

TABLES = ["mission", "file", "repair", "result", "attempt", "fault", "component"]


def test_tables_with_the_missions_names(
    tmp_path: Path,
    make_mission: Callable[..., MissionSource],
    make_key: Callable[..., Key],
    make_report: Callable[..., dict[str, Any]],
) -> None:
    with Store.open(tmp_path / "audit" / "fleet.sqlite") as store:
        one, two, waiting = store.adopt([make_mission(name) for name in ("m1", "m2", "m3")])
        store.remember_hash(one.files[0], one.bytes, one.stamps[0], "aa")
        ok = Outcome("ok", summary=summarise(make_report()))
        store.record(one, make_key("old"), Outcome("crashed", "signal 9"), None)
        store.record(one, make_key("a"), ok, "missions/m1")
        stored = store.lookup(make_key("a"))
        assert stored is not None
        store.reuse(two, stored)
        written = export(store, tmp_path / "tables")
    assert [p.stem for p in written] == TABLES
    table = {p.stem: pd.read_parquet(p) for p in written}
    assert list(table["mission"]["name"]) == ["m1", "m2", waiting.name]
    assert list(table["result"]["mission"]) == ["m1", "m2"]
    assert "id" not in table["result"]
    assert set(table["result"]["state"]) == {"ok"}
    assert list(table["fault"]["mission"]) == ["m1", "m2"]
    assert list(table["fault"]["fault"]) == ["F1", "F1"]
    assert len(table["component"]) == 8
    joined = table["component"].merge(table["result"], on="mission")
    assert joined["epsilon"].notna().sum() == 2


def test_an_empty_store_gives_empty_tables_of_the_same_columns(tmp_path: Path) -> None:
    with Store.open(tmp_path / "fleet.sqlite") as store:
        written = export(store, tmp_path)
        export(store, tmp_path)
    assert {p.stem: pq.read_table(p).num_rows for p in written} == dict.fromkeys(TABLES, 0)
    assert pq.read_schema(tmp_path / "result.parquet").field("start_ns").type == "int64"
    assert sorted(p.name for p in tmp_path.glob(".*")) == []


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "tables").write_bytes(b"")
    with Store.open(tmp_path / "fleet.sqlite") as store, pytest.raises(OutputError, match="cannot be written"):
        export(store, tmp_path / "tables")
