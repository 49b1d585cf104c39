"""Schemas written from the types: the documents of the sample missions keep them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import orjson
import pytest
from jsonschema import Draft202012Validator

from diagnosis.comparison.compare import compare_reports, comparison_json
from diagnosis.comparison.previous import with_previous
from diagnosis.documents import DOCUMENTS, schema_of
from diagnosis.output import load_report
from diagnosis.pipeline import diagnose
from diagnosis.results.document import ReportDocument
from replay.errors import ConfigError
from replay.machine.config import haulotte
from tests.campaigns import campaign
from tests.schemas import unknown_keys

SAMPLES = Path(__file__).resolve().parents[2] / "sample_logs"


@pytest.fixture(scope="module", params=campaign(["paper.mcap", "base.mcap", "healthy_ice.mcap", "spool.mcap"], 2))
def report(request: pytest.FixtureRequest) -> ReportDocument:
    return diagnose([SAMPLES / request.param], haulotte()).report


def plain(document: Any) -> Any:
    """As a reader of the file sees it."""
    return orjson.loads(orjson.dumps(document))


def places(document: Any, name: str) -> list[str]:
    """What the schema refuses in a document."""
    return [f"{e.json_path}: {e.message}" for e in Draft202012Validator(schema_of(name)).iter_errors(plain(document))]


@pytest.mark.parametrize("name", DOCUMENTS)
def test_schemas_are_schemas_with_words(name: str) -> None:
    schema = schema_of(name)
    Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert schema["$id"].startswith("urn:mfhca-")
    assert schema["title"].startswith(f"mfhca {name}, mfhca-")
    for title, definition in schema["$defs"].items():
        assert definition["title"] == title
        assert len(definition["description"]) > 10, title


def test_report_of_a_mission_keeps_the_schema(report: ReportDocument, tmp_path: Path) -> None:
    assert places(report, "report") == []
    schema = schema_of("report")
    assert unknown_keys(plain(report), schema, schema["$defs"]) == []
    (tmp_path / "report.json").write_bytes(orjson.dumps(report))
    assert orjson.dumps(load_report(tmp_path / "report.json")) == orjson.dumps(report)


def test_comparison_keeps_the_schema(report: ReportDocument) -> None:
    newer: ReportDocument = {**report, "intervals": report["intervals"][1:]}
    found = comparison_json(compare_reports(report, newer, ("a", "b")))
    assert places(found, "comparison") == []
    schema = schema_of("comparison")
    assert unknown_keys(plain(found), schema, schema["$defs"]) == []
    kept = with_previous(newer, report)
    assert places(kept, "report") == []
    schema = schema_of("report")
    assert unknown_keys(plain(kept), schema, schema["$defs"]) == []


def test_schema_refuses_what_is_wrong(report: ReportDocument) -> None:
    wrong = plain(report)
    wrong["verdict"]["status"] = "fine"
    wrong["coverage"][0]["driving_s"] = "long"
    assert [p.partition(":")[0] for p in places(wrong, "report")] == ["$.coverage[0].driving_s", "$.verdict.status"]


def test_a_document_that_the_tool_does_not_write() -> None:
    with pytest.raises(ConfigError, match=r"schema truth: no such document; the tool writes report, comparison"):
        schema_of("truth")
