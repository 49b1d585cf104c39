"""`mfhca audit`: what it writes, prints and ends with, and that killing it costs nothing that was done."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cli.main import run
from diagnosis.audit.isolation.run import isolation
from replay.export.mission import write_mission
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from tests.campaigns import campaign

ROOT = Path(__file__).resolve().parents[3]
MFHCA = [sys.executable, "-m", "cli.main"]
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="children are forked on Linux")


@pytest.fixture(scope="session")
def logs(mission_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A mission with a fault, one that is cut short, and a file that is no log."""
    folder = tmp_path_factory.mktemp("fleet") / "yard 7"
    folder.mkdir()
    whole = mission_log.read_bytes()
    (folder / "drive.mcap").write_bytes(whole)
    (folder / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    (folder / "text.mcap").write_text("no log", encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def audited(logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("audits") / "out"
    events = out.with_name("events.jsonl")
    assert run(["audit", str(logs), "-o", str(out), "-q", "--events", str(events), "--export", "parquet"]) == 3
    return out


@pytest.fixture(scope="session", autouse=True)
def _no_server_left() -> Iterator[None]:
    yield
    for kind in ("", "fork-cold"):
        isolation(kind).close()


def document(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_every_mission_has_an_end_and_a_report_where_it_could_be_read(audited: Path, logs: Path) -> None:
    events = [json.loads(line) for line in audited.with_name("events.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [e["event"] for e in events][:3] == ["problem", "start", "planned"]
    assert events[0]["reason"].startswith("no machine file: ")
    assert events[-1]["event"] == "end"
    ends = {e["name"]: e for e in events if e["event"] == "mission"}
    assert {name: (e["state"], e["report"]) for name, e in ends.items()} == {
        "drive": ("ok", "missions/drive"),
        "cut": ("degraded", "missions/cut"),
        "text": ("unreadable", None),
    }
    assert "ends without a footer" in ends["cut"]["reason"]
    assert ends["drive"]["peak_mb"] > 0
    reports = [".key", "report.html", "report.json", "report.parquet"]
    assert sorted(p.name for p in (audited / "missions" / "drive").iterdir()) == reports
    assert (audited / "tables" / "result.parquet").is_file()
    command = (audited / "failures.txt").read_text(encoding="utf-8").splitlines()[1].strip()
    assert command == f"mfhca diagnose -v '{logs}/text.mcap' -o text-report"


def test_the_report_is_that_of_diagnose(audited: Path, logs: Path, tmp_path: Path) -> None:
    run(["diagnose", str(logs / "drive.mcap"), "-q", "-o", str(tmp_path), "--machine-id", "yard 7"])
    for name in ("report.json", "report.parquet"):
        assert (audited / "missions" / "drive" / name).read_bytes() == (tmp_path / name).read_bytes()


def test_again_it_finds_all_done(audited: Path, logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = {p: p.stat().st_mtime_ns for p in audited.rglob("*") if p.is_file() and "fleet" not in p.name}
    assert run(["audit", str(logs), "-o", str(audited), "--json"]) == 3
    found = document(capsys)
    assert (found["skipped"], found["counts"]) == (3, {"ok": 1, "degraded": 1, "unreadable": 1})
    assert found["code"] == 3
    drive = next(m for m in found["missions"] if m["name"] == "drive")
    assert (drive["verdict"], drive["machine_id"]) == ("stop", "yard 7")
    after = {p: p.stat().st_mtime_ns for p in before if p.name != "failures.txt"}
    assert after == {p: t for p, t in before.items() if p.name != "failures.txt"}


def test_the_summary_names_failures_first_and_the_page_last(
    audited: Path, logs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["audit", str(logs), "-o", str(audited)]) == 3
    shown, progress = capsys.readouterr()
    lines = shown.strip().splitlines()
    assert lines[0] == "Failed"
    fleet = json.loads((audited / "fleet.json").read_text(encoding="utf-8"))
    listed = [line for line in lines[lines.index("Machines, worst first") + 2 :] if line][: len(fleet["machines"])]
    for line, machine in zip(listed, fleet["machines"], strict=True):  # the same order, the same words
        assert line.startswith(machine["label"])
        assert machine["standing"].split(",")[0] in " ".join(line.split())
    assert lines[1].startswith("• unreadable  text  ")
    assert "fleet.html" in lines[-2]
    assert "failures.txt" in lines[-1]
    assert progress.startswith("note: no machine file: ")  # no terminal
    assert progress.count("\n") == 1


def test_dry_run_lists_what_is_to_do_and_writes_nothing(
    audited: Path, logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["audit", str(logs), "-o", str(tmp_path / "out"), "--dry-run", "--json"]) == 0
    assert {m["name"]: m["state"] for m in document(capsys)["missions"]} == dict.fromkeys(
        ("cut", "drive", "text"), "to do"
    )
    assert not (tmp_path / "out").exists()
    assert run(["audit", str(logs), "-o", str(audited), "--dry-run"]) == 0
    assert "3 missions, 0 to do (0 B)" in capsys.readouterr().out


def test_another_machine_file_audits_again(
    audited: Path, logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "machine.toml").write_text('[machine]\nid = "H7"\n', encoding="utf-8")
    words = ["audit", str(logs / "drive.mcap"), "-o", str(audited), "-m", str(tmp_path / "machine.toml")]
    run([*words, "--dry-run", "--json"])
    assert [m["state"] for m in document(capsys)["missions"]] == ["to do"]


def test_a_missing_path_is_an_error_also_when_quiet(
    audited: Path, logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    events = tmp_path / "events.jsonl"
    words = ["audit", "nope", str(logs / "drive.mcap"), "-o", str(audited), "-q", "--events", str(events)]
    assert run(words) == 3
    assert capsys.readouterr().err == "error: nope: no such file\n"
    told = [json.loads(line) for line in events.read_text(encoding="utf-8").splitlines()]
    assert next(e["reason"] for e in told if e["event"] == "problem") == "nope: no such file"
    assert run([*words, "--json"]) == 3
    assert document(capsys)["problems"][0] == "nope: no such file"
    assert run([*words, "--dry-run"]) == 3
    capsys.readouterr()
    assert run(["audit", "nope", "-q", "--json", "--events", str(events)]) == 3
    nothing = document(capsys)
    assert (nothing["code"], nothing["missions"], nothing["problems"]) == (3, [], ["nope: no such file"])
    last = [json.loads(line) for line in events.read_text(encoding="utf-8").splitlines()[-2:]]
    assert [e["event"] for e in last] == ["problem", "stopped"]


def test_a_mission_file_that_is_off_is_an_unreadable_mission(
    logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "tree" / "s").mkdir(parents=True)
    (tmp_path / "tree" / "s" / "a.mcap").write_bytes((logs / "drive.mcap").read_bytes())
    (tmp_path / "tree" / "s" / "mission.toml").write_text('machin_id = "AX-1"\n', encoding="utf-8")
    out = tmp_path / "out"
    for skipped in (0, 1):
        assert run(["audit", str(tmp_path / "tree"), "-o", str(out), "-q", "--json"]) == 3
        found = document(capsys)
        (mission,) = found["missions"]
        assert (mission["name"], mission["state"], mission["attempts"]) == ("s", "unreadable", 1)
        assert "'machin_id' is not a key" in mission["reason"]
        assert found["skipped"] == skipped
    failures = (out / "failures.txt").read_text(encoding="utf-8")
    assert failures.splitlines()[1].strip() == f"mfhca audit {tmp_path}/tree/s/mission.toml -o s-audit"
    assert "machin_id" in (out / "fleet.html").read_text(encoding="utf-8")
    (tmp_path / "tree" / "s" / "mission.toml").write_text('machine_id = "AX-1"\n', encoding="utf-8")
    assert run(["audit", str(tmp_path / "tree"), "-o", str(out), "-q", "--json"]) == 1
    assert [(m["name"], m["state"], m["machine_id"]) for m in document(capsys)["missions"]] == [("s", "ok", "AX-1")]


def test_a_copy_that_failed_names_its_own_file(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("AX-1", "AX-2"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "text.mcap").write_bytes((logs / "text.mcap").read_bytes())
    words = ["audit", str(tmp_path / "AX-1"), str(tmp_path / "AX-2"), "-o", str(tmp_path / "out"), "--machine-id", "7"]
    for skipped in (0, 2):
        assert run([*words, "-q", "--json"]) == 3
        found = document(capsys)
        assert found["skipped"] == skipped
        for mission, name in zip(found["missions"], ("AX-1", "AX-2"), strict=True):
            assert mission["reason"].startswith(f"{tmp_path}/{name}/text.mcap ")
        assert (tmp_path / "out" / "failures.txt").read_text(encoding="utf-8").count(f"{tmp_path}/AX-1/") == 2


def test_a_page_that_was_removed_is_made_again(audited: Path, logs: Path) -> None:
    page = audited / "missions" / "drive" / "report.html"
    before = page.read_bytes()
    page.unlink()
    events = audited.with_name("again.jsonl")
    assert run(["audit", str(logs / "drive.mcap"), "-o", str(audited), "-q", "--events", str(events)]) == 1
    told = [json.loads(line)["event"] for line in events.read_text(encoding="utf-8").splitlines()]
    assert (told.count("rebuilt"), told.count("skipped"), told.count("mission")) == (1, 1, 0)
    assert page.read_bytes() == before


def test_names_that_are_not_utf8(logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tree, out = tmp_path / "tr\udcffee", tmp_path / "out"
    tree.mkdir()
    for name in ("drive", "text"):
        (tree / f"{name}\udce9.mcap").write_bytes((logs / f"{name}.mcap").read_bytes())
    assert run(["audit", str(tree), "-o", str(out), "-q", "--events", "events.jsonl"]) == 3
    events = [json.loads(line) for line in Path("events.jsonl").read_text(encoding="utf-8").splitlines()]
    assert {e["state"]: e["files"] for e in events if e["event"] == "mission"} == {
        "ok": [f"{tmp_path}/tr\\udcffee/drive\\udce9.mcap"],
        "unreadable": [f"{tmp_path}/tr\\udcffee/text\\udce9.mcap"],
    }
    (report,) = out.glob("missions/*/report.json")
    assert "drive\\udce9.mcap" in json.loads(report.read_bytes())["log"]["files"][0]["path"]
    assert run(["diagnose", str(tree / "drive\udce9.mcap"), "-q"]) == 1
    assert run(["report", "drive\udce9-report", "-q"]) == 0


def test_an_id_in_the_machine_file_for_logs_of_several_folders_is_said(
    logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("AX-1", "AX-2"):
        (tmp_path / "tree" / name).mkdir(parents=True)
        (tmp_path / "tree" / name / "m.mcap").write_bytes((logs / "text.mcap").read_bytes())
    (tmp_path / "machine.toml").write_text('[machine]\nid = "H7"\n', encoding="utf-8")
    words = [
        "audit",
        str(tmp_path / "tree"),
        "-o",
        str(tmp_path / "out"),
        "-m",
        str(tmp_path / "machine.toml"),
        "--dry-run",
    ]
    assert run([*words, "--json"]) == 0
    shown = capsys.readouterr()
    assert shown.err.count("the id 'H7' makes one machine of the logs of 2 folders (AX-1, AX-2)") == 1
    assert len(json.loads(shown.out)["problems"]) == 1
    assert run([*words, "--machine-id", "H7", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["problems"] == []


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["audit"], 2, "no PATH is given"),
        (["audit", "nowhere"], 3, "no mission was found"),
        (["audit", "LOGS", "--json", "--events", "-"], 2, "both would write to stdout"),
        (["audit", "LOGS", "--export", "csv"], 2, "expected parquet"),
        (["audit", "LOGS", "-m", "nowhere.toml"], 2, "nowhere.toml"),
        (["audit", "LOGS", "-o", "LOGS/text.mcap"], 2, "text.mcap"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(
    words: list[str],
    code: int,
    text: str,
    logs: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run([w.replace("LOGS", str(logs)) for w in words]) == code
    shown = capsys.readouterr().err
    assert text in shown.splitlines()[-1]
    assert shown.splitlines()[-1].startswith("error: ")


def short_missions(folder: Path, count: int) -> Path:
    folder.mkdir()
    for seed in range(count):
        options = SimulationOptions(scenario="random", seed=seed, duration_s=12.0, rate_hz=100.0)
        write_mission(simulate_mission(options), folder / f"m{seed}.mcap", "mcap")
    return folder


def started(short: Path, out: Path, *words: str) -> subprocess.Popen[str]:
    def default() -> None:
        """Heed what a shell's background job, or one below nohup, ignores."""
        for ignored in (signal.SIGINT, signal.SIGHUP):
            signal.signal(ignored, signal.SIG_DFL)

    command = [*MFHCA, "audit", str(short), "-o", str(out), "--events", str(out.with_name("events.jsonl")), *words]
    return subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=default
    )


def acknowledged(out: Path) -> list[str]:
    path = out.with_name("events.jsonl")
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [e["name"] for e in map(json.loads, lines) if e["event"] == "mission"]


def until(condition: Any) -> None:
    end = time.monotonic() + 300  # a busy machine starts processes slowly
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def temporary_folders(folder: Path) -> list[str]:
    return [p.name for p in folder.glob("mfhca-*")]


@pytest.mark.parametrize("ends", campaign([(signal.SIGINT,), (signal.SIGINT, signal.SIGHUP, signal.SIGKILL)]), ids=len)
def test_ended_at_any_moment_it_goes_on_where_it_was(
    ends: tuple[signal.Signals, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    missions = 4 * len(ends)  # enough that audits that are ended do not finish them
    short, out = short_missions(tmp_path / "short", missions), tmp_path / "out"
    draw = random.Random(5)
    for asked in ends:
        before = len(acknowledged(out))
        with started(short, out, "-j", "1") as process:
            until(lambda done=before: len(acknowledged(out)) > done)
            time.sleep(draw.uniform(0.0, 0.2))
            os.kill(process.pid, asked)
            _, errors = process.communicate()
        if asked is not signal.SIGKILL:
            assert process.returncode == 130
            assert errors.splitlines()[-2:] == [
                "note: finished missions are kept; run the same command again to continue",
                "error: interrupted",
            ]
            assert [p.name for p in (out / ".work").iterdir()] == ["claims"]
            assert not temporary_folders(tmp_path)
    kept = acknowledged(out)
    assert len(kept) == len(set(kept))
    assert run(["audit", str(short), "-o", str(out), "--json"]) in (1, 3)
    found = document(capsys)
    assert sorted(m["name"] for m in found["missions"]) == sorted(f"m{i}" for i in range(missions))
    assert found["skipped"] >= len(kept)
    for mission in found["missions"]:
        json.loads((out / mission["report"] / "report.json").read_bytes())
    assert [p.name for p in (out / ".work").iterdir()] == ["claims"]
    until(lambda: not [p for p in temporary_folders(tmp_path) if p.startswith("mfhca-audit-")])


def test_one_date_holds_for_all_repairs_of_a_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--repaired", "A FL speed sensor", "--on", "2026-10-17", "--repaired", "B FR valve", "--on", "2026-10-22"]
    assert run(["audit", "-o", str(tmp_path), *asked]) == 2
    assert "--on: is given 2 times" in capsys.readouterr().err
