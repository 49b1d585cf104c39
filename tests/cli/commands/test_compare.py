"""`mfhca compare`: what it prints, writes and ends with."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.main import run
from diagnosis.results.document import ReportDocument
from tests.whole_documents import whole_report


def report(*severities: str, start_s: int = 0, machine: str = "M-1") -> ReportDocument:
    intervals = [
        {
            "id": f"F{i}",
            "component": "FR",
            "kind": "wheel",
            "side": "sensor",
            "mode": mode,
            "start_s": 1.0,
            "stop_s": 4.0,
            "epsilon": {"value": 0.4, "low": 0.3, "high": 0.5},
            "probability": 0.99,
            "severity": severity,
            "tier": "direct",
        }
        for i, (mode, severity) in enumerate(zip(("noisy", "stuck"), severities, strict=False), 1)
    ]
    row = {"component": "FR", "side": "sensor", "tier": "direct", "driving_s": 60.0, "decided_driving_s": 60.0}
    error, effort = {"mission": None, "driving": 0.02 + start_s * 1e-6}, {"mission": None, "driving": None}
    given = {
        "log": {
            "files": [{"path": "drive.mcap", "sha256": str(start_s)}],
            "start_ns": (1_760_000_000 + start_s) * 10**9,
            "duration_s": 60.0,
        },
        "machine": {"name": "M [/]", "id": machine, "wheels": ["FR"]},
        "verdict": {"status": "watch" if severities else "ready", "title": "title [/]"},
        "intervals": intervals,
        "coverage": [row | {"seconds": {"healthy": 57.0, "noisy": 3.0}}],
        "metrics": {"average": {"tracking_error": error, "control_effort": effort}},
    }
    return whole_report(given)


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Reports of four missions in the current folder."""
    monkeypatch.chdir(tmp_path)
    for name, document in {
        "sound": report(),
        "noisy": report("low", start_s=1000),
        "both": report("low", "high", start_s=2000),
        "other": report("low", start_s=3000, machine="M-2"),
    }.items():
        Path(name).mkdir()
        (Path(name) / "report.json").write_text(json.dumps(document))
    return tmp_path


@pytest.mark.parametrize(
    ("older", "newer", "code"),
    [("sound", "noisy", 1), ("noisy", "noisy", 0), ("noisy", "both", 1), ("noisy", "sound", 0)],
)
def test_exit_codes(older: str, newer: str, code: int, results: Path) -> None:
    assert run(["compare", older, newer]) == code
    assert run(["compare", f"{older}/report.json", newer, "-q"]) == code


@pytest.mark.parametrize("width", [80, 120])
def test_the_table_fits_the_terminal(
    width: int, results: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    assert run(["compare", "noisy", "both"]) == 1
    out = capsys.readouterr().out
    assert out.startswith(" WORSE   Faults: 1 new, 1 unchanged\n")
    for words in ("New (1)", "FR speed sensor", "■ stuck", "high 3.0 s", "title [/]", "The same parts in both", "+5 %"):
        assert words in out
    assert max(len(line) for line in out.splitlines()) <= width


def test_missions_in_the_wrong_order_are_said(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", "noisy", "sound"]) == 0
    assert "sound was recorded before noisy" in capsys.readouterr().out


def test_json_is_one_document(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", "sound", "noisy", "--json", "-o", "page.html"]) == 1
    seen = capsys.readouterr()
    document = json.loads(seen.out)
    assert (document["schema"], document["worse"], document["counts"]["new"]) == ("mfhca-compare/1", True, 1)
    assert "Wrote page.html" in seen.err


def test_the_page_is_written_whole(results: Path) -> None:
    assert run(["compare", "sound", "noisy", "-o", "out/page.html"]) == 1
    assert [p.name for p in Path("out").iterdir()] == ["page.html"]
    assert "FR speed sensor" in Path("out/page.html").read_text(encoding="utf-8")


def test_a_page_never_replaces_a_result(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", "sound", "noisy", "-o", "sound/report.json"]) == 2
    assert "would be changed" in capsys.readouterr().err


def test_another_machine_is_refused_unless_forced(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", "noisy", "other"]) == 2
    assert capsys.readouterr().err == (
        "error: other: is of machine M-2, noisy of machine M-1; compare two missions of one machine, or add --force\n"
    )
    assert run(["compare", "noisy", "other", "--force"]) == 0


@pytest.mark.parametrize(
    ("words", "code", "reason"),
    [
        (["nowhere", "noisy"], 3, "no such file"),
        (["empty", "noisy"], 3, "holds no report.json"),
        (["drive.mcap", "noisy"], 3, "is not a report.json"),
        (["broken.json", "noisy"], 3, "not JSON"),
        (["noisy"], 2, "see `mfhca compare --help`"),
    ],
)
def test_what_cannot_be_read(
    words: list[str], code: int, reason: str, results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("empty").mkdir()
    Path("drive.mcap").write_text("x")
    Path("broken.json").write_text("{")
    assert run(["compare", *words]) == code
    assert reason in capsys.readouterr().err


def test_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", "--help"]) == 0
    out = capsys.readouterr().out
    assert "mfhca compare monday-report tuesday-report" in out
    assert "Exit codes: 0 nothing new or worse" in out
