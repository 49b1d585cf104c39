"""`--open`: the page in a browser, or where it stands; never an error."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import Any

import pytest

from cli.terminal.browser import show_page
from cli.terminal.console import Terminal

VARIABLES = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Pages that a browser was asked for, on a Linux machine without a display."""
    pages: list[str] = []
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr(webbrowser, "open", lambda page: not pages.append(page))
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    return pages


@pytest.mark.parametrize("name", VARIABLES)
def test_a_display_gets_the_page(
    name: str, opened: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(name, "x")
    show_page(Terminal(), Path("a b.html"))
    assert opened == [Path("a b.html").absolute().as_uri()]
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_desktops_always_have_one(system: str, opened: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", system)
    show_page(Terminal(), Path("page.html"))
    assert len(opened) == 1


def test_without_a_display_the_path_is_said(opened: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    show_page(Terminal(), Path("page.html"))
    assert opened == []
    assert capsys.readouterr().err == f"note: there is no display; open {Path('page.html').absolute()} yourself\n"


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        (False, "no browser could be started; open"),
        (webbrowser.Error("gone"), "could not be started (gone); open"),
        (OSError("denied"), "could not be started (denied); open"),
    ],
)
def test_a_browser_that_does_not_start_is_no_error(
    outcome: Any, words: str, opened: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def attempt(page: str) -> bool:
        if isinstance(outcome, Exception):
            raise outcome
        return bool(outcome)

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(webbrowser, "open", attempt)
    show_page(Terminal(), Path("page.html"))
    assert words in capsys.readouterr().err
