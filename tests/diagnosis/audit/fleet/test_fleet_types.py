"""The document of a fleet keeps its schema, and the schema knows every key of the document."""

from __future__ import annotations

from pathlib import Path

import orjson
import pytest
from jsonschema import Draft202012Validator

from diagnosis.audit.fleet_files import write_fleet
from diagnosis.documents import schema_of
from tests import fleet_samples as samples
from tests.fleet_samples import Sample
from tests.schemas import unknown_keys

EMPTY: list[Sample] = []


@pytest.mark.parametrize(
    ("missions", "earlier"),
    [(samples.few(), samples.few()[:40]), (samples.hostile(), samples.hostile()[1:]), (EMPTY, EMPTY)],
    ids=["few", "hostile", "empty"],
)
def test_documents_keep_their_schema(tmp_path: Path, missions: list[Sample], earlier: list[Sample]) -> None:
    store = samples.write_store(tmp_path / "fleet.sqlite", missions)
    before = samples.write_store(tmp_path / "before" / "fleet.sqlite", earlier)
    document = orjson.loads(write_fleet(store, tmp_path, baseline=before).json.read_bytes())
    schema = schema_of("fleet")
    assert [f"{e.json_path}: {e.message}" for e in Draft202012Validator(schema).iter_errors(document)] == []
    assert unknown_keys(document, schema, schema["$defs"]) == []


def test_a_wrong_type_has_its_place(tmp_path: Path) -> None:
    store = samples.write_store(tmp_path / "fleet.sqlite", samples.few())
    document = orjson.loads(write_fleet(store, tmp_path).json.read_bytes())
    document["machines"][1]["verdict"] = "perhaps"
    (error,) = Draft202012Validator(schema_of("fleet")).iter_errors(document)
    assert error.json_path == "$.machines[1].verdict"
