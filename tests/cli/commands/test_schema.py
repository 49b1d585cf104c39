"""`mfhca schema`: one JSON document on stdout."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.main import run
from diagnosis.documents import DOCUMENTS, schema_of


@pytest.mark.parametrize("name", DOCUMENTS)
def test_schema_on_stdout(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["schema", name]) == 0
    seen = capsys.readouterr()
    assert json.loads(seen.out) == schema_of(name)
    assert seen.err == ""


def test_unknown_document_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["schema", "truth"]) == 2
    seen = capsys.readouterr()
    assert seen.out == ""
    assert "schema truth: no such document; the tool writes report, comparison" in seen.err


def test_saved_report_of_a_wrong_shape_ends_with_3(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("report.json").write_text(json.dumps({"schema": "mfhca-report/1", "log": []}), encoding="utf-8")
    assert run(["report", "report.json"]) == 3
    assert capsys.readouterr().err.startswith("error: report.json: ")
