"""What is written where, and that text from logs cannot steer the terminal."""

from __future__ import annotations

import json
import sys

import pytest
from rich.text import Text

from cli.terminal import console
from cli.terminal.console import Terminal
from cli.terminal.streams import clean
from replay.progress import Progress, Stage


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain ε̂ = 1", "plain ε̂ = 1"),
        ("a\x1b[2Jb", "a [2Jb"),
        ("a\r\n\tb", "a b"),
        ("a\x9b31mb", "a 31mb"),
        ("abc\u202egpj.exe", "abc gpj.exe"),
        ("bad\udcff.mcap", "bad .mcap"),
    ],
)
def test_clean(text: str, shown: str) -> None:
    assert clean(text) == shown


def test_markup_of_a_log_is_shown_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    Terminal().show("/topic[/red] [link=http://x]y :smile:")
    assert capsys.readouterr().out == "/topic[/red] [link=http://x]y :smile:\n"


def test_json_goes_to_stdout_and_all_else_to_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    terminal = Terminal(json=True)
    terminal.show("Report: x")
    terminal.note("something")
    terminal.show_json({"ε": 1.5, "file": "bad\udcff.mcap"})
    seen = capsys.readouterr()
    assert json.loads(seen.out) == {"ε": 1.5, "file": "bad\udcff.mcap"}
    assert seen.err == "Report: x\nnote: something\n"


def test_json_refuses_values_that_json_does_not_have() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        Terminal().show_json({"x": float("nan")})


def test_quiet_keeps_errors_and_json(capsys: pytest.CaptureFixture[str]) -> None:
    terminal = Terminal(quiet=True)
    terminal.show("result")
    terminal.note("note")
    terminal.error("broken")
    terminal.show_json([])
    assert capsys.readouterr() == ("[]\n", "error: broken\n")


def test_progress_is_silent_without_a_terminal_and_lines_when_verbose(capsys: pytest.CaptureFixture[str]) -> None:
    for terminal, shown in (
        (Terminal(), ""),
        (Terminal(verbose=True), "starting\nreading two [31m\n"),
        (Terminal(True, True), ""),
    ):
        with terminal.progress(Stage.STARTING) as subscriber:
            subscriber(Progress(Stage.READING, "two\x1b[31m"))
        assert capsys.readouterr() == ("", shown)


def test_an_error_is_one_line_however_long(capsys: pytest.CaptureFixture[str]) -> None:
    Terminal().error("word " * 200 + "\nend")
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(("no_color", "coloured"), [(None, True), ("1", False)])
def test_colours_on_a_terminal_unless_no_color(
    no_color: str | None, coloured: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(type(sys.stdout), "isatty", lambda self: True)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    if no_color:
        monkeypatch.setenv("NO_COLOR", no_color)
    Terminal().show(Text("STOP", style="red"))
    assert ("\x1b[31m" in capsys.readouterr().out) is coloured


def test_lines_have_no_trailing_spaces(capsys: pytest.CaptureFixture[str]) -> None:
    from cli.tables.layout import table

    Terminal().show(table(("a", "b"), [("long text here", "x"), ("y", "z")]))
    assert all(line == line.rstrip() for line in capsys.readouterr().out.splitlines())


def test_broken_pipe_discards_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken:
        def write(self, text: str) -> int:
            raise BrokenPipeError

        def flush(self) -> None: ...

    discarded: list[object] = []
    monkeypatch.setattr(console, "discard", discarded.append)
    stream = Broken()
    console._write(stream, "x")  # type: ignore[arg-type]
    assert discarded == [stream]
