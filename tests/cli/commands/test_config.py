"""`mfhca config`: the starter names every key with its default."""

from __future__ import annotations

import dataclasses
import json
import re
import tomllib
from pathlib import Path

import pytest

from cli.commands.config_init import starter
from cli.main import run
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.config import Control, Limits, Plant, WheelPlant, haulotte
from replay.machine.quantities import DOUBTED_UNITS, UNITS
from replay.machine.signal_table import CANONICAL
from replay.machine.toml_file import load_machine
from replay.machine.toml_text import dump_machine


def active(section: str) -> dict[str, object]:
    """Scalar keys of a section of the starter with their comment signs taken away."""
    body = starter().partition(f"[{section}]\n")[2].partition("\n[")[0]
    lines = re.findall(r"^(?:# )?(\w+ = .*)$", body, re.MULTILINE)
    return tomllib.loads("\n".join(line for line in lines if not line.startswith("FR = ")))


def test_the_starter_is_the_default_machine(tmp_path: Path) -> None:
    file = tmp_path / "machine.toml"
    file.write_text(starter(), encoding="utf-8")
    assert load_machine(file) == haulotte()


@pytest.mark.parametrize(("section", "kind"), [("control", Control), ("limits", Limits)])
def test_every_key_stands_in_the_starter_with_its_default(section: str, kind: type) -> None:
    written = active(section)
    defaults = {f.name.rstrip("_"): f.default for f in dataclasses.fields(kind)}  # type: ignore[arg-type]
    assert set(written) == set(defaults)
    assert {k: v for k, v in written.items() if k != "psi0"} == {k: v for k, v in defaults.items() if k != "psi0"}


def test_machine_and_geometry_of_the_starter_are_the_defaults(tmp_path: Path) -> None:
    machine, geometry, plant = active("machine"), active("geometry"), active("plant")
    assert plant == {f.name: getattr(haulotte().plant, f.name) for f in dataclasses.fields(Plant) if f.name != "wheels"}
    assert (machine["name"], machine["id"], tuple(machine["wheels"])) == (haulotte().name, "", haulotte().wheels)  # type: ignore[arg-type]
    file = tmp_path / "machine.toml"
    file.write_text("[geometry]\n" + "\n".join(f"{k} = {v}" for k, v in geometry.items()))
    assert load_machine(file) == haulotte()


@pytest.mark.parametrize("kind", [SourceOptions, SignalSource, WheelPlant])
def test_every_other_key_is_explained(kind: type) -> None:
    for field in dataclasses.fields(kind):  # type: ignore[arg-type]
        assert re.search(rf"\b{field.name}\b", starter()), field.name


def test_every_unit_is_named() -> None:
    last = starter().partition("# Units: ")[2]
    assert all(re.search(rf"(^|[ ,]){re.escape(u)}[ ,.]", last) for u in UNITS if u not in DOUBTED_UNITS)


def test_every_signal_is_named() -> None:
    text = starter().partition("# Names: ")[2].partition("# Units: ")[0].replace("#", " ")
    text = re.sub(r"\(.*?\)", "", text).strip().removesuffix(".")
    named = set()
    for group in re.split(r"[;]", text):
        prefix = ""
        for word in group.split():
            prefix, _, leaf = word.rpartition(".") if "." in word else (prefix, "", word)
            named.add(f"{prefix.partition('.')[0]}.{leaf}")
    assert named == {entry.kind for entry in CANONICAL}


def test_init_writes_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "machine.toml"
    assert run(["config", "init", "-o", str(file)]) == 0
    assert file.read_text(encoding="utf-8") == starter()
    assert run(["config", "init", "-o", str(file)]) == 2
    assert "exists and was not changed" in capsys.readouterr().err
    file.write_text("", encoding="utf-8")
    assert run(["config", "init", "--force", "-o", str(file)]) == 0
    assert file.read_text(encoding="utf-8") == starter()


def test_init_prints_without_a_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["config", "init"]) == 0
    assert capsys.readouterr().out == starter()


@pytest.mark.parametrize("words", [("init", "-o", "-"), ("show",)])
def test_a_file_on_stdout_is_printed_also_when_quiet(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["config", *words, "-q"]) == 0
    out = capsys.readouterr().out
    assert out
    tomllib.loads(out)


def test_show_gives_all_settings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["config", "show"]) == 0
    out = capsys.readouterr().out
    assert out == "# paper defaults\n" + dump_machine(haulotte())
    file = tmp_path / "all.toml"
    file.write_text(out, encoding="utf-8")
    assert load_machine(file) == haulotte()


def test_check_of_a_good_and_a_bad_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "machine.toml"
    file.write_text('[machine]\nname = "Crane"\n')
    assert run(["config", "check", str(file)]) == 0
    assert "Crane, wheels FR, FL, RR, RL" in " ".join(capsys.readouterr().out.split())
    file.write_text("[control]\nlambda = -1\n")
    assert run(["config", "check", str(file)]) == 2
    assert "control.lambda = -1 s/m is out of range" in " ".join(capsys.readouterr().err.split())


def test_check_against_a_log(mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "machine.toml"
    file.write_text('[signals]\n"cmd.v" = { topic = "/cmd_vel", field = "twist.linear.x" }\n')
    assert run(["config", "check", str(file), "--log", str(mission_log)]) == 0
    assert "/cmd_vel.twist.linear.x  (given)" in capsys.readouterr().out
    file.write_text('[signals]\n"cmd.v" = { topic = "/cmd_vel", field = "linear.x" }\n')
    assert run(["config", "check", str(file), "--log", str(mission_log), "--json"]) == 2
    seen = capsys.readouterr()
    assert json.loads(seen.out)["ok"] is False
    assert "cmd.v: the machine file names '/cmd_vel.linear.x'" in seen.err
