"""Exit codes and the one line on stderr of every way a run can end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from cli import main
from cli.main import app, run
from cli.terminal import interrupts
from replay.errors import ConfigError, LogError, NotJudged, OutputError

MFHCA = [sys.executable, "-m", "cli.main"]
ROOT = Path(__file__).resolve().parents[2]


def crash_with(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def show(*_: object) -> None:
        raise error

    monkeypatch.setattr("cli.commands.config.machine_of", show)


def only_line(text: str) -> str:
    lines = text.splitlines()
    assert len(lines) == 1, text
    return lines[0]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["nope"], 2, "No such command 'nope'"),
        (["diagnose"], 2, "Missing argument 'LOG'"),
        (["diagnose", "a.mcap", "--bad"], 2, "--bad"),
        (["diagnose", "a.mcap", "--fail-on", "huge"], 2, "'huge' is not one of"),
        (["diagnose", "a.mcap", "--start", "soon"], 2, "--start"),
        (["diagnose", "absent.mcap"], 3, "absent.mcap: no such file"),
        (["diagnose", "*.mcap"], 3, "*.mcap: no such file; give each file"),
        (["channels", "absent.mcap"], 3, "absent.mcap: no such file"),
        (["inspect", "absent.mcap"], 3, "absent.mcap: no such file"),
        (["replay", "absent.mcap", "-o", "x.csv"], 3, "absent.mcap: no such file"),
        (["report", "absent"], 3, "absent: no such file"),
        (["config", "check", "absent.toml"], 2, "absent.toml: cannot read the machine file"),
        (["simulate", "--fault", "FR sensor broken 1 2"], 2, "mode 'broken' is not known"),
        (["simulate", "-o", "x.foo"], 2, "cannot tell the format"),
        (["simulate", "--ice", "5"], 2, "ice = 5"),
    ],
)
def test_bad_input_is_one_line_and_its_exit_code(
    arguments: list[str],
    code: int,
    words: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == code
    seen = capsys.readouterr()
    assert seen.out == ""
    assert only_line(seen.err).startswith("error: ")
    assert words in seen.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (ConfigError("machine.toml: off"), 2),
        (OutputError("x: full"), 2),
        (LogError("a.mcap: torn"), 3),
        (NotJudged("a.mcap: nothing to judge"), 3),
        (PermissionError(13, "Permission denied", "a.mcap"), 3),
        (FileNotFoundError(2, "No such file or directory", "a.mcap"), 3),
        (OSError(28, "No space left on device"), 2),
        (RuntimeError("boom"), 70),
        (MemoryError(), 70),
        (RecursionError("deep"), 70),
        (KeyboardInterrupt(), 130),
        (typer.Abort(), 130),
    ],
)
def test_exit_code_of_every_error(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    crash_with(monkeypatch, error)
    monkeypatch.setattr(main, "discard", lambda stream: None)
    assert run(["config", "show"]) == code
    seen = capfd.readouterr()
    assert seen.out == ""
    assert only_line(seen.err).startswith("error: ")


def test_traceback_of_an_internal_error_with_verbose_alone(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    crash_with(monkeypatch, RuntimeError("boom"))
    assert run(["config", "show"]) == 70
    assert "Traceback" not in capsys.readouterr().err
    for arguments in (["-v", "config", "show"], ["config", "show", "-v"]):
        assert run(arguments) == 70
        err = capsys.readouterr().err
        assert "Traceback" in err
        assert err.splitlines()[-1] == "error: internal error: RuntimeError: boom"


def test_a_message_with_control_characters_stays_one_harmless_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    crash_with(monkeypatch, LogError("a\x1b[31m\nb\u202e.mcap [/red][link=http://x]: torn"))
    assert run(["config", "show"]) == 3
    assert only_line(capsys.readouterr().err) == "error: a [31m b .mcap [/red][link=http://x]: torn"


def test_help_lists_every_command_by_topic() -> None:
    seen = CliRunner().invoke(app, ["--help"])
    assert seen.exit_code == 0
    for word in ("diagnose", "report", "inspect", "channels", "replay", "simulate", "config", "Inspect logs:"):
        assert word in seen.output
    assert "130 interrupted" in seen.output


@pytest.mark.parametrize(
    "name", ["diagnose", "report", "inspect", "channels", "replay", "simulate", "config", "schema"]
)
def test_help_of_each_command_has_examples(name: str) -> None:
    seen = CliRunner().invoke(app, [name, "--help"])
    assert seen.exit_code == 0
    assert f"mfhca {name}" in seen.output.partition("Examples:")[2]


def test_the_list_of_commands_breaks_off_no_sentence() -> None:
    seen = CliRunner().invoke(app, ["--help"], terminal_width=80)
    assert seen.exit_code == 0
    assert "..." not in seen.output.partition("Diagnose:")[2]


def test_usage_leaves_out_arguments_that_are_only_refused() -> None:
    usage = CliRunner().invoke(app, ["compare", "--help"]).output.splitlines()[0]
    assert usage.endswith("compare [OPTIONS] {A} {B}")


def test_without_a_command_help_and_usage_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([]) == 2
    seen = capsys.readouterr()
    assert seen.out == ""
    assert "diagnose" in seen.err


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("mfhca-replay ")


def test_heavy_libraries_are_not_imported_for_help() -> None:
    heavy = "{'numpy', 'pandas', 'pyarrow', 'numba', 'plotly', 'scipy', 'mcap', 'rosbags', 'zoneinfo'}"
    code = f"import cli.main, sys; sys.exit(' '.join({heavy} & set(sys.modules)) or 0)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_reader_that_closes_the_pipe_is_no_error() -> None:
    with subprocess.Popen(
        [*MFHCA, "config", "show"], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        err = process.stderr.read()
    assert (process.returncode, err) == (0, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_full_output_is_said_and_no_internal_error() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*MFHCA, "config", "show"], cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert only_line(done.stderr) == "error: cannot write or read: No space left on device"


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize("asked", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_with_130_and_leaves_nothing_behind(asked: signal.Signals, tmp_path: Path) -> None:
    command = [*MFHCA, "simulate", "-v", "-o", str(tmp_path / "long.mcap"), "--duration", "100000"]
    # a shell's background job ignores interrupts, and so would what it starts
    default = partial(signal.signal, asked, signal.SIG_DFL)
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, preexec_fn=default) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == "simulating\n"
        process.send_signal(asked)
        rest = process.stderr.read()
    assert process.returncode == 130
    assert only_line(rest) == "error: interrupted"
    assert list(tmp_path.iterdir()) == []


_SWALLOWS = """
import os, signal, sys, ctypes
from pathlib import Path
import cli.commands.diagnose
from diagnosis import pipeline
from cli.main import main
from replay.progress import Progress, Stage

def diagnose(paths, machine, *, progress, **_):
    called = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal.{asked}))
    called()
    {after}

pipeline.diagnose = diagnose
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.argv = ["mfhca", "diagnose", sys.argv[1], "-o", sys.argv[2]]
main()
"""


@pytest.mark.turns("asked")
@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize("asked", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize(
    "after", ["progress(Progress(Stage.DECIDING)); print('goes on')", "raise RuntimeError('torn')"]
)
def test_an_interrupt_that_compiled_code_swallows_ends_the_run_too(asked: str, after: str, tmp_path: Path) -> None:
    log = tmp_path / "a.mcap"
    log.touch()
    code = _SWALLOWS.format(asked=asked, after=after)
    done = subprocess.run(
        [sys.executable, "-c", code, log, tmp_path / "out"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted\n")
    assert list(tmp_path.iterdir()) == [log]


def test_an_interrupt_swallowed_in_the_last_stage_is_told_at_the_end(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def swallowed(*_: object) -> None:
        with suppress(KeyboardInterrupt):
            interrupts._interrupt(signal.SIGINT, None)
        raise typer.Exit(1)

    monkeypatch.setattr("cli.commands.config.machine_of", swallowed)
    assert run(["config", "show"]) == 130
    assert only_line(capsys.readouterr().err) == "error: interrupted"
    monkeypatch.undo()
    assert run(["config", "show"]) == 0


def test_no_colours_without_a_terminal_or_with_no_color() -> None:
    done = subprocess.run([*MFHCA, "nope"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "\x1b" not in done.stderr


def test_a_package_that_an_update_asks_for_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing(*_: object) -> None:
        raise ModuleNotFoundError("No module named 'newcomer'", name="newcomer.part")

    monkeypatch.setattr("cli.commands.config.machine_of", missing)
    assert run(["config", "show"]) == 70
    shown = capsys.readouterr().err
    assert "the package newcomer.part is not installed" in shown
    assert "internal error" not in shown
